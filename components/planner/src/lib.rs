//! The component `planner`.

mod motions;
mod specific_worker;

pub use specific_worker::SpecificWorker;
