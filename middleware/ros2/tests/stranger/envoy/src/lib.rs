//! The component `envoy`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
