//! The component `soak_sink`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
