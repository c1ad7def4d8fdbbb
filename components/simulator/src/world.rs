//! A robot on a floor: wheels, motion and collisions.

use crate::lidar::{Beam, Lidar};
use crate::noise::Noise;
use planar_map::{Map, Point, Pose, Segment};

/// How often the last distance to a wall is halved: the robot stops within a micrometre of it.
const HALVINGS: u32 = 24;

/// How a base moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Speed {
    /// Forwards, in mm/s.
    pub(crate) advance: f64,
    /// Counter-clockwise, in rad/s.
    pub(crate) turn: f64,
}

/// The properties that are constant during a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Robot {
    /// Of the circle that the robot fills, in mm.
    pub(crate) radius: f64,
    /// The fastest its wheels go; both values are positive.
    pub(crate) fastest: Speed,
    /// Scanner, in the middle.
    pub(crate) lidar: Lidar,
}

/// The whole simulated world.
pub(crate) struct Simulation {
    walls: Vec<Segment>,
    robot: Robot,
    /// Simulated time of one step, in s.
    seconds: f64,
    seed: i64,
    /// How many steps were made.
    pub(crate) steps: u64,
    /// The true pose.
    pub(crate) pose: Pose,
    /// The pose by odometry.
    pub(crate) odometer: Pose,
    /// The pose after a correction of the odometry.
    pub(crate) corrected: Pose,
    /// The commanded speed.
    pub(crate) wanted: Speed,
    /// The speed in the last step.
    pub(crate) actual: Speed,
}

impl Simulation {
    /// The robot starts at its place in the map; its odometer knows that place.
    ///
    /// The error is for the user: the robot does not fit there.
    pub(crate) fn new(map: &Map, robot: Robot, seconds: f64, seed: i64) -> Result<Self, String> {
        let simulation = Self {
            walls: map.segments(),
            robot,
            seconds,
            seed,
            steps: 0,
            pose: map.start,
            odometer: map.start,
            corrected: map.start,
            wanted: Speed::default(),
            actual: Speed::default(),
        };
        let at = map.start.point();
        if simulation.clearance(at) < robot.radius || map.boxes.iter().any(|b| b.contains(at)) {
            return Err(format!(
                "the robot (radius {} mm) does not fit where the map puts it",
                robot.radius
            ));
        }
        Ok(simulation)
    }

    /// How the robot is built.
    pub(crate) fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Commands a speed. It is limited to the robot's maximum; a value that is not a number stops
    /// the robot.
    pub(crate) fn ask(&mut self, wanted: Speed) {
        let cut = |value: f64, limit: f64| {
            if value.is_nan() {
                0.0
            } else {
                value.clamp(-limit, limit)
            }
        };
        let Speed { advance, turn } = self.robot.fastest;
        self.wanted = Speed {
            advance: cut(wanted.advance, advance),
            turn: cut(wanted.turn, turn),
        };
    }

    /// Lets the time of one step pass. A wall ends the way forwards, but not the turn.
    pub(crate) fn step(&mut self) {
        let (advance, turn) = (
            self.wanted.advance * self.seconds,
            self.wanted.turn * self.seconds,
        );
        let free = self.free_part(advance, turn);
        for pose in [&mut self.pose, &mut self.odometer, &mut self.corrected] {
            *pose = pose
                .after(advance * free, turn * free)
                .after(0.0, turn * (1.0 - free));
        }
        self.actual = Speed {
            advance: self.wanted.advance * free,
            turn: self.wanted.turn,
        };
        self.steps += 1;
    }

    /// The present scan; all calls between two steps return the same one.
    pub(crate) fn scan(&self) -> Vec<Beam> {
        let mut noise = Noise::of_step(self.seed, self.steps);
        self.robot.lidar.scan(&self.walls, self.pose, &mut noise)
    }

    /// From `point` to the nearest wall, in mm.
    pub(crate) fn clearance(&self, point: Point) -> f64 {
        self.walls
            .iter()
            .map(|wall| wall.distance_to(point))
            .fold(f64::INFINITY, f64::min)
    }

