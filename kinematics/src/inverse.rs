//! Inverse solvers: which joints move a frame to a pose, or with a velocity.

use crate::cell::{Cell, Choices};
use crate::search::{Search, Settings};
use crate::work::Work;
use rc_diagnostics::nearest;
use rc_formula::{Interpreter, Program, Recorder, Rejected, Term};
use rc_quantity::Real;
use rc_quantity::rotation::{transposed, turned};
use rc_robot::inverse::{self, Aim, Found, Wish};
use rc_robot::{Chain, State};
use rc_vocabulary::Primitive;
use std::cell::RefCell;
use std::fmt;

/// A function that answers which joints move a frame so.
#[derive(Clone, Debug)]
pub struct Inverse {
    /// Its name.
    pub name: String,
    /// The comment of its author.
    pub doc: Vec<String>,
    /// Its argument, with unit and frame.
    pub question: String,
    /// The frame that moves and the one in which it does, by the places of their bodies.
    pub frames: [usize; 2],
    /// The number of coordinates of the robot.
    pub coordinates: usize,
    /// The coordinates that move the frame.
    pub joints: Vec<usize>,
    /// The motion of the frame. It takes the positions of [`joints`](Self::joints), and gives the six
    /// rows of the Jacobian for them; before it, for a pose, its three rows.
    pub motion: Program,
    /// The question, and the method of the answer.
    pub asked: Question,
}

/// The question of an inverse solver.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Positions for a pose.
    Pose(Search),
    /// Velocities for a velocity.
    Velocity(Rates),
}

/// The choice of velocities. The lists have the numbers of the joints that move the frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Rates {
    /// The cost of velocities that are not preferred.
    pub damping: f64,
    /// The limits, if they are kept.
    pub limits: Option<RateLimits>,
    /// Where joints go when the frame leaves a choice, and the share of the way in a second.
    pub posture: Option<(Vec<f64>, f64)>,
}

/// The limits that velocities keep. The lists have the numbers of the joints that move the frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RateLimits {
    /// The least positions.
    pub lower: Vec<f64>,
    /// The greatest positions.
    pub upper: Vec<f64>,
    /// The greatest speeds; infinite where the robot says none.
    pub fastest: Vec<f64>,
    /// How long velocities last, in s: no joint that moves on its own passes a limit during this
    /// time.
    pub period: f64,
}

/// Two links that a question is about are not those of the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unanswered {
    /// The robot has no such link; perhaps this one.
    UnknownLink(String, Option<String>),
    /// They are parts of different robots.
    Unconnected(String, String),
}

impl fmt::Display for Unanswered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownLink(name, None) => write!(f, "the robot has no link `{name}`"),
            Self::UnknownLink(name, Some(near)) => {
                write!(f, "the robot has no link `{name}`: did you mean `{near}`?")
            }
            Self::Unconnected(tip, base) => {
                write!(
                    f,
                    "nothing connects `{tip}` and `{base}`: they are parts of different robots"
                )
            }
        }
    }
}

impl std::error::Error for Unanswered {}

impl Cell {
    /// The inverse solver of the pose of `tip` in `base`, which no text asks for. Its motion answers where the frame is.
    ///
    /// # Errors
    /// The robot has no such links, or nothing connects them.
    pub fn inverse_of(
        &self,
        tip: &str,
        base: &str,
        settings: Settings,
    ) -> Result<Inverse, Unanswered> {
        let robot = &self.robot;
        let body = |name: &str| {
            robot.body(name).ok_or_else(|| {
                let near = nearest(name, robot.links().map(|(_, name)| name));
                Unanswered::UnknownLink(name.to_owned(), near.map(str::to_owned))
            })
        };
        let frames = [body(tip)?, body(base)?];
        let chain = robot.chain(frames[1], frames[0]);
        let chain =
            chain.ok_or_else(|| Unanswered::Unconnected(tip.to_owned(), base.to_owned()))?;
        let joints = chain.coordinates();
        let coordinates = robot.coordinates.len();
        // It is not printed.
        let choices = Choices {
            is_single: false,
            ..self.choices
        };
        Ok(Inverse {
            name: "inverse".to_owned(),
            doc: Vec::new(),
            question: question_of_pose(tip, base, self.choices.length()),
            frames,
            coordinates,
            motion: motion(&chain, None, coordinates, &joints, true),
            asked: Question::Pose(Search::new((robot, &choices), &chain, &joints, settings)),
            joints,
        })
    }
}

/// The argument of an inverse solver of a pose.
pub(crate) fn question_of_pose(tip: &str, base: &str, length: &str) -> String {
    // Names of links may have any character. A line of a comment stays one.
    format!("Where `{tip}` shall be in `{base}`: the homogeneous matrix for columns, in {length}.")
        .replace(char::is_control, " ")
}

impl Inverse {
    /// The pose of the frame at the positions of all coordinates, in three rows of the homogeneous matrix, then the six rows of the
    /// Jacobian for [`joints`](Self::joints). An inverse of a velocity has no pose.
    ///
    /// # Errors
    /// There is another number of positions.
    pub fn moved(&self, positions: &[f64]) -> Result<Vec<f64>, Rejected> {
        if positions.len() != self.coordinates {
            return Err(Rejected::Count);
        }
        let at: Vec<f64> = self.joints.iter().map(|at| positions[*at]).collect();
        self.motion.run(&at)
    }

