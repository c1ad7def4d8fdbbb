//! Robots of rigid bodies and joints: [`read`] reads one from a URDF, [`chain`](Robot::chain) says how
//! one frame moves in another one, [`dynamics`] what forces do, [`loops`] what holds frames together, [`inverse`] which joints
//! move a frame so, and [`closed`] where that has a closed form.
//!
//! All lengths are in metres, angles in radians, masses in kilograms. Frames are right-handed. [`Grounding`] changes the
//! unit of length and the axes. A frame is that of a link of the URDF. The algorithms compute with any [`Real`](rc_quantity::Real): with
//! numbers, or with terms of a formula that is printed as code.
//!
#![doc = include_str!("example.md")]

mod chain;
pub mod closed;
pub mod dynamics;
mod grounding;
pub mod inverse;
pub mod loops;
mod mount;
mod read;
mod robot;
mod transmission;
mod vectors;

pub use chain::{Chain, Column, Moved};
pub use grounding::Grounding;
pub use mount::{Held, Mount, Refused};
pub use read::read;
pub use robot::{
    Body, Inertia, Joint, Kept, Limits, LoopJoint, Motion, Robot, State, Transmission,
};
