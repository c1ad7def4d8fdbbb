//! The component `speech_client`.

mod dialogue;
mod specific_worker;

pub use specific_worker::SpecificWorker;
