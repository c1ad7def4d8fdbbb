//! The component `speech_server`.

mod specific_worker;
mod voice;

fn main() -> std::process::ExitCode {
    speech_server_generated::run::<specific_worker::SpecificWorker>()
}
