//! The component `door_finder`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
