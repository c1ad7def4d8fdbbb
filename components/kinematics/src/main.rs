//! Runs the component `kinematics`.

fn main() -> std::process::ExitCode {
    kinematics_generated::run::<kinematics::SpecificWorker>()
}
