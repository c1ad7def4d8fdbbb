//! The component `simulator`.

mod lidar;
mod noise;
#[cfg(test)]
mod patrol;
mod specific_worker;
mod world;

fn main() -> std::process::ExitCode {
    simulator_generated::run::<specific_worker::SpecificWorker>()
}
