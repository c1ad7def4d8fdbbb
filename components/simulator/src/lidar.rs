//! A laser scanner among walls.

use crate::noise::Noise;
use planar_map::{Pose, Segment, libm};

/// One measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beam {
    /// In rad from straight ahead, counter-clockwise.
    pub(crate) angle: f64,
    /// In mm.
    pub(crate) distance: f64,
}

/// How the scanner is built.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lidar {
    /// Measures in one scan, at least 2.
    pub(crate) beams: u16,
    /// From the first measure to the last, in rad; straight ahead is its middle.
    pub(crate) field_of_view: f64,
    /// The range of the scanner, in mm.
    pub(crate) max_range: f64,
    /// Standard deviation of a distance, in mm.
    pub(crate) noise: f64,
}

impl Lidar {
    /// Angle between two measures, in rad.
    pub(crate) fn resolution(&self) -> f64 {
        self.field_of_view / f64::from(self.beams.max(2) - 1)
    }

    /// A scan from `pose`, from right to left.
    pub(crate) fn scan(&self, walls: &[Segment], pose: Pose, noise: &mut Noise) -> Vec<Beam> {
        (0..self.beams)
            .map(|index| {
                let angle = f64::from(index) * self.resolution() - self.field_of_view / 2.0;
                Beam {
                    angle,
                    distance: self.measure(walls, pose, angle, noise.normal()),
                }
            })
            .collect()
    }

    /// A distance in mm; `error` is in standard deviations.
    fn measure(&self, walls: &[Segment], pose: Pose, angle: f64, error: f64) -> f64 {
        let (sin, cos) = libm::sincos(pose.heading + angle);
        let hits = walls
            .iter()
            .filter_map(|wall| wall.hit_from(pose.point(), cos, sin));
        let nearest = hits.fold(f64::INFINITY, f64::min);
        if nearest > self.max_range {
            return self.max_range;
        }
        (nearest + error * self.noise).clamp(0.0, self.max_range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use planar_map::Point;
    use std::f64::consts::PI;

    const EXACT: Lidar = Lidar {
        beams: 5,
        field_of_view: PI,
        max_range: 1000.0,
        noise: 0.0,
    };

    fn corner() -> [Segment; 2] {
        let at = Point::new(300.0, 400.0);
        [
            (at, Point::new(300.0, -400.0)),
            (at, Point::new(-300.0, 400.0)),
        ]
        .map(|(a, b)| Segment { a, b })
    }

    #[test]
    fn beams_go_from_right_to_left_and_end_at_the_nearest_wall() {
        let scan = EXACT.scan(&corner(), Pose::default(), &mut Noise::of_step(1, 1));
        let distances: Vec<i64> = scan
            .iter()
            .map(|beam| beam.distance.round() as i64)
            .collect();
        assert_eq!(distances, [1000, 424, 300, 424, 400]);
        assert_eq!(scan[0].angle, -PI / 2.0);
        assert_eq!(scan[4].angle, PI / 2.0);
    }

    #[test]
    fn noise_moves_what_is_seen_and_leaves_what_is_not() {
        let noisy = Lidar {
            noise: 10.0,
            ..EXACT
        };
        let scan = noisy.scan(&corner(), Pose::default(), &mut Noise::of_step(1, 1));
        assert_eq!(scan[0].distance, 1000.0);
        assert!(scan[2].distance != 300.0 && (scan[2].distance - 300.0).abs() < 60.0);
    }
}
