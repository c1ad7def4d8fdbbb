//! Runs the component `envoy`.

fn main() -> std::process::ExitCode {
    envoy_generated::run::<envoy::SpecificWorker>()
}
