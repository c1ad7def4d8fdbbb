//! The component `camera`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
