//! Runs the component `door_finder`.

fn main() -> std::process::ExitCode {
    door_finder_generated::run::<door_finder::SpecificWorker>()
}
