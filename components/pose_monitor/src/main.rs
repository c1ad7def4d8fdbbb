//! The component `pose_monitor`.

mod chart;
mod screen;
mod specific_worker;
mod track;

fn main() -> std::process::ExitCode {
    pose_monitor_generated::run::<specific_worker::SpecificWorker>()
}
