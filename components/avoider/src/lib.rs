//! The component `avoider`.

mod policy;
mod specific_worker;

pub use specific_worker::SpecificWorker;
