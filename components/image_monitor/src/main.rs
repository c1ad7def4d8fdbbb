//! The component `image_monitor`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    image_monitor_generated::run::<specific_worker::SpecificWorker>()
}
