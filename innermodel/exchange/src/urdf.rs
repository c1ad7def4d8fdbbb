//! URDF.

mod read;
mod write;

pub use read::read;
pub use write::{is_exported, write};

/// Takes metres to millimetres.
const METRE: f64 = 1000.0;
