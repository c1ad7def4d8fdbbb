//! A robot with its solvers.

use crate::ast::{Math, MotionPart, Rate};
use crate::inverse::Inverse;
use crate::work::Work;
use rc_formula::{Program, Recorder, Rejected, Term};
use rc_quantity::Real;
use rc_quantity::rotation::{Quaternion, transposed, turned};
use rc_robot::dynamics::{self, Load, Motions};
use rc_robot::loops::{self, Loop};
use rc_robot::{Chain, Grounding, LoopJoint, Robot, State};
use rc_vocabulary::Primitive;

/// A robot with its solvers.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Its name.
    pub name: String,
    /// The choices of printed code.
    pub choices: Choices,
    /// The robot.
    pub robot: Robot,
    /// All loops: those of its sets, then those of the text.
    pub loops: Vec<LoopJoint>,
    /// In the order of the text.
    pub solvers: Vec<Solver>,
    /// The solvers that answer which joints move a frame so, in the order of the text.
    pub inverses: Vec<Inverse>,
}

/// Choices of printed code: they change its numbers, not their meaning. The robot and all programs have them already, except
/// for the layout of matrices and the type of numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choices {
    /// Where printed Rust has sine, cosine and roots from.
    pub math: Math,
    /// Whether numbers are f32, not f64.
    pub is_single: bool,
    /// Whether matrices are printed by columns, not by rows.
    pub by_columns: bool,
    /// The axes of frames, and the unit of lengths.
    pub grounding: Grounding,
}

/// A function of positions, velocities, accelerations, efforts and payloads.
#[derive(Clone, Debug)]
pub struct Solver {
    /// Its name.
    pub name: String,
    /// The comment of its author.
    pub doc: Vec<String>,
    /// Its outputs.
    pub outputs: Vec<Output>,
    /// Whether it takes velocities.
    pub takes_velocities: bool,
    /// Whether it takes accelerations.
    pub takes_accelerations: bool,
    /// Whether it takes efforts.
    pub takes_efforts: bool,
    /// The numbers of each payload: [`PAYLOAD`].
    pub payloads: Vec<Payload>,
    /// Its operations. The input has the positions of all coordinates, their velocities, accelerations
    /// and efforts, then the numbers of payloads; the output those of [`outputs`](Self::outputs) by rows.
    pub program: Program,
}

/// How many numbers a payload has: the mass, the centre of mass, and the moments xx, xy, xz, yy, yz and zz
/// about it.
pub const PAYLOAD: usize = 10;

/// A mass that the caller says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Payload {
    /// Its name in printed code.
    pub name: String,
    /// The kind of its numbers.
    pub doc: String,
}

/// Something that a solver gives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Its name in printed code.
    pub name: String,
    /// Its meaning, unit and frame.
    pub doc: String,
    /// How many numbers it has.
    pub shape: Shape,
    /// Its motion, if it is one of two frames.
    pub asked: Option<Asked>,
}

/// A motion of one frame in another one, by the places of bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    /// Which part of the motion.
    pub what: MotionPart,
    /// The frame that moves.
    pub tip: usize,
    /// The frame in which it does.
    pub base: usize,
    /// The frame along whose axes it is given, if that is another one than the base.
    pub expressed: Option<usize>,
}

/// The layout of the numbers of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// This many numbers.
    Vector(usize),
    /// Rows and columns.
    Matrix(usize, usize),
}

impl Shape {
    /// How many numbers it has.
    pub fn size(self) -> usize {
        match self {
            Self::Vector(length) => length,
            Self::Matrix(rows, columns) => rows * columns,
        }
    }
}

impl Solver {
    /// Its operations.
    pub fn work(&self) -> Work {
        Work::of(&self.program)
    }

    /// Computes it without printed code, for the state of all coordinates, their efforts, and the
    /// numbers of all payloads.
    ///
    /// # Errors
    /// An array has more or fewer numbers.
    pub fn run(
        &self,
        state: &State,
        efforts: &[f64],
        payloads: &[f64],
    ) -> Result<Vec<f64>, Rejected> {
        let State {
            positions,
            velocities,
            accelerations,
        } = state;
        let of_payloads = PAYLOAD * self.payloads.len();
        let count = self.program.inputs().saturating_sub(of_payloads) / 4;
        let of_joints = [positions, velocities, accelerations, efforts];
        if of_joints.iter().any(|array| array.len() != count) {
            return Err(Rejected::Count);
        }
        let parts = [positions, velocities, accelerations, efforts, payloads];
        self.program.run(&parts.concat())
    }
}

