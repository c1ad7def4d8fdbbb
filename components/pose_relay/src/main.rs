//! Runs the component `pose_relay`.

fn main() -> std::process::ExitCode {
    pose_relay_generated::run::<pose_relay::SpecificWorker>()
}
