//! Where the joint has to be, from one moment to the next.

use std::f32::consts::TAU;
use std::time::Duration;

/// Limits of a joint, in rad and rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    pub(crate) min: f32,
    pub(crate) max: f32,
    pub(crate) max_speed: f32,
}

impl Limits {
    /// An error if the joint cannot do this value of the parameter `path`.
    pub(crate) fn fault(self, path: &str, value: f32) -> Option<String> {
        let Self { min, max, .. } = self;
        if path == "sine.amplitude" {
            // As a person writes it: 1.85, not 1.8499999.
            let most = ((max - min) / 2.0 * 1e4).round() / 1e4;
            return (value > most).then(|| {
                format!(
                    "`{path}` is at most {most} rad, because the motor turns from {min} to {max} rad"
                )
            });
        }
        let is_way_point = path == "way_points" || path.starts_with("way_points[");
        (is_way_point && !(min..=max).contains(&value)).then(|| {
            format!(
                "the way point {value} is out of reach: the motor turns from {min} to {max} rad"
            )
        })
    }
}

/// A sine about the middle of the range. It keeps its phase, so that a change of its frequency is
/// not a jump.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sine {
    /// From 0 to 1.
    phase: f32,
}

impl Sine {
    /// Advances by `elapsed`, and returns the target position of the joint.
    pub(crate) fn advance(
        &mut self,
        limits: Limits,
        amplitude: f32,
        frequency: f32,
        elapsed: Duration,
    ) -> f32 {
        self.phase = (self.phase + frequency * elapsed.as_secs_f32()).fract();
        let middle = f32::midpoint(limits.min, limits.max);
        let target = middle + amplitude * (TAU * self.phase).sin();
        target.clamp(limits.min, limits.max)
    }
}

/// Way points, one after the other.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tour {
    next: usize,
}

impl Tour {
    /// The next way point, limited to the joint's range; `None` without way points.
    pub(crate) fn target(&self, limits: Limits, way_points: &[f32]) -> Option<f32> {
        // There may be fewer of them than before.
        let index = self.next.checked_rem(way_points.len())?;
        Some(way_points[index].clamp(limits.min, limits.max))
    }

    /// Goes on to the way point after the one that was reached.
    pub(crate) fn reached(&mut self) {
        self.next = self.next.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        min: -1.0,
        max: 2.0,
        max_speed: 1.0,
    };
    const QUARTER: Duration = Duration::from_millis(250);

    #[test]
    fn what_the_joint_cannot_do_is_told() {
        for (path, value) in [
            ("sine.amplitude", 1.5),
            ("sine.frequency", 9.0),
            ("way_points", -1.0),
            ("way_points[3]", 2.0),
        ] {
            assert_eq!(LIMITS.fault(path, value), None, "{path} {value}");
        }
        let amplitude =
            "`sine.amplitude` is at most 1.5 rad, because the motor turns from -1 to 2 rad";
        assert_eq!(
            LIMITS.fault("sine.amplitude", 1.6).as_deref(),
            Some(amplitude)
        );
        let point = "the way point 2.1 is out of reach: the motor turns from -1 to 2 rad";
        for path in ["way_points", "way_points[3]"] {
            assert_eq!(LIMITS.fault(path, 2.1).as_deref(), Some(point));
        }
        assert!(LIMITS.fault("way_points", f32::NAN).is_some());
    }

    #[test]
    fn a_sine_swings_about_the_middle_and_stays_within_the_range() {
        let mut sine = Sine::default();
        let mut next = |amplitude| sine.advance(LIMITS, amplitude, 1.0, QUARTER);
        for expected in [1.0, 0.5, 0.0, 0.5] {
            let target = next(0.5);
            assert!((target - expected).abs() < 1e-5, "{target} {expected}");
        }
        assert_eq!(next(9.0), 2.0);
        next(9.0);
        assert_eq!(next(9.0), -1.0);
    }

    #[test]
    fn another_frequency_is_no_jump() {
        let mut sine = Sine::default();
        let before = sine.advance(LIMITS, 1.0, 0.3, QUARTER);
        let after = sine.advance(LIMITS, 1.0, 3.0, Duration::from_millis(1));
        assert!((after - before).abs() < 0.03, "{before} {after}");
    }

    #[test]
    fn a_tour_begins_again_and_bears_fewer_way_points() {
        let mut tour = Tour::default();
        let points = [0.0, 5.0, -0.5];
        let mut seen = Vec::new();
        for _ in 0..4 {
            seen.extend(tour.target(LIMITS, &points));
            tour.reached();
        }
        assert_eq!(seen, [0.0, 2.0, -0.5, 0.0]);
        assert_eq!(tour.target(LIMITS, &points[..1]), Some(0.0));
        assert_eq!(tour.target(LIMITS, &[]), None);
    }
}
