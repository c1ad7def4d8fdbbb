//! How to get around without bumping into anything: from one scan to one motion.
//!
//! While the way is clear the robot drives, and leans towards the most open direction ahead: doors
//! are open, walls are not. When something is in the way it turns on the spot, to the side with
//! more room, and keeps to that side until the way is clear by a margin: otherwise it would shake
//! its head in every corner.

/// Half the width of the sector ahead, in rad.
const AHEAD: f32 = 0.6;
/// Half the width of the sector in which the robot must not touch anything it passes, in rad.
const ASIDE: f32 = 1.3;
/// The safe distance aside, as a part of the safe distance ahead.
const ASIDE_PART: f32 = 0.45;
/// How much clearer than necessary the way must be before the robot drives again.
const MARGIN: f32 = 1.25;
/// Half the width of the directions to lean towards, in rad.
const VIEW: f32 = 1.0;
/// Half the width of the opening that is looked for, in rad.
const OPENING: f32 = 0.2;
/// How strongly the robot leans towards an opening, in 1/s.
const LEAN: f32 = 0.8;

/// One measure of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measure {
    /// In rad from straight ahead, counter-clockwise.
    pub(crate) angle: f32,
    /// In mm.
    pub(crate) distance: f32,
}

/// The parameters of the policy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// Nothing ahead may come nearer, in mm.
    pub(crate) safe_distance: f32,
    /// In mm/s.
    pub(crate) speed: f32,
    /// In rad/s.
    pub(crate) turn_speed: f32,
}

/// A command for the base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    /// Forwards, in mm/s.
    pub(crate) advance: f32,
    /// Counter-clockwise, in rad/s.
    pub(crate) turn: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Left,
    Right,
}

/// The state between two scans.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Policy {
    /// The side to which the robot is turning on the spot.
    turning: Option<Side>,
}

impl Policy {
    /// Decides on the next motion. A scan without measures stops the robot.
    pub(crate) fn decide(&mut self, scan: &[Measure], settings: &Settings) -> Motion {
        if scan.is_empty() {
            return Motion::default();
        }
        let needed = settings.safe_distance * if self.turning.is_some() { MARGIN } else { 1.0 };
        if is_clear(scan, needed) {
            self.turning = None;
            let lean = (LEAN * opening(scan)).clamp(-settings.turn_speed, settings.turn_speed);
            return Motion {
                advance: settings.speed,
                turn: lean,
            };
        }
        let side = *self.turning.get_or_insert_with(|| freer_side(scan));
        let turn = if side == Side::Left {
            settings.turn_speed
        } else {
            -settings.turn_speed
        };
        Motion { advance: 0.0, turn }
    }
}

/// Whether the robot can drive on.
fn is_clear(scan: &[Measure], needed: f32) -> bool {
    scan.iter().all(|measure| match measure.angle.abs() {
        angle if angle <= AHEAD => measure.distance >= needed,
        angle if angle <= ASIDE => measure.distance >= needed * ASIDE_PART,
        _ => true,
    })
}

/// The side on which things are farther, on average.
fn freer_side(scan: &[Measure]) -> Side {
    let left = mean(scan, |angle| angle > 0.0);
    let right = mean(scan, |angle| angle < 0.0);
    if left >= right {
        Side::Left
    } else {
        Side::Right
    }
}

/// The direction within view in which things are farthest, in rad; straight ahead among equals.
fn opening(scan: &[Measure]) -> f32 {
    let mut best = (mean(scan, |angle| angle.abs() <= OPENING), 0.0);
    for direction in scan
        .iter()
        .map(|measure| measure.angle)
        .filter(|angle| angle.abs() <= VIEW)
    {
        let depth = mean(scan, |angle| (angle - direction).abs() <= OPENING);
        if depth > best.0 {
            best = (depth, direction);
        }
    }
    best.1
}

/// The mean distance over the chosen angles, in mm; 0 without any.
fn mean(scan: &[Measure], chosen: impl Fn(f32) -> bool) -> f32 {
    let distances = scan
        .iter()
        .filter(|measure| chosen(measure.angle))
        .map(|measure| measure.distance);
    let (sum, count) = distances.fold((0.0, 0.0), |(sum, count), distance| {
        (sum + distance, count + 1.0)
    });
    if count > 0.0 { sum / count } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings = Settings {
        safe_distance: 500.0,
        speed: 300.0,
        turn_speed: 0.9,
    };

    /// 37 measures from -π/2 to π/2.
    fn scan(distance: impl Fn(f32) -> f32) -> Vec<Measure> {
        let angles =
            (-18_i16..=18).map(|index| f32::from(index) * std::f32::consts::FRAC_PI_2 / 18.0);
        angles
            .map(|angle| Measure {
                angle,
                distance: distance(angle),
            })
            .collect()
    }

    #[test]
    fn an_open_floor_is_crossed_straight_on() {
        let motion = Policy::default().decide(&scan(|_| 4000.0), &SETTINGS);
        assert_eq!(
            motion,
            Motion {
                advance: 300.0,
                turn: 0.0
            }
        );
    }

    #[test]
    fn the_robot_leans_towards_an_opening() {
        let door_on_the_left = scan(|angle| if angle > 0.4 { 4000.0 } else { 1500.0 });
        let motion = Policy::default().decide(&door_on_the_left, &SETTINGS);
        assert!(motion.advance == 300.0 && motion.turn > 0.0, "{motion:?}");
    }

    #[test]
    fn it_turns_on_the_spot_to_the_freer_side_and_keeps_to_it() {
        let mut policy = Policy::default();
        let blocked = |left: f32, right: f32| {
            scan(move |angle| {
                if angle.abs() < 0.3 {
                    400.0
                } else if angle > 0.0 {
                    left
                } else {
                    right
                }
            })
        };
        assert_eq!(
            policy.decide(&blocked(2000.0, 1000.0), &SETTINGS),
            Motion {
                advance: 0.0,
                turn: 0.9
            }
        );
        assert_eq!(
            policy.decide(&blocked(1000.0, 2000.0), &SETTINGS),
            Motion {
                advance: 0.0,
                turn: 0.9
            }
        );
        // Far enough to drive on, but not by the margin.
        assert_eq!(policy.decide(&scan(|_| 550.0), &SETTINGS).advance, 0.0);
        assert_eq!(policy.decide(&scan(|_| 650.0), &SETTINGS).advance, 300.0);
        assert_eq!(
            policy.decide(&blocked(1000.0, 2000.0), &SETTINGS),
            Motion {
                advance: 0.0,
                turn: -0.9
            }
        );
    }

    #[test]
    fn something_near_aside_stops_it_too_and_something_behind_does_not() {
        let at = |near: f32| {
            scan(move |angle| {
                if (angle - near).abs() < 0.05 {
                    200.0
                } else {
                    3000.0
                }
            })
        };
        assert_eq!(Policy::default().decide(&at(1.2), &SETTINGS).advance, 0.0);
        assert_eq!(Policy::default().decide(&at(1.5), &SETTINGS).advance, 300.0);
    }

    #[test]
    fn a_blind_robot_stands() {
        assert_eq!(Policy::default().decide(&[], &SETTINGS), Motion::default());
    }
}
