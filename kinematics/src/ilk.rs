//! ILK, the imperative models of solvers by M. Frigerio (github.com/mfrigerio17/ilk-generator): tables of Lua that list
//! compositions of poses and columns of Jacobians. Values of constant poses are in a file beside them.
//!
//! The pose `a__b` is where the frame `a` is in `b`. A velocity is that of the frame, along its own axes. Angular parts come
//! before linear ones.

mod lua;
mod motion;
mod print;
mod read;

pub use print::{Unprintable, print};
pub(crate) use read::load;
