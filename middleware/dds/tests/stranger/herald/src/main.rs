//! Runs the component `herald`.

fn main() -> std::process::ExitCode {
    herald_generated::run::<herald::SpecificWorker>()
}
