//! Runs the component `ping`.

fn main() -> std::process::ExitCode {
    ping_generated::run::<ping::SpecificWorker>()
}
