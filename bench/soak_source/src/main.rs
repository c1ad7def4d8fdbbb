//! The component `soak_source`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    soak_source_generated::run::<specific_worker::SpecificWorker>()
}
