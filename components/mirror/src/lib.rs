//! The component `mirror`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
