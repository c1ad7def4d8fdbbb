//! Runs the component `motor_bus`.

fn main() -> std::process::ExitCode {
    motor_bus_generated::run::<motor_bus::SpecificWorker>()
}
