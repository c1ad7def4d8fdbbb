//! InnerModel files for other tools: URDF, both ways, and glTF.
//!
//! URDF and glTF are right-handed and in metres. In URDF x points to the front and z up, in glTF y
//! up and z to the front. What another format cannot express is a warning at its place.
//!
//! `rcgen` links this crate, so it has its own matrices of three rows instead of nalgebra.
//!
#![doc = include_str!("example.md")]

pub mod gltf;
mod matrix;
mod shapes;
pub mod urdf;
