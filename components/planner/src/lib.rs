//! The component `planner`.

mod motions;
mod search;
mod specific_worker;
mod worlds;

pub use specific_worker::SpecificWorker;
