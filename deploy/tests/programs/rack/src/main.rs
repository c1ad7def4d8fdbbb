//! Runs the component `rack`.

fn main() -> std::process::ExitCode {
    rack_generated::run::<rack::SpecificWorker>()
}
