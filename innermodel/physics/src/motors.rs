//! Motors of joints.

use innermodel_simulation::{MotorGoal, MotorState};

/// How far the target of a motor is ahead of the joint at most, in rad or m. A blocked joint
/// gathers no more.
const LEAD: f64 = 0.5;

/// A motor with its goal. Angles are in rad, lengths in m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motor {
    goal: MotorGoal,
    /// Where the joint is. An angle counts whole turns.
    pub(crate) position: f64,
    /// Where the motor pulls to.
    reference: f64,
    /// How fast it goes there, per second.
    rate: f64,
}

/// Goal of a motor in a step of the solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pull {
    /// It pulls to a place that moves at a speed.
    To(f64, f64),
    /// It turns at a speed.
    At(f64),
    /// It is off.
    Off,
}

/// Limits of a joint: least and greatest position, greatest speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub(crate) min: f64,
    pub(crate) max: f64,
    pub(crate) fastest: f64,
}

impl Motor {
    /// A motor that holds its joint.
    pub(crate) fn at(position: f64) -> Self {
        Self {
            goal: MotorGoal::Hold,
            position,
            reference: position,
            rate: 0.0,
        }
    }

    /// Continues from a changed place of the joint.
    pub(crate) fn put(&mut self, position: f64) {
        (self.position, self.reference, self.rate) = (position, position, 0.0);
    }

    /// Takes the goal of the world, whose unit of length is `scale` times smaller.
    pub(crate) fn set_goal(&mut self, state: Option<&MotorState>, scale: f64) {
        let goal = match state.map_or(MotorGoal::Hold, |state| state.goal) {
            MotorGoal::Position { target, speed } => MotorGoal::Position {
                target: target / scale,
                speed: speed / scale,
            },
            MotorGoal::Velocity {
                velocity,
                acceleration,
            } => MotorGoal::Velocity {
                velocity: velocity / scale,
                acceleration: acceleration / scale,
            },
            other => other,
        };
        if goal == self.goal {
            return;
        }
        // A joint that was held goes on from where its motor pulled to.
        if !matches!(self.goal, MotorGoal::Hold | MotorGoal::Position { .. }) {
            self.reference = self.position;
        }
        self.goal = goal;
    }

    /// The action of the motor in a step of `seconds`. A limit that the solver does not know holds,
    /// too.
    pub(crate) fn pull(&mut self, limits: &Limits, seconds: f64) -> Pull {
        let before = self.reference;
        match self.goal {
            MotorGoal::Hold => self.rate = 0.0,
            MotorGoal::Position { target, speed } => {
                let speed = if speed > 0.0 { speed } else { limits.fastest };
                let way = speed.min(limits.fastest) * seconds;
                let next = before + (target - before).clamp(-way, way);
                self.reference = next.clamp(self.position - LEAD, self.position + LEAD);
                self.rate = if speed < limits.fastest || limits.fastest.is_finite() {
                    (self.reference - before) / seconds
                } else {
                    0.0
                };
            }
            MotorGoal::Velocity {
                velocity,
                acceleration,
            } => {
                let most = if acceleration > 0.0 {
                    acceleration * seconds
                } else {
                    f64::INFINITY
                };
                self.rate += (velocity - self.rate).clamp(-most, most);
                let outwards = (self.position >= limits.max && self.rate > 0.0)
                    || (self.position <= limits.min && self.rate < 0.0);
                if outwards {
                    self.rate = 0.0;
                    return Pull::To(self.position.clamp(limits.min, limits.max), 0.0);
                }
                return Pull::At(self.rate);
            }
            MotorGoal::Free => {
                self.rate = 0.0;
                let allowed = self.position.clamp(limits.min, limits.max);
                if allowed == self.position {
                    return Pull::Off;
                }
                return Pull::To(allowed, 0.0);
            }
        }
        Pull::To(self.reference, self.rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Limits = Limits {
        min: f64::NEG_INFINITY,
        max: f64::INFINITY,
        fastest: f64::INFINITY,
    };

    fn goal(goal: MotorGoal) -> MotorState {
        MotorState {
            goal,
            ..MotorState::default()
        }
    }

    #[test]
    fn a_goal_is_approached_at_its_speed() {
        let mut motor = Motor::at(0.0);
        let to = MotorGoal::Position {
            target: 9.0,
            speed: 2.0,
        };
        motor.set_goal(Some(&goal(to)), 1.0);
        assert_eq!(motor.pull(&FREE, 0.1), Pull::To(0.2, 2.0));
        // The joint is stuck.
        for _ in 0..10 {
            motor.pull(&FREE, 0.1);
        }
        assert_eq!(motor.pull(&FREE, 0.1), Pull::To(LEAD, 0.0));
        motor.set_goal(Some(&goal(MotorGoal::Hold)), 1.0);
        assert_eq!(motor.pull(&FREE, 0.1), Pull::To(LEAD, 0.0));
    }

    #[test]
    fn a_speed_is_approached_by_its_acceleration() {
        let mut motor = Motor::at(0.0);
        let turn = MotorGoal::Velocity {
            velocity: -3.0,
            acceleration: 10.0,
        };
        motor.set_goal(Some(&goal(turn)), 1.0);
        assert_eq!(motor.pull(&FREE, 0.1), Pull::At(-1.0));
        assert_eq!(motor.pull(&FREE, 0.1), Pull::At(-2.0));
        let limits = Limits { min: 0.0, ..FREE };
        assert_eq!(motor.pull(&limits, 0.1), Pull::To(0.0, 0.0));
        motor.position = 1.0;
        motor.set_goal(Some(&goal(MotorGoal::Hold)), 1.0);
        assert_eq!(motor.pull(&FREE, 0.1), Pull::To(1.0, 0.0));
    }

    #[test]
    fn a_motor_that_is_off_pulls_to_limits_only() {
        let mut motor = Motor::at(0.5);
        motor.set_goal(Some(&goal(MotorGoal::Free)), 1.0);
        let limits = Limits { max: 1.0, ..FREE };
        assert_eq!(motor.pull(&limits, 0.1), Pull::Off);
        motor.position = 1.1;
        assert_eq!(motor.pull(&limits, 0.1), Pull::To(1.0, 0.0));
    }
}
