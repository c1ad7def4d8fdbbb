//! The component `arm_monitor`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
