//! The component `steady`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
