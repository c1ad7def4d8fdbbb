//! A map of a floor: walls, furniture and where a robot starts, with the geometry that moves a
//! robot on it.
//!
//! Lengths are millimetres, angles radians. x points right, y up, and angles grow counter-clockwise
//! from x. Sines and cosines are those of the crate `libm`, so that a simulated run is equal on
//! every machine.

mod geometry;
mod map;

pub use libm;

pub use geometry::{Point, Pose, Segment, wrapped};
pub use map::{Bounds, Map, MapError};
