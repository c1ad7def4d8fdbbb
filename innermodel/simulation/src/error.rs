//! Errors of a world.

use innermodel::Kind;
use rc_diagnostics::foreign;
use thiserror::Error;

/// Error of a world. Texts of the caller are cleaned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The tree refuses it.
    #[error(transparent)]
    Tree(#[from] innermodel::Error),
    /// A node of another kind was expected.
    #[error("`{id}` is a {tag}, not a {expected}")]
    Kind {
        /// The node.
        id: String,
        /// Tag of the node.
        tag: &'static str,
        /// Kind that was expected.
        expected: &'static str,
    },
    /// The node was added, and the world does not know it yet.
    #[error("the {expected} `{id}` is not there")]
    Unknown {
        /// The node.
        id: String,
        /// Kind that was expected.
        expected: &'static str,
    },
    /// A number is infinite or none.
    #[error("{what} for `{id}` is not finite")]
    NotFinite {
        /// Meaning of the number.
        what: &'static str,
        /// The node.
        id: String,
    },
    /// A change would let two bodies touch that do not touch now.
    #[error("`{body}` would collide with `{other}`")]
    Collision {
        /// One body.
        body: String,
        /// The other one.
        other: String,
    },
    /// A push would make a body faster than 1 km/s.
    #[error("`{0}` would be faster than 1 km/s")]
    TooFast(String),
    /// The step of a world must be long enough to count, and short enough to be right.
    #[error("a step of {0:?} is not possible; it has to be from 10 µs to 1 s")]
    Step(std::time::Duration),
    /// The errors of a sensor are not possible.
    #[error("the numbers of the signal of `{0}` must be at least 0, and `dropout` at most 1")]
    Signal(String),
    /// More steps at once than a world makes.
    #[error("{0} steps at once are too many; at most {most} are made", most = crate::World::MOST_STEPS)]
    TooManySteps(u64),
    /// A camera without pixels or without a focal length.
    #[error("`{0}` has no pictures: its width, its height and its focal length must be set")]
    NoPicture(String),
    /// A picture without pixels, or with too many.
    #[error("a picture has 1 to {most} pixels, found {pixels}")]
    Pixels {
        /// How many.
        pixels: f64,
        /// How many are possible.
        most: u64,
    },
    /// A sensor has more values than a simulation measures.
    #[error("`{id}` would measure {values} values; at most {most} are possible")]
    TooManyValues {
        /// The sensor.
        id: String,
        /// How many values.
        values: u64,
        /// How many are possible.
        most: u64,
    },
}

impl Error {
    pub(crate) fn other_kind(id: &str, kind: &Kind, expected: &'static str) -> Self {
        Self::Kind {
            id: foreign::clean(id),
            tag: kind.tag(),
            expected,
        }
    }

    pub(crate) fn unknown(id: &str, expected: &'static str) -> Self {
        Self::Unknown {
            id: foreign::clean(id),
            expected,
        }
    }

    pub(crate) fn not_finite(what: &'static str, id: &str) -> Self {
        Self::NotFinite {
            what,
            id: foreign::clean(id),
        }
    }
}
