//! The component `room_keeper`.

mod specific_worker;

pub use specific_worker::SpecificWorker;
