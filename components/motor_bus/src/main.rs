//! The component `motor_bus`.

mod motor;
mod specific_worker;

fn main() -> std::process::ExitCode {
    motor_bus_generated::run::<specific_worker::SpecificWorker>()
}
