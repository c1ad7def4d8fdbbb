//! Runs the component `arm_monitor`.

fn main() -> std::process::ExitCode {
    arm_monitor_generated::run::<arm_monitor::SpecificWorker>()
}
