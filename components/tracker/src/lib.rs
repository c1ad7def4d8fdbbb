//! The component `tracker`.

mod depths;
mod heads;
mod specific_worker;
mod sphere;
mod tracks;

pub use specific_worker::SpecificWorker;

/// Lengths in mm: to the right, up, ahead.
pub(crate) type Point = [f64; 3];
