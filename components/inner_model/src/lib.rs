//! The component `inner_model`.

mod front;
mod manager;
mod parts;
mod service;
mod simulators;
mod specific_worker;
mod wire;
mod world;

pub use specific_worker::SpecificWorker;
