//! Runs the component `serial_imu`.

fn main() -> std::process::ExitCode {
    serial_imu_generated::run::<serial_imu::SpecificWorker>()
}
