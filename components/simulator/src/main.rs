//! Runs the component `simulator`.

fn main() -> std::process::ExitCode {
    simulator_generated::run::<simulator::SpecificWorker>()
}
