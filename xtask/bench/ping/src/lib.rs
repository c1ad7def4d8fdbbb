//! The component `ping`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
