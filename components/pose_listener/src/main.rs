//! Runs the component `pose_listener`.

fn main() -> std::process::ExitCode {
    pose_listener_generated::run::<pose_listener::SpecificWorker>()
}
