//! Runs the component `soak_sink`.

fn main() -> std::process::ExitCode {
    soak_sink_generated::run::<soak_sink::SpecificWorker>()
}
