//! The component `rack`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
