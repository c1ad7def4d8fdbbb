//! The component `soak_sink`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    soak_sink_generated::run::<specific_worker::SpecificWorker>()
}
