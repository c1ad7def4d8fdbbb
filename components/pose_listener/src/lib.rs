//! The component `pose_listener`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
