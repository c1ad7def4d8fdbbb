//! Runs the component `clock`.

fn main() -> std::process::ExitCode {
    clock_generated::run::<clock::SpecificWorker>()
}
