//! The component `ping`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    ping_generated::run::<specific_worker::SpecificWorker>()
}
