//! The component `motor_bus`.

mod motor;
mod specific_worker;

pub use specific_worker::SpecificWorker;
