//! The component `world_keeper`.

mod files;
mod specific_worker;

pub use specific_worker::SpecificWorker;
