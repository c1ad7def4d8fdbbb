//! The component `world_agent`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
