//! The component `soak_source`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
