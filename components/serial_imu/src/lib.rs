//! The component `serial_imu`.

mod line;
mod port;
mod specific_worker;

pub use specific_worker::SpecificWorker;
