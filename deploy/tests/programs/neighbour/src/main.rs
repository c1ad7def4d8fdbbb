//! Runs the component `neighbour`.

fn main() -> std::process::ExitCode {
    neighbour_generated::run::<neighbour::SpecificWorker>()
}
