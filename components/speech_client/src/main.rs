//! The component `speech_client`.

mod dialogue;
mod specific_worker;

fn main() -> std::process::ExitCode {
    speech_client_generated::run::<specific_worker::SpecificWorker>()
}
