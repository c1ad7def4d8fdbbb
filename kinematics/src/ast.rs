//! The syntax tree of a `.kdsl` text.

use rc_diagnostics::Span;
use rc_robot::Held;
use rc_syntax::{Literal, Name};

/// A text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The files of robots.
    pub imports: Vec<Import>,
    /// `Kinematics NAME { … }`
    pub kinematics: Option<Kinematics>,
}

/// `import "FILE" as NAME`
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The file.
    pub file: Name,
    /// The name before those of its links and joints.
    pub alias: Option<Name>,
}

/// `Kinematics NAME { … }`
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics {
    /// Its name.
    pub name: Name,
    /// `lengths mm` and others.
    pub choices: Vec<Choice>,
    /// How robots are held.
    pub mounts: Vec<Mount>,
    /// The frames that are kept together.
    pub loops: Vec<Loop>,
    /// Its postures.
    pub postures: Vec<Posture>,
    /// Its solvers.
    pub solvers: Vec<Solver>,
}

/// `lengths mm`: a choice that changes the numbers of printed code, not their meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The whole of it.
    pub span: Span,
    /// What is chosen.
    pub subject: Subject,
    /// The choice.
    pub word: Name,
}

/// Something that has choices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// Where printed Rust has sine, cosine and roots from.
    Math,
    /// The type of numbers.
    Scalars,
    /// The unit of lengths.
    Lengths,
    /// The order of the numbers of matrices.
    Matrices,
    /// The axes of frames.
    Frames,
}

impl Subject {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Math => "math",
            Self::Scalars => "scalars",
            Self::Lengths => "lengths",
            Self::Matrices => "matrices",
            Self::Frames => "frames",
        }
    }
}

/// Where printed Rust has sine, cosine and roots from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Math {
    /// The standard library.
    #[default]
    Std,
    /// The crate `libm`, for programs without the standard library.
    Libm,
}

/// `fixed LINK in BASE at X, Y, Z rpy R, P, Y`
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// The whole of it.
    pub span: Span,
    /// How the link moves in its base.
    pub held: Held,
    /// The root of a robot.
    pub link: Name,
    /// What holds it.
    pub base: Name,
    /// Where: three lengths, then three angles. Empty at its origin.
    pub place: Vec<Quantity>,
}

/// `loop NAME { FRAME = FRAME; }`
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// Its name.
    pub name: Name,
    /// The frames.
    pub pairs: Vec<(Name, Name)>,
    /// `point` and others: the joint that the frames have between them.
    pub joints: Vec<(Span, LoopKind)>,
}

/// What stays together of the frames of a loop.
#[derive(Clone, Debug, PartialEq)]
pub enum LoopKind {
    /// `point`: the origins.
    Point,
    /// `revolute X, Y, Z`: the origins and this axis.
    Revolute(Vec<Literal>),
    /// `prismatic X, Y, Z`: this line and the axes.
    Prismatic(Vec<Literal>),
}

/// `posture NAME { JOINT = NUMBER; … }`
#[derive(Clone, Debug, PartialEq)]
pub struct Posture {
    /// Its name.
    pub name: Name,
    /// Where joints are.
    pub joints: Vec<(Name, Quantity)>,
}

/// A number with a unit, or none.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The number.
    pub number: Literal,
    /// `mm`
    pub unit: Option<Name>,
}

/// `solver NAME { … }`
#[derive(Clone, Debug, PartialEq)]
pub struct Solver {
    /// Its name.
    pub name: Name,
    /// The comment before it.
    pub doc: Vec<String>,
    /// Its outputs, in the order of the text.
    pub outputs: Vec<Output>,
    /// `gravity X, Y, Z`
    pub gravity: Vec<(Span, Vec<Literal>)>,
    /// `payload NAME at FRAME`
    pub payloads: Vec<Payload>,
    /// `holding JOINT, JOINT`
    pub holding: Vec<(Span, Vec<Name>)>,
    /// `passive JOINT, JOINT`
    pub passive: Vec<(Span, Vec<Name>)>,
    /// Its inverse question: which joints move a frame in the wanted way.
    pub inverses: Vec<Inverse>,
    /// Its settings.
    pub settings: Vec<Setting>,
    /// Whether all of its text was understood.
    pub is_whole: bool,
}

