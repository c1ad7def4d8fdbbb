//! The component `inner_model`.

mod manager;
mod replica;
mod service;
mod specific_worker;
mod wire;
mod world;

pub use specific_worker::SpecificWorker;
