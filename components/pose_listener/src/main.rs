//! The component `pose_listener`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    pose_listener_generated::run::<specific_worker::SpecificWorker>()
}
