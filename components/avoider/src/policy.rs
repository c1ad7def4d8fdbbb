//! Getting around without touching anything: the meaning of a scan, and the motions.
//!
//! While the way is clear, the robot drives, and turns towards the most open direction ahead: doors
//! are open, walls are not. If something is in the way, it turns on the spot, to the side with more
//! room, and keeps to that side until the way is clear by a margin: otherwise it would turn back
//! and forth in every corner. The states of the machine decide between driving and turning.

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
/// How strongly the robot turns towards an opening, in 1/s.
const LEAN: f32 = 0.8;

/// One measure of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// In rad from straight ahead, counter-clockwise.
    pub angle: f32,
    /// In mm.
    pub distance: f32,
}

/// The parameters of the policy.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Nothing ahead may come nearer, in mm.
    pub safe_distance: f32,
    /// In mm/s.
    pub speed: f32,
    /// In rad/s.
    pub turn_speed: f32,
}

/// A command for the base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Forwards, in mm/s.
    pub advance: f32,
    /// Counter-clockwise, in rad/s.
    pub turn: f32,
}

/// A side to which the robot turns on the spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    Left,
    Right,
}

impl Side {
    /// The side on which things are farther, on average.
    pub fn freer(scan: &[Measure]) -> Self {
        let left = mean(scan, |angle| angle > 0.0);
        let right = mean(scan, |angle| angle < 0.0);
        if left >= right {
            Self::Left
        } else {
            Self::Right
        }
    }

    /// A turn to this side, on the spot.
    pub fn turn(self, settings: &Settings) -> Motion {
        let turn = match self {
            Self::Left => settings.turn_speed,
            Self::Right => -settings.turn_speed,
        };
        Motion { advance: 0.0, turn }
    }
}

/// Whether a robot that drives can drive on.
pub fn is_clear(scan: &[Measure], settings: &Settings) -> bool {
    has_room(scan, settings.safe_distance)
}

/// Whether a robot that stands or turns can drive again.
pub fn is_clear_again(scan: &[Measure], settings: &Settings) -> bool {
    !scan.is_empty() && has_room(scan, settings.safe_distance * MARGIN)
}

/// The way on, with a turn towards the most open direction ahead. Without a scan, the robot stops.
pub fn cruise(scan: &[Measure], settings: &Settings) -> Motion {
    if scan.is_empty() {
        return Motion::default();
    }
    Motion {
        advance: settings.speed,
        turn: (LEAN * opening(scan)).clamp(-settings.turn_speed, settings.turn_speed),
    }
}

/// Whether nothing is nearer than this.
fn has_room(scan: &[Measure], needed: f32) -> bool {
    scan.iter().all(|measure| match measure.angle.abs() {
        angle if angle <= AHEAD => measure.distance >= needed,
        angle if angle <= ASIDE => measure.distance >= needed * ASIDE_PART,
        _ => true,
    })
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
        let floor = scan(|_| 4000.0);
        assert!(is_clear(&floor, &SETTINGS));
        let straight = Motion {
            advance: 300.0,
            turn: 0.0,
        };
        assert_eq!(cruise(&floor, &SETTINGS), straight);
    }

    #[test]
    fn the_robot_leans_towards_an_opening() {
        let door_on_the_left = scan(|angle| if angle > 0.4 { 4000.0 } else { 1500.0 });
        let motion = cruise(&door_on_the_left, &SETTINGS);
        assert!(motion.advance == 300.0 && motion.turn > 0.0, "{motion:?}");
    }

    #[test]
    fn it_turns_on_the_spot_to_the_freer_side() {
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
        let (left, right) = (blocked(2000.0, 1000.0), blocked(1000.0, 2000.0));
        assert!(!is_clear(&left, &SETTINGS));
        let turn = |scan: &[Measure]| Side::freer(scan).turn(&SETTINGS);
        assert_eq!((turn(&left).advance, turn(&left).turn), (0.0, 0.9));
        assert_eq!((turn(&right).advance, turn(&right).turn), (0.0, -0.9));
    }

    #[test]
    fn after_a_turn_the_way_must_be_clear_by_a_margin() {
        let (near, far) = (scan(|_| 550.0), scan(|_| 650.0));
        assert!(is_clear(&near, &SETTINGS) && !is_clear_again(&near, &SETTINGS));
        assert!(is_clear_again(&far, &SETTINGS));
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
        assert!(!is_clear(&at(1.2), &SETTINGS));
        assert!(is_clear(&at(1.5), &SETTINGS));
    }

    #[test]
    fn a_blind_robot_stands() {
        assert_eq!(cruise(&[], &SETTINGS), Motion::default());
        assert!(!is_clear_again(&[], &SETTINGS));
    }
}