    /// How much of this motion, from 0 to 1, is possible before the robot touches a wall.
    fn free_part(&self, advance: f64, turn: f64) -> f64 {
        let at = |part: f64| self.pose.after(advance * part, turn * part).point();
        // Short enough that no wall is jumped over.
        let pieces = (advance.abs() / (self.robot.radius / 2.0)).ceil().max(1.0) as u32;
        let mut reached = 0.0;
        for piece in 1..=pieces {
            let next = f64::from(piece) / f64::from(pieces);
            if !self.fits(at(reached), at(next)) {
                let (mut free, mut blocked) = (reached, next);
                for _ in 0..HALVINGS {
                    let middle = f64::midpoint(free, blocked);
                    let end = if self.fits(at(reached), at(middle)) {
                        &mut free
                    } else {
                        &mut blocked
                    };
                    *end = middle;
                }
                return free;
            }
            reached = next;
        }
        1.0
    }

    /// Whether the robot can be at `to`. One that touches a wall may always go away from it.
    fn fits(&self, from: Point, to: Point) -> bool {
        let clearance = self.clearance(to);
        clearance >= self.robot.radius || clearance > self.clearance(from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;
    use std::path::Path;

    const ROBOT: Robot = Robot {
        radius: 200.0,
        fastest: Speed {
            advance: 1000.0,
            turn: 3.0,
        },
        lidar: Lidar {
            beams: 3,
            field_of_view: PI,
            max_range: 5000.0,
            noise: 10.0,
        },
    };

    fn simulation() -> Simulation {
        let map = Map::parse(Path::new("test"), "wall 1000 -2000 1000 2000\nrobot 0 0 0").unwrap();
        Simulation::new(&map, ROBOT, 0.1, 1).unwrap()
    }

    fn driven(advance: f64, turn: f64, steps: u32) -> Simulation {
        let mut simulation = simulation();
        simulation.ask(Speed { advance, turn });
        (0..steps).for_each(|_| simulation.step());
        simulation
    }

    #[test]
    fn the_robot_drives_as_far_as_speed_times_time() {
        let simulation = driven(300.0, 0.0, 10);
        assert!((simulation.pose.x - 300.0).abs() < 1e-9);
        assert_eq!(
            simulation.actual,
            Speed {
                advance: 300.0,
                turn: 0.0
            }
        );
    }

    #[test]
    fn a_wall_stops_the_robot_but_not_its_turn() {
        let simulation = driven(500.0, 0.0, 40);
        assert!(
            (simulation.pose.x - 800.0).abs() < 1e-3,
            "{:?}",
            simulation.pose
        );
        assert!(simulation.actual.advance < 1.0);
        let mut turning = simulation;
        turning.ask(Speed {
            advance: 100.0,
            turn: 1.0,
        });
        (0..30).for_each(|_| turning.step());
        assert!(
            turning.pose.x < 800.0 && (turning.pose.heading - 3.0).abs() < 1e-9,
            "{:?}",
            turning.pose
        );
    }

    #[test]
    fn a_fast_robot_does_not_jump_through_a_wall() {
        let map = Map::parse(Path::new("test"), "wall 1000 -2000 1000 2000\nrobot 0 0 0").unwrap();
        let mut simulation = Simulation::new(&map, ROBOT, 10.0, 1).unwrap();
        simulation.ask(Speed {
            advance: 1000.0,
            turn: 0.0,
        });
        simulation.step();
        assert!((simulation.pose.x - 800.0).abs() < 1e-2);
    }

    #[test]
    fn speeds_are_cut_and_nonsense_stops() {
        assert_eq!(
            driven(9000.0, -9.0, 0).wanted,
            Speed {
                advance: 1000.0,
                turn: -3.0
            }
        );
        assert_eq!(
            driven(f64::NAN, f64::INFINITY, 0).wanted,
            Speed {
                advance: 0.0,
                turn: 3.0
            }
        );
    }

    #[test]
    fn a_scan_is_the_same_until_the_next_step() {
        let mut simulation = simulation();
        assert_eq!(simulation.scan(), simulation.scan());
        let before = simulation.scan();
        simulation.step();
        assert_ne!(simulation.scan(), before);
    }

    #[test]
    fn a_start_in_a_wall_or_in_furniture_is_refused() {
        for text in [
            "wall 100 0 100 900\nrobot 0 0 0",
            "box -900 -900 900 900\nrobot 0 0 0",
        ] {
            let map = Map::parse(Path::new("test"), text).unwrap();
            assert!(Simulation::new(&map, ROBOT, 0.1, 1).is_err());
        }
    }
}
