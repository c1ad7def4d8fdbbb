//! The conversion of a connection. A [`Plan`] lists the values of the operations of an interface,
//! and the conversions of their numbers. It travels as a text (`--convert SLOT=PLAN`) and becomes a
//! [`Program`], which converts numbers where they are: the two ends have equal types, so no byte
//! moves.
//!
//! ```
//! use rc_conversion::{Plan, Place};
//!
//! // The first operation takes a sequence of pairs: a number in mm, which becomes one in m, and a
//! // number that stays as it is.
//! let plan: Plan = "0i:[f{1/1000}f]".parse().unwrap();
//! let program = plan.program(0, Place::Input).unwrap();
//! let mut bytes = [1_u32.to_le_bytes(), 1500_f32.to_le_bytes(), 7_f32.to_le_bytes()].concat();
//! program.run(&mut bytes, 0).unwrap();
//! assert_eq!(bytes[4..8], 1.5_f32.to_le_bytes());
//! ```
//!
//! The crate reads messages of other processes: it never panics, and the time of a program is in
//! proportion to the bytes.
#![no_std]

extern crate alloc;

mod fault;
mod formula;
mod item;
mod kernel;
mod lanes;
mod moves;
mod number;
mod parse;
mod plan;
mod program;
mod scratch;

pub use fault::{Fault, Outside};
pub use formula::{Formula, Operand, Operation, Step};
pub use item::Item;
pub use moves::{EXCEPTION, Frame, Move, Needed, QUERY, TF, TRANSFORMS, TREE, Transform, is_frame};
pub use parse::{DEEPEST, LONGEST, PlanError};
pub use plan::{Part, Place, Plan};
pub use program::{Program, RunResult};
