//! Runs the component `joint_controller`.

fn main() -> std::process::ExitCode {
    joint_controller_generated::run::<joint_controller::SpecificWorker>()
}
