//! The component `speech_server`.

mod specific_worker;
mod voice;

pub use specific_worker::SpecificWorker;
