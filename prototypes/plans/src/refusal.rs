//! The reason why there is no plan.

use crate::shape::MOST;
use std::fmt;

/// Why one prototype does not convert into another one.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// There is no prototype with this name.
    Unknown(String),
    /// They mean different things: the meanings.
    Meaning(String, String),
    /// They are about different frames: which end of the relation, and both frames.
    Frame(String, String, String),
    /// One holds a sequence, the other one does not.
    Sequence,
    /// The second one needs a value that the first one does not have.
    Missing(String),
    /// The first prototype has this unit where the second one has that.
    Unit(String, String),
    /// This prototype has too many numbers.
    TooMany(String),
    /// Aliases of this abstract type with the other one contradict each other.
    Aliases(String),
    /// This function of the user has a name that printed code has for something else.
    Function(String),
    /// No rule leads from one to the other, by itself or over other prototypes.
    NoWay,
    /// Values with this meaning do not convert between frames that move.
    Still(String),
    /// The values with this meaning have no axes, which a change of frames needs.
    NoAxes(String),
    /// The plan would lose more than the `loss` of the second prototype: how much, and the limit.
    Loss(String, f64),
}

impl Refusal {
    /// The code of the finding.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unknown(_) => "unknown-prototype",
            Self::Meaning(..) => "semantic-mismatch",
            Self::Frame(..) => "frame-mismatch",
            Self::Loss(..) => "conversion-loses",
            Self::Sequence
            | Self::Missing(_)
            | Self::Unit(..)
            | Self::TooMany(_)
            | Self::Aliases(_)
            | Self::Function(_)
            | Self::Still(_)
            | Self::NoAxes(_)
            | Self::NoWay => "no-conversion",
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(name) => write!(f, "unknown prototype `{name}`"),
            Self::Meaning(one, other) => {
                write!(f, "the meanings differ: {one} and {other}")
            }
            Self::Frame(end, one, other) => write!(
                f,
                "the frames differ: `{end}` is `{one}` and `{other}`, and no transform between them is known"
            ),
            Self::Sequence => f.write_str("one holds a sequence of values, the other one a value"),
            Self::Missing(name) => write!(f, "the first one has no value `{name}`"),
            Self::Unit(one, other) => write!(f, "{one} does not convert into {other}"),
            Self::Aliases(name) => write!(f, "aliases of `{name}` contradict each other"),
            Self::TooMany(name) => write!(f, "`{name}` has more than {MOST} numbers"),
            Self::Function(name) => write!(
                f,
                "the function `{name}` has a name that the printed code has for something else"
            ),
            Self::NoWay => f.write_str("no alias and no conversion leads from one to the other"),
            Self::Still(what) => write!(
                f,
                "a change of frames converts positions, orientations, velocities, accelerations and forces, and no {what}"
            ),
            Self::NoAxes(what) => write!(
                f,
                "a change of frames needs the axes of both ends, and the {what} of one of them has none"
            ),
            Self::Loss(what, limit) => {
                write!(f, "the plan loses more than {limit:e}: {what}")
            }
        }
    }
}

impl std::error::Error for Refusal {}
