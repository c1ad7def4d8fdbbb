//! The component `simulator`.

mod battery;
mod lidar;
mod noise;
#[cfg(test)]
mod patrol;
mod specific_worker;
mod world;

pub use specific_worker::SpecificWorker;
