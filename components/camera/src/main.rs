//! The component `camera`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    camera_generated::run::<specific_worker::SpecificWorker>()
}
