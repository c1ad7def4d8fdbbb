//! The component `clock`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
