//! The component `joint_controller`.

mod motion;
mod specific_worker;

pub use specific_worker::SpecificWorker;
