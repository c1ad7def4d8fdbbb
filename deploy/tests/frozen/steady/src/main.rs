//! Runs the component `steady`.

fn main() -> std::process::ExitCode {
    steady_generated::run::<steady::SpecificWorker>()
}
