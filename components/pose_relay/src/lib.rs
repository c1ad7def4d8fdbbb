//! The component `pose_relay`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
