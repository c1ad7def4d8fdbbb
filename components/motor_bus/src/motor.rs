//! One simulated motor. Its limits are parameters that may change while it moves, so it is given
//! them each time.

use motor_bus_generated::parameters::MotorsParams;
use std::f64::consts::TAU;
use std::time::Duration;

/// Last goal of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Goal {
    /// To be at `target`, in rad, and to get there at no more than `speed`, in rad/s.
    Position { target: f32, speed: f32 },
    /// To turn at `speed`, in rad/s, which it reaches at no more than `acceleration`, in rad/s².
    Velocity { speed: f32, acceleration: f32 },
}

impl Goal {
    /// To be at `target`, as fast as `max_speed` says; 0 means as fast as the motor can.
    pub(crate) fn position(
        limits: &MotorsParams,
        target: f32,
        max_speed: f32,
    ) -> Result<Self, String> {
        let MotorsParams { name, min, max, .. } = limits;
        if !(*min..=*max).contains(&target) {
            return Err(format!(
                "`{name}` cannot go to {target} rad: it turns from {min} to {max} rad"
            ));
        }
        let speed = unless_zero(limits, "speed", max_speed, limits.max_speed)?;
        Ok(Self::Position { target, speed })
    }

    /// To turn at `speed`, reached with `max_acceleration`; 0 means at once.
    pub(crate) fn velocity(
        limits: &MotorsParams,
        speed: f32,
        max_acceleration: f32,
    ) -> Result<Self, String> {
        let MotorsParams {
            name, max_speed, ..
        } = limits;
        if !(-max_speed..=*max_speed).contains(&speed) {
            return Err(format!(
                "`{name}` cannot turn at {speed} rad/s: it does at most {max_speed} rad/s"
            ));
        }
        let acceleration = unless_zero(limits, "acceleration", max_acceleration, f32::INFINITY)?;
        Ok(Self::Velocity {
            speed,
            acceleration,
        })
    }

    /// To stand at the zero position.
    pub(crate) fn zero(limits: &MotorsParams) -> Self {
        Self::Position {
            target: limits.zero,
            speed: limits.max_speed,
        }
    }
}

/// The requested value, or `otherwise` if it is 0.
fn unless_zero(
    limits: &MotorsParams,
    what: &str,
    asked: f32,
    otherwise: f32,
) -> Result<f32, String> {
    if asked == 0.0 {
        Ok(otherwise)
    } else if asked > 0.0 {
        Ok(asked)
    } else {
        Err(format!(
            "`{}` cannot have the {what} {asked}: it is at least 0",
            limits.name
        ))
    }
}

/// Where a motor is and how it moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motor {
    /// In rad.
    pub(crate) position: f32,
    /// In rad/s.
    pub(crate) velocity: f32,
    pub(crate) goal: Goal,
}

impl Motor {
    /// A motor that stands at its zero position.
    pub(crate) fn new(limits: &MotorsParams) -> Self {
        Self {
            position: limits.zero,
            velocity: 0.0,
            goal: Goal::zero(limits),
        }
    }

    /// Stops where it is, and stays there.
    pub(crate) fn hold(&mut self) {
        self.velocity = 0.0;
        self.goal = Goal::Position {
            target: self.position,
            speed: 0.0,
        };
    }

    /// Whether the present position is within these limits: an edited number must not move the
    /// motor.
    pub(crate) fn stays_within(&self, limits: &MotorsParams) -> Result<(), String> {
        let MotorsParams { name, min, max, .. } = limits;
        let position = self.position;
        if (*min..=*max).contains(&position) {
            return Ok(());
        }
        Err(format!(
            "`{name}` is at {position} rad, which is not from {min} to {max} rad; move it first"
        ))
    }

    /// Moves on for `elapsed`: never faster than its limit, never beyond its range.
    pub(crate) fn advance(&mut self, limits: &MotorsParams, elapsed: Duration) {
        let seconds = elapsed.as_secs_f32();
        if seconds == 0.0 {
            return;
        }
        let (wanted, speed) = match self.goal {
            Goal::Position { target, speed } => (target, speed.min(limits.max_speed)),
            Goal::Velocity {
                speed,
                acceleration,
            } => {
                let change = acceleration * seconds;
                let speed = self.velocity + (speed - self.velocity).clamp(-change, change);
                (self.position + speed * seconds, limits.max_speed)
            }
        };
        let farthest = speed * seconds;
        let way = wanted.clamp(limits.min, limits.max) - self.position;
        let moved = way.clamp(-farthest, farthest);
        self.position += moved;
        self.velocity = moved / seconds;
    }

    /// Whether it is on its way.
    pub(crate) fn is_moving(&self) -> bool {
        self.velocity != 0.0
    }

