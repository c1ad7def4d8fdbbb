//! Runs the component `camera`.

fn main() -> std::process::ExitCode {
    camera_generated::run::<camera::SpecificWorker>()
}
