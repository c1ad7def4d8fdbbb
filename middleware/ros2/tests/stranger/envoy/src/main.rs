//! The component `envoy`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    envoy_generated::run::<specific_worker::SpecificWorker>()
}
