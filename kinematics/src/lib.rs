//! Solvers for the motion of a robot: a `.kdsl` file next to the robot's URDF lists the poses,
//! velocities, Jacobians and efforts that a program needs.
//!
//! [`parse`] turns one text into a syntax tree ([`ast`]). [`load`] reads its robot as well, and
//! resolves all names: a [`Cell`]. [`rust`], [`c`], [`cpp`], [`python`], and [`library`] with [`loader`] print its solvers as functions in
//! straight lines, whose number of operations is known.
//!
#![doc = include_str!("example.md")]

pub mod ast;
mod cell;
pub mod ilk;
mod inverse;
mod names;
mod parse;
mod print;
mod resolve;
mod search;
mod sets;
mod work;

pub use cell::{Asked, Cell, Choices, Output, PAYLOAD, Payload, Shape, Solver};
pub use inverse::{Inverse, Question, RateLimits, Rates, Unanswered};
pub use parse::parse;
pub use print::{c, cpp, library, loader, python, rust, rust_methods};
pub use resolve::load;
pub use search::{ClosedForm, Search, Settings};
pub use work::Work;

/// The formatting options of `.kdsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
