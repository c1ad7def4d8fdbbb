//! The component `pong`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
