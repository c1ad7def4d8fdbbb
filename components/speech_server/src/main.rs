//! Runs the component `speech_server`.

fn main() -> std::process::ExitCode {
    speech_server_generated::run::<speech_server::SpecificWorker>()
}
