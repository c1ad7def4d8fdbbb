//! Runs the component `pose_monitor`.

fn main() -> std::process::ExitCode {
    pose_monitor_generated::run::<pose_monitor::SpecificWorker>()
}
