//! Changes of frames. The transform between two frames that move is known when a message comes:
//! the plan says which one it needs, and its formulas take the numbers of it.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::{self, Write};

/// A transform: the rows of `[R | t]`, one after the other. It takes the coordinates of a point in
/// one frame to those in another one.
pub type Transform = [f64; 12];

/// The interface that knows where frames are.
pub const TREE: &str = "RcInnerModel::InnerModel";

/// The operation of it that a change of frames calls, and the hash of its types: the pose of one node
/// in another one at a time.
pub const QUERY: (&str, u64) = ("getPoseAt", 0xfc46_9e8d_ddc0_a1b8);

/// The topic interface of tf, which also knows where frames are.
pub const TF: &str = "Transforms::TransformPub";

/// The topic of it, and the hash of its types.
pub const TRANSFORMS: (&str, u64) = ("transforms", 0xd31e_c2b0_3197_b132);

/// The hash of the exception that it throws.
pub const EXCEPTION: i32 = 291_013_833;

/// A transform that a message needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Move {
    /// The frame of the values in the message.
    pub from: Frame,
    /// The frame that they are converted to.
    pub to: String,
    /// Kept numbers of the message, by their place among these, each with the nanoseconds of its
    /// unit. Their sum is the time of the transform.
    pub stamp: Vec<(u32, u32)>,
}

/// The source of the name of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frame {
    /// All messages have this one.
    Named(String),
    /// The kept text of the message at this place among these.
    Kept(u32),
}

/// A transform that a certain message needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Needed<'p> {
    /// The frame of the values.
    pub from: String,
    /// The frame that they are converted to.
    pub to: &'p str,
    /// The time, in nanoseconds of the clock of the network.
    pub time: i64,
}

/// Whether a frame with this name can be part of a plan.
#[must_use]
pub fn is_frame(name: &str) -> bool {
    !name.is_empty()
        && name
            .chars()
            .all(|c| c.is_alphanumeric() || matches!(c, '_' | '.' | '/' | '-'))
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => f.write_str(name),
            Self::Kept(at) => write!(f, "${at}"),
        }
    }
}

impl fmt::Display for Move {
    /// In the form of the texts of plans.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "^{}>{}@", self.from, self.to)?;
        for (number, (at, unit)) in self.stamp.iter().enumerate() {
            if number > 0 {
                f.write_char('+')?;
            }
            write!(f, "{at}*{unit}")?;
        }
        Ok(())
    }
}
