//! The component `joint_controller`.

mod motion;
mod specific_worker;

fn main() -> std::process::ExitCode {
    joint_controller_generated::run::<specific_worker::SpecificWorker>()
}
