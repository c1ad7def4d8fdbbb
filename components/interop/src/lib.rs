//! The component `interop`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
