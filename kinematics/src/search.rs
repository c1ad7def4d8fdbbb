//! The search for positions: its settings, its limits, and where it begins.

use crate::cell::Choices;
use rc_formula::{Program, Recorder};
use rc_quantity::rotation::Matrix;
use rc_robot::closed::Kind;
use rc_robot::{Chain, Motion, Robot, inverse};
use rc_vocabulary::Primitive;
use std::f64::consts::{PI, TAU};

/// The search for positions. The lists have the numbers of the joints that move the frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// The tolerance, in the unit of lengths.
    pub near: f64,
    /// The tolerance, in rad.
    pub turned: f64,
    /// The least positions; infinite without a limit.
    pub lower: Vec<f64>,
    /// The greatest positions.
    pub upper: Vec<f64>,
    /// The joints that are equal after a whole turn.
    pub endless: Vec<bool>,
    /// The closed form of the positions, if the arm has one. The search begins there.
    pub closed: Option<ClosedForm>,
    /// Where the search begins again: positions after positions.
    pub starts: Vec<f64>,
    /// How often the motion is computed at most after each beginning.
    pub iterations: usize,
    /// Where it begins: the positions of all coordinates. Without it, the caller says it.
    pub seed: Option<Vec<f64>>,
}

/// The positions for a pose, as a formula.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedForm {
    /// Why the arm has one.
    pub kind: Kind,
    /// It takes the three rows of the homogeneous matrix of the pose, and gives positions after positions.
    pub positions: Program,
    /// A whole turn of each joint.
    pub turns: Vec<f64>,
}

/// The settings of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The tolerance, in the unit of lengths.
    pub near: f64,
    /// The tolerance, in rad.
    pub turned: f64,
    /// Whether positions are within the limits of the robot.
    pub keeps_limits: bool,
    /// How often the motion is computed at most after each beginning.
    pub iterations: usize,
    /// How many beginnings there are at most after the first one.
    pub restarts: usize,
    /// The positions of all coordinates where it begins. Without them, the caller says them.
    pub seed: Option<Vec<f64>>,
}

impl Default for Settings {
    /// Enough for arms of six and seven joints in all their limits.
    fn default() -> Self {
        Self {
            near: 1e-6,
            turned: 1e-6,
            keeps_limits: false,
            iterations: 60,
            restarts: 63,
            seed: None,
        }
    }
}

impl Search {
    /// The search of positions of `joints`, which move the end of a chain.
    pub(crate) fn new(
        (robot, choices): (&Robot, &Choices),
        chain: &Chain<'_>,
        joints: &[usize],
        settings: Settings,
    ) -> Self {
        let ranges = ranges(robot);
        let own = joints.iter().map(|at| choices.limits(ranges[*at]));
        let own: Vec<(f64, f64)> = own.collect();
        let metre = choices.grounding.metre;
        let places = joints.iter().zip(&own);
        let places = places.map(|(joint, range)| beginnings(robot, metre, *joint, *range));
        let places: Vec<(f64, f64)> = places.collect();
        let endless = joints
            .iter()
            .map(|joint| is_endless(robot, *joint, &ranges));
        let endless = endless.collect();
        let (lower, upper) = if settings.keeps_limits {
            own.into_iter().unzip()
        } else {
            let count = joints.len();
            (vec![f64::NEG_INFINITY; count], vec![f64::INFINITY; count])
        };
        Self {
            near: settings.near,
            turned: settings.turned,
            lower,
            upper,
            endless,
            closed: ClosedForm::of(chain, robot.coordinates.len(), joints, choices.is_single),
            starts: inverse::starts(&places, settings.restarts),
            iterations: settings.iterations,
            seed: settings.seed,
        }
    }

    /// How often a search begins at most.
    pub fn beginnings(&self) -> usize {
        let joints = self.lower.len().max(1);
        1 + self.starts.len() / joints + self.closed_numbers() / joints
    }

    /// How many numbers the closed form has.
    pub(crate) fn closed_numbers(&self) -> usize {
        let closed = self.closed.as_ref();
        closed.map_or(0, |closed| closed.positions.results().len())
    }
}

