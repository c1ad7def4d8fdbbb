//! The component `kinematics`.

mod answers;
mod robot;
mod service;
mod specific_worker;
mod world;

pub use specific_worker::SpecificWorker;
