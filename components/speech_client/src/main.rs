//! Runs the component `speech_client`.

fn main() -> std::process::ExitCode {
    speech_client_generated::run::<speech_client::SpecificWorker>()
}