/// The computation of an output, with its names resolved.
#[derive(Clone, Debug)]
pub(crate) enum Computed<'r> {
    Motion {
        what: MotionPart,
        chain: Chain<'r>,
        /// From the frame of the vectors to the base of the chain.
        expressed: Option<Chain<'r>>,
    },
    Efforts([f64; 3]),
    MassMatrix,
    Accelerations([f64; 3]),
    Closed(OfLoops),
    /// These numbers of each coordinate times a factor, and an offset.
    Driven(Rate, Vec<(f64, f64)>),
}

/// An output of all loops.
#[derive(Clone, Debug)]
pub(crate) enum OfLoops {
    Errors,
    Jacobian,
    Forces([f64; 3]),
    /// Under this gravity, of all but these coordinates.
    Efforts([f64; 3], Vec<usize>),
    /// Without these coordinates.
    Positions(Vec<usize>),
    Velocities(Vec<usize>),
}

/// What all outputs of a solver are about.
pub(crate) struct Subject<'r> {
    pub(crate) robot: &'r Robot,
    pub(crate) loops: &'r [Loop<'r>],
    /// The bodies that carry the payloads.
    pub(crate) payloads: &'r [usize],
}

impl Computed<'_> {
    /// Whether it needs velocities and accelerations.
    pub(crate) fn needs(&self) -> (bool, bool) {
        match self {
            Self::Motion { what, .. } => match what {
                MotionPart::Pose | MotionPart::Quaternion | MotionPart::Jacobian => (false, false),
                MotionPart::Velocity => (true, false),
                MotionPart::Acceleration => (true, true),
            },
            Self::Efforts(_) => (true, true),
            Self::MassMatrix => (false, false),
            Self::Accelerations(_) => (true, false),
            Self::Driven(rate, _) => (*rate == Rate::Velocities, false),
            Self::Closed(output) => match output {
                OfLoops::Errors | OfLoops::Jacobian | OfLoops::Positions(_) => (false, false),
                OfLoops::Forces(_) | OfLoops::Velocities(_) => (true, false),
                OfLoops::Efforts(..) => (true, true),
            },
        }
    }

    /// Whether it takes the forces of joints.
    pub(crate) fn needs_efforts(&self) -> bool {
        self.is_forced() || matches!(self, Self::Driven(Rate::Efforts, _))
    }

    /// Whether it is a motion under forces of joints.
    fn is_forced(&self) -> bool {
        matches!(
            self,
            Self::Accelerations(_) | Self::Closed(OfLoops::Forces(_))
        )
    }

    /// Whether gravity changes it.
    pub(crate) fn has_weight(&self) -> bool {
        self.is_forced() || matches!(self, Self::Efforts(_) | Self::Closed(OfLoops::Efforts(..)))
    }

    /// Whether it is of masses, and changes with payloads.
    pub(crate) fn has_masses(&self) -> bool {
        matches!(self, Self::MassMatrix) || self.has_weight()
    }

    /// How many joints its algorithm passes.
    pub(crate) fn steps(&self, robot: &Robot, loops: &[Loop<'_>]) -> usize {
        let rows: usize = loops.iter().map(Loop::rows).sum();
        let of_loops = rows * robot.coordinates.len() + rows * rows;
        match self {
            Self::Closed(OfLoops::Errors | OfLoops::Jacobian) => {
                loops.iter().map(|closed| closed.chain.len()).sum()
            }
            Self::Closed(OfLoops::Velocities(_)) => of_loops,
            Self::Closed(OfLoops::Positions(_)) => 4 * of_loops,
            Self::Closed(OfLoops::Efforts(..)) => {
                let count = robot.coordinates.len();
                robot.bodies.len() + of_loops * count + count * count * count
            }
            Self::Motion {
                chain, expressed, ..
            } => chain.len() + expressed.as_ref().map_or(0, Chain::len),
            Self::Efforts(_) => robot.bodies.len(),
            Self::Driven(_, all) => all.len(),
            Self::MassMatrix | Self::Accelerations(_) | Self::Closed(OfLoops::Forces(_)) => {
                // The algorithm goes from each moving body to the root.
                let mut depths: Vec<usize> = Vec::with_capacity(robot.bodies.len());
                let mut steps = robot.bodies.len() + of_loops;
                for body in &robot.bodies {
                    let joint = body.joint.as_ref();
                    let depth = joint.map_or(0, |joint| depths[joint.parent] + 1);
                    depths.push(depth);
                    if joint.is_some_and(|joint| joint.motion.driven().is_some()) {
                        steps += depth;
                    }
                }
                steps
            }
        }
    }

    /// Its numbers, by rows.
    fn numbers<T: Real>(
        &self,
        subject: &Subject<'_>,
        state: &State<T>,
        efforts: &[T],
        loads: &[Load<T>],
    ) -> Vec<T> {
        let Subject { robot, loops, .. } = subject;
        let forced = |gravity: &[f64; 3]| {
            let motions = Motions {
                state,
                efforts,
                gravity: *gravity,
            };
            loops::accelerations(robot, loops, &motions, loads)
        };
        match self {
            Self::Closed(output) => match output {
                OfLoops::Errors => loops::errors(loops, state),
                OfLoops::Jacobian => loops::jacobian(loops, state).concat(),
                OfLoops::Forces(gravity) => forced(gravity).1,
                OfLoops::Efforts(gravity, passive) => {
                    loops::efforts(robot, loops, (state, *gravity), loads, passive)
                }
                OfLoops::Positions(held) => loops::closed_positions(loops, state, held),
                OfLoops::Velocities(held) => loops::closed_velocities(loops, state, held),
            },
            Self::Driven(rate, all) => {
                let own = match rate {
                    Rate::Positions => &state.positions[..],
                    Rate::Velocities => &state.velocities,
                    Rate::Efforts => efforts,
                };
                let own = own.iter().zip(all);
                own.map(|(own, (factor, offset))| {
                    *own * T::constant(*factor) + T::constant(*offset)
                })
                .collect()
            }
            Self::Efforts(gravity) => dynamics::efforts(robot, state, *gravity, loads),
            Self::MassMatrix => dynamics::mass_matrix(robot, state, loads).concat(),
            Self::Accelerations(gravity) => forced(gravity).0,
            Self::Motion {
                what,
                chain,
                expressed,
            } => {
                let moved = chain.moved(state);
                let expressed = expressed.as_ref().map(|chain| chain.moved(state).pose);
                let seen = |vector: [T; 3]| match &expressed {
                    Some(frame) => turned(&transposed(&frame.rotation), vector),
                    None => vector,
                };
                match what {
                    MotionPart::Pose => {
                        let (zero, one) = (T::constant(0.0), T::constant(1.0));
                        let rows = moved.pose.rotation.iter().zip(moved.pose.translation);
                        let rows = rows.flat_map(|(row, place)| [row[0], row[1], row[2], place]);
                        rows.chain([zero, zero, zero, one]).collect()
                    }
                    MotionPart::Quaternion => {
                        let turn = Quaternion::of_matrix(&moved.pose.rotation).to_xyzw();
                        [&moved.pose.translation[..], &turn].concat()
                    }
                    MotionPart::Jacobian => {
                        let columns = moved.jacobian.iter();
                        let columns: Vec<[[T; 3]; 2]> = columns
                            .map(|column| [seen(column.linear), seen(column.angular)])
                            .collect();
                        let rows = (0..6).flat_map(|row| {
                            let part = move |column: &[[T; 3]; 2]| column[row / 3][row % 3];
                            columns.iter().map(part)
                        });
                        rows.collect()
                    }
                    MotionPart::Velocity => {
                        let parts = [moved.linear_velocity, moved.angular_velocity];
                        parts.map(seen).concat()
                    }
                    MotionPart::Acceleration => {
                        let parts = [moved.linear_acceleration, moved.angular_acceleration];
                        parts.map(seen).concat()
                    }
                }
            }
        }
    }
}

