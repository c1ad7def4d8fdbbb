//! The component `pose_relay`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    pose_relay_generated::run::<specific_worker::SpecificWorker>()
}
