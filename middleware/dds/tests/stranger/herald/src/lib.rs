//! The component `herald`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
