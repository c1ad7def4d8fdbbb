//! Runs the component `interop`.

fn main() -> std::process::ExitCode {
    interop_generated::run::<interop::SpecificWorker>()
}
