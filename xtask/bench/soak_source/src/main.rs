//! Runs the component `soak_source`.

fn main() -> std::process::ExitCode {
    soak_source_generated::run::<soak_source::SpecificWorker>()
}