impl ClosedForm {
    fn of(
        chain: &Chain<'_>,
        coordinates: usize,
        joints: &[usize],
        is_single: bool,
    ) -> Option<Self> {
        let closed = chain.closed(coordinates)?;
        let closed = if is_single {
            closed.in_single()
        } else {
            closed
        };
        let recorder = Recorder::new(12);
        let input = |at: usize| recorder.input(at, Primitive::F64);
        let rotation: Matrix<_> =
            std::array::from_fn(|row| std::array::from_fn(|column| input(4 * row + column)));
        let translation = std::array::from_fn(|row| input(4 * row + 3));
        // Those of the joints, in the order of the robot.
        let place = |joint: &usize| closed.coordinates.iter().position(|own| own == joint);
        let places: Vec<usize> = joints.iter().map(place).collect::<Option<_>>()?;
        let mut numbers = Vec::new();
        for positions in closed.positions(&rotation, translation) {
            numbers.extend(places.iter().map(|place| positions[*place]));
        }
        let program = recorder.program(&numbers);
        program.is_finite().then(|| Self {
            kind: closed.kind,
            positions: program,
            turns: places.iter().map(|at| TAU / closed.ratios[*at]).collect(),
        })
    }
}

/// Where searches of a coordinate begin: within its range, and without an end in one turn, or within a metre.
fn beginnings(
    robot: &Robot,
    metre: f64,
    coordinate: usize,
    (lower, upper): (f64, f64),
) -> (f64, f64) {
    let far = if turns(robot, coordinate) { PI } else { metre };
    match (lower.is_finite(), upper.is_finite()) {
        (true, true) => (lower, upper),
        (true, false) => (lower, lower + 2.0 * far),
        (false, true) => (upper - 2.0 * far, upper),
        (false, false) => (-far, far),
    }
}

/// The least angle that numbers of 32 bits resolve in a search: some roundings of each joint.
pub(crate) const RESOLVED_ANGLE: f64 = 4e-6;

/// The least distance in m that they resolve: the same part of the length of the chain.
pub(crate) fn resolved_length(robot: &Robot, metre: f64, chain: &Chain<'_>) -> f64 {
    let ranges = ranges(robot);
    let reach = chain.reach(|coordinate| {
        let (lower, upper) = beginnings(robot, metre, coordinate, ranges[coordinate]);
        lower.abs().max(upper.abs())
    });
    let length = RESOLVED_ANGLE * reach / metre;
    // A message shows two digits of it.
    format!("{length:.1e}").parse().unwrap_or(length)
}

/// The least and the greatest position of each coordinate.
pub(crate) fn ranges(robot: &Robot) -> Vec<(f64, f64)> {
    let limits = robot.limits().into_iter();
    let endless = (f64::NEG_INFINITY, f64::INFINITY);
    limits
        .map(|limits| limits.map_or(endless, |limits| (limits.lower, limits.upper)))
        .collect()
}

/// Whether a coordinate turns its own joint.
pub(crate) fn turns(robot: &Robot, coordinate: usize) -> bool {
    let name = &robot.coordinates[coordinate];
    let joints = robot.bodies.iter().filter_map(|body| body.joint.as_ref());
    let mut own = joints.filter(|joint| joint.name == *name);
    own.any(|joint| matches!(joint.motion, Motion::Turns { .. }))
}

/// Whether the robot is equal after a whole turn of a joint without limits.
fn is_endless(robot: &Robot, coordinate: usize, ranges: &[(f64, f64)]) -> bool {
    let joints = robot.bodies.iter().filter_map(|body| body.joint.as_ref());
    let mut own = joints.filter_map(|joint| {
        let (moved, ratio) = joint.motion.driven()?;
        let turns = matches!(joint.motion, Motion::Turns { .. });
        (moved == coordinate).then_some(turns && ratio.fract() == 0.0)
    });
    ranges[coordinate] == (f64::NEG_INFINITY, f64::INFINITY) && own.all(|same| same)
}