/// `payload NAME at FRAME`: a mass that the caller says.
#[derive(Clone, Debug, PartialEq)]
pub struct Payload {
    /// The whole of it.
    pub span: Span,
    /// Its name.
    pub name: Name,
    /// The link that carries it.
    pub link: Name,
}

/// `inverse pose TIP in BASE` or `inverse velocity TIP in BASE`
#[derive(Clone, Debug, PartialEq)]
pub struct Inverse {
    /// The whole of it.
    pub span: Span,
    /// A pose or a velocity.
    pub what: MotionPart,
    /// The frame that moves.
    pub tip: Name,
    /// The frame in which it does.
    pub base: Name,
    /// `expressed in FRAME`
    pub expressed: Option<Name>,
}

/// The search of an inverse solver.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The whole of it.
    pub span: Span,
    /// Its content.
    pub kind: SettingKind,
}

/// The content of a setting.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingKind {
    /// `within limits`
    Within,
    /// `tolerance 1e-6 m 1e-6 rad`
    Tolerance(Quantity, Quantity),
    /// `iterations 60`
    Iterations(Literal),
    /// `restarts 63`
    Restarts(Literal),
    /// `seed last` or `seed POSTURE`
    Seed(Name),
    /// `damped 0.02`
    Damped(Literal),
    /// `null posture NAME gain 2`
    Null(Name, Option<Literal>),
    /// `period 1 ms`
    Period(Quantity),
}

impl SettingKind {
    /// The word that it begins with.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Within => "within",
            Self::Tolerance(..) => "tolerance",
            Self::Iterations(_) => "iterations",
            Self::Restarts(_) => "restarts",
            Self::Seed(_) => "seed",
            Self::Damped(_) => "damped",
            Self::Null(..) => "null",
            Self::Period(_) => "period",
        }
    }
}

/// Something that a solver gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// The whole of it.
    pub span: Span,
    /// What it is.
    pub kind: OutputKind,
}

/// The output of a solver.
#[derive(Clone, Debug, PartialEq)]
pub enum OutputKind {
    /// `pose TIP in BASE` and others of two frames.
    Motion {
        /// Which part of the motion.
        what: MotionPart,
        /// The frame that moves.
        tip: Name,
        /// The frame in which it does.
        base: Name,
        /// `expressed in FRAME`
        expressed: Option<Name>,
    },
    /// `efforts`
    Efforts,
    /// `mass_matrix`
    MassMatrix,
    /// `accelerations`
    Accelerations,
    /// `loop_errors`
    LoopErrors,
    /// `loop_jacobian`
    LoopJacobian,
    /// `loop_forces`
    LoopForces,
    /// `closed_positions`
    ClosedPositions,
    /// `closed_velocities`
    ClosedVelocities,
    /// `actuator positions` and others: those of actuators for those of joints, or the other way round.
    Driven {
        /// What it gives.
        side: Side,
        /// Which of its numbers.
        rate: Rate,
    },
}

/// A side of transmissions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The joints.
    Joint,
    /// The motors behind them.
    Actuator,
}

impl Side {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Actuator => "actuator",
        }
    }
}

/// Numbers of joints that transmissions change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// Where they are.
    Positions,
    /// How fast they move.
    Velocities,
    /// Their torques and forces.
    Efforts,
}

impl Rate {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Positions => "positions",
            Self::Velocities => "velocities",
            Self::Efforts => "efforts",
        }
    }
}

/// A part of the motion of a frame in another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the words of the language")]
pub enum MotionPart {
    Pose,
    /// `pose TIP in BASE as quaternion`
    Quaternion,
    Jacobian,
    Velocity,
    Acceleration,
}

impl MotionPart {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pose | Self::Quaternion => "pose",
            Self::Jacobian => "jacobian",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
        }
    }
}
