//! The syntax tree of a `.kdsl` text.

use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The files of robots.
    pub imports: Vec<Name>,
    /// `Kinematics NAME { … }`
    pub kinematics: Option<Kinematics>,
}

/// `Kinematics NAME { … }`
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics {
    /// Its name.
    pub name: Name,
    /// Its solvers.
    pub solvers: Vec<Solver>,
}

/// `solver NAME { … }`
#[derive(Clone, Debug, PartialEq)]
pub struct Solver {
    /// Its name.
    pub name: Name,
    /// The comment before it.
    pub doc: Vec<String>,
    /// What it gives, in the order of the text.
    pub outputs: Vec<Output>,
    /// `gravity X, Y, Z`
    pub gravity: Vec<(Span, Vec<Literal>)>,
}

/// Something that a solver gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// The whole of it.
    pub span: Span,
    /// What it is.
    pub kind: OutputKind,
}

/// What a solver gives.
#[derive(Clone, Debug, PartialEq)]
pub enum OutputKind {
    /// `pose TIP in BASE` and others of two frames.
    Motion {
        /// Which part of the motion.
        what: What,
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
}

/// A part of the motion of a frame in another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the words of the language")]
pub enum What {
    Pose,
    Jacobian,
    Velocity,
    Acceleration,
}

impl What {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::Jacobian => "jacobian",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
        }
    }
}
