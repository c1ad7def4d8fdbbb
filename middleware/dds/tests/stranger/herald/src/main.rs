//! The component `herald`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    herald_generated::run::<specific_worker::SpecificWorker>()
}