    /// Position and speed as the motor counts them, in steps and steps/s.
    pub(crate) fn steps(&self, limits: &MotorsParams) -> (i32, i32) {
        let per_radian = f64::from(limits.steps) / TAU;
        let sign = if limits.inverted { -1.0 } else { 1.0 };
        let position = sign * f64::from(self.position) + f64::from(limits.offset);
        let speed = sign * f64::from(self.velocity);
        let steps = |value: f64| (value * per_radian).round() as i32;
        (steps(position), steps(speed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(100);

    fn limits() -> MotorsParams {
        MotorsParams {
            name: "shoulder".to_owned(),
            id: 1,
            min: -1.0,
            max: 2.0,
            max_speed: 1.0,
            zero: 0.0,
            offset: 0.0,
            inverted: false,
            steps: 4096,
        }
    }

    /// Advances the motor by a number of ticks.
    fn after(goal: Result<Goal, String>, ticks: u32) -> Motor {
        let mut motor = Motor::new(&limits());
        motor.goal = goal.expect("a goal within the limits");
        (0..ticks).for_each(|_| motor.advance(&limits(), TICK));
        motor
    }

    #[test]
    fn a_motor_goes_where_it_is_sent_and_stops_there() {
        let goal = || Goal::position(&limits(), 0.25, 0.0);
        let on_its_way = after(goal(), 2);
        assert!((on_its_way.position - 0.2).abs() < 1e-6, "{on_its_way:?}");
        assert!((on_its_way.velocity - 1.0).abs() < 1e-6 && on_its_way.is_moving());
        // It arrives in the middle of the third tick, and is at rest in the fourth.
        assert_eq!(after(goal(), 3).position, 0.25);
        assert!(after(goal(), 3).velocity < 1.0);
        assert!(!after(goal(), 4).is_moving());
    }

    #[test]
    fn it_is_no_faster_than_asked_and_no_faster_than_it_can() {
        let slow = after(Goal::position(&limits(), 2.0, 0.5), 10);
        assert!((slow.position - 0.5).abs() < 1e-6, "{slow:?}");
        let fast = after(Goal::position(&limits(), 2.0, 50.0), 10);
        assert!((fast.position - 1.0).abs() < 1e-6, "{fast:?}");
    }

    #[test]
    fn a_speed_is_reached_by_its_acceleration_and_ends_at_a_limit() {
        let goal = || Goal::velocity(&limits(), -1.0, 2.0);
        let at = |ticks| after(goal(), ticks).velocity;
        assert!((at(1) + 0.2).abs() < 1e-6 && (at(4) + 0.8).abs() < 1e-6);
        let end = after(goal(), 30);
        assert_eq!((end.position, end.velocity), (-1.0, 0.0));
        assert!((after(Goal::velocity(&limits(), 1.0, 0.0), 1).velocity - 1.0).abs() < 1e-6);
    }

    #[test]
    fn what_is_beyond_the_limits_is_refused() {
        for target in [-1.1, 2.1, f32::NAN, f32::INFINITY] {
            let refused = Goal::position(&limits(), target, 0.0);
            assert!(refused.is_err_and(|why| why.contains("from -1 to 2 rad")));
        }
        assert!(Goal::position(&limits(), 0.0, -1.0).is_err());
        assert!(Goal::position(&limits(), 0.0, f32::NAN).is_err());
        for speed in [1.1, -1.1, f32::NAN] {
            assert!(Goal::velocity(&limits(), speed, 0.0).is_err());
        }
        assert!(Goal::velocity(&limits(), 0.5, -1.0).is_err());
    }

    #[test]
    fn limits_that_change_hold_at_once() {
        let mut motor = after(Goal::position(&limits(), 2.0, 0.0), 10);
        assert!((motor.position - 1.0).abs() < 1e-6, "{motor:?}");
        let narrow = MotorsParams {
            max: 1.5,
            max_speed: 2.0,
            ..limits()
        };
        motor.stays_within(&narrow).expect("limits about it");
        motor.advance(&narrow, TICK);
        // The goal was set when the motor was slower, and could go farther.
        assert!((motor.position - 1.1).abs() < 1e-6, "{motor:?}");
        (0..9).for_each(|_| motor.advance(&narrow, TICK));
        assert_eq!(motor.position, 1.5);
        // It stands at its limit; with the next ones it would have to move.
        motor.stays_within(&narrow).expect("limits about it");
        for (min, max) in [(-1.0, 1.4), (1.6, 2.0)] {
            let beside = MotorsParams {
                min,
                max,
                ..limits()
            };
            let why = motor.stays_within(&beside).expect_err("it would move");
            assert!(why.starts_with("`shoulder` is at 1.5 rad"), "{why}");
        }
    }

    #[test]
    fn steps_are_counted_from_the_offset_and_against_an_inverted_joint() {
        let motor = Motor {
            position: 0.5,
            velocity: 1.0,
            ..Motor::new(&limits())
        };
        assert_eq!(motor.steps(&limits()), (326, 652));
        let inverted = MotorsParams {
            offset: 1.0,
            inverted: true,
            ..limits()
        };
        assert_eq!(motor.steps(&inverted), (326, -652));
    }
}
