//! Runs the component `tracker`.

fn main() -> std::process::ExitCode {
    tracker_generated::run::<tracker::SpecificWorker>()
}
