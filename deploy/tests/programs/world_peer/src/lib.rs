//! The component `world_peer`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