    /// The operations of one computation of the motion.
    pub fn work(&self) -> Work {
        Work::of(&self.motion)
    }

    /// Computes positions without printed code: those of all coordinates, and how the search ended.
    /// `last` are the positions before; only an inverse of a velocity gives `None`.
    pub fn positions(&self, target: &[[f64; 4]; 4], last: &[f64]) -> Option<(Vec<f64>, Found)> {
        let Question::Pose(search) = &self.asked else {
            return None;
        };
        let mut all = search.seed.clone().unwrap_or_else(|| last.to_vec());
        if all.len() != self.coordinates {
            return None;
        }
        let mut positions: Vec<f64> = self.joints.iter().map(|at| all[*at]).collect();
        let mut closed = Vec::new();
        if let Some(form) = &search.closed {
            let formula = Interpreter::new(&form.positions);
            closed = vec![0.0; search.closed_numbers()];
            formula
                .ok()?
                .run(target[..3].as_flattened(), &mut closed)
                .ok()?;
            let (lower, upper) = (&search.lower, &search.upper);
            let kept = inverse::nearest(&mut closed, &form.turns, lower, upper, &positions);
            closed.truncate(kept);
        }
        let aim = Aim {
            target,
            near: search.near,
            turned: search.turned,
            lower: &search.lower,
            upper: &search.upper,
            endless: &search.endless,
            closed: &closed,
            starts: &search.starts,
            iterations: search.iterations,
        };
        let interpreter = RefCell::new(Interpreter::new(&self.motion).ok()?);
        let motion = |positions: &[f64], out: &mut [f64]| {
            if interpreter.borrow_mut().run(positions, out).is_err() {
                out.fill(f64::NAN);
            }
        };
        let mut room = vec![0.0; inverse::room(positions.len())];
        let found = inverse::pose(motion, &aim, &mut positions, &mut room);
        for (joint, position) in self.joints.iter().zip(positions) {
            all[*joint] = position;
        }
        Some((all, found))
    }

    /// Computes velocities without printed code: those of all coordinates, and the velocity that the
    /// frame gets by them. Only an inverse of a pose gives `None`.
    ///
    /// # Errors
    /// There is another number of positions.
    pub fn velocities(
        &self,
        positions: &[f64],
        velocity: &[f64; 6],
    ) -> Result<Option<(Vec<f64>, [f64; 6])>, Rejected> {
        let Question::Velocity(rates) = &self.asked else {
            return Ok(None);
        };
        if positions.len() != self.coordinates {
            return Err(Rejected::Count);
        }
        let at: Vec<f64> = self.joints.iter().map(|at| positions[*at]).collect();
        let count = at.len();
        let (mut preferred, mut least, mut most) = (
            vec![0.0; count],
            vec![f64::NEG_INFINITY; count],
            vec![f64::INFINITY; count],
        );
        for joint in 0..count {
            if let Some((posture, gain)) = &rates.posture {
                preferred[joint] = gain * (posture[joint] - at[joint]);
            }
            if let Some(limits) = &rates.limits {
                let fastest = limits.fastest[joint];
                let bound = |limit: f64| {
                    let rate = (limit - at[joint]) / limits.period;
                    inverse::within(rate, -fastest, fastest)
                };
                (least[joint], most[joint]) =
                    (bound(limits.lower[joint]), bound(limits.upper[joint]));
            }
        }
        let wish = Wish {
            velocity,
            damping: rates.damping,
            preferred: &preferred,
            least: &least,
            most: &most,
        };
        let jacobian = self.motion.run(&at)?;
        let mut room = vec![0.0; inverse::room(count)];
        let mut found = vec![0.0; count];
        let achieved = inverse::velocity(&jacobian, &wish, &mut found, &mut room);
        let mut all = vec![0.0; self.coordinates];
        for (joint, rate) in self.joints.iter().zip(found) {
            all[*joint] = rate;
        }
        Ok(Some((all, achieved)))
    }
}

/// The operations of a motion over the positions of some coordinates.
pub(crate) fn motion(
    chain: &Chain<'_>,
    expressed: Option<&Chain<'_>>,
    coordinates: usize,
    joints: &[usize],
    has_pose: bool,
) -> Program {
    let recorder = Recorder::new(joints.len());
    let mut positions = vec![Term::constant(0.0); coordinates];
    for (place, joint) in joints.iter().enumerate() {
        positions[*joint] = recorder.input(place, Primitive::F64);
    }
    let state = State::still(positions);
    let moved = chain.moved(&state);
    let frame = expressed.map(|chain| chain.moved(&state).pose.rotation);
    let seen = |vector| match &frame {
        Some(frame) => turned(&transposed(frame), vector),
        None => vector,
    };
    let mut numbers = Vec::new();
    if has_pose {
        for (row, place) in moved.pose.rotation.iter().zip(moved.pose.translation) {
            numbers.extend([row[0], row[1], row[2], place]);
        }
    }
    let columns = joints.iter().map(|joint| moved.jacobian[*joint]);
    let columns: Vec<_> = columns
        .map(|column| [seen(column.linear), seen(column.angular)])
        .collect();
    for row in 0..6 {
        numbers.extend(columns.iter().map(|column| column[row / 3][row % 3]));
    }
    recorder.program(&numbers)
}
