//! The component `image_monitor`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
