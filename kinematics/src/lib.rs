//! Solvers for the motion of a robot: which poses, velocities, Jacobians and efforts a program needs,
//! in a `.kdsl` file beside the robot's URDF.
//!
//! [`parse`] turns one text into a syntax tree ([`ast`]). [`load`] reads its robot as well, and
//! resolves all names: a [`Cell`]. [`rust`], [`c`] and [`python`] print its solvers as functions in
//! straight lines, whose number of operations is known.

pub mod ast;
mod cell;
mod inverse;
mod names;
mod parse;
mod print;
mod resolve;
mod work;

pub use cell::{Cell, Output, PAYLOAD, Payload, Shape, Solver};
pub use inverse::{Asked, Inverse, RateLimits, Rates, Search};
pub use parse::parse;
pub use print::{c, python, rust, rust_methods};
pub use resolve::load;
pub use work::Work;

/// The formatting options of `.kdsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
