//! The component `neighbour`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