/// The operations of all these outputs, for payloads at these bodies.
pub(crate) fn recorded(subject: &Subject<'_>, outputs: &[Computed<'_>]) -> Program {
    let payloads = subject.payloads;
    let count = subject.robot.coordinates.len();
    let recorder = Recorder::new(4 * count + PAYLOAD * payloads.len());
    let one = |at: usize| recorder.input(at, Primitive::F64);
    let input =
        |from: usize| -> Vec<Term<'_>> { (from * count..(from + 1) * count).map(one).collect() };
    let state = State {
        positions: input(0),
        velocities: input(1),
        accelerations: input(2),
    };
    let efforts = input(3);
    let loads = payloads.iter().enumerate().map(|(place, body)| {
        let of = |at: usize| one(4 * count + PAYLOAD * place + at);
        Load {
            body: *body,
            mass: of(0),
            centre: [of(1), of(2), of(3)],
            tensor: [
                [of(4), of(5), of(6)],
                [of(5), of(7), of(8)],
                [of(6), of(8), of(9)],
            ],
        }
    });
    let loads: Vec<Load<Term<'_>>> = loads.collect();
    let numbers = outputs.iter();
    let numbers = numbers.map(|output| output.numbers(subject, &state, &efforts, &loads));
    recorder.program(&numbers.collect::<Vec<_>>().concat())
}
