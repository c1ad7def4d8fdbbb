//! The component `pose_relay`.

mod specific_worker;
mod transform;

pub use specific_worker::SpecificWorker;
