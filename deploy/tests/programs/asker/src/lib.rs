//! The component `asker`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
