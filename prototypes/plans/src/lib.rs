//! Plans of conversions between data prototypes: which steps take the numbers of one prototype to
//! those of another one that means the same, what they cost, and what they lose.
//!
//! A [`Network`] finds a [`Plan`] for two prototypes of a library. The [`Program`] of a plan is a
//! formula: [`Program::run`] computes it, [`rust`], [`c`] and [`python`] print it as a function.
//!
#![doc = include_str!("example.md")]

mod between;
mod block;
mod covariance;
mod edge;
mod formula;
mod inertia;
mod loss;
mod moving;
mod network;
mod plan;
mod print;
mod refusal;
mod rotation;
mod shape;
mod spread;
mod values;
mod vector;

pub use between::{between, moving};
pub use block::{Block, Number, block};
pub use loss::{Bound, Loss};
pub use network::Network;
pub use plan::{Cost, Kind, Plan, Step, TRANSFORM};
pub use print::{c, python, rust};
pub use rc_formula::{Program, Rejected};
pub use refusal::Refusal;
