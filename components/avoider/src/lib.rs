//! The component `avoider`.

pub mod policy;
mod specific_worker;

pub use specific_worker::SpecificWorker;
