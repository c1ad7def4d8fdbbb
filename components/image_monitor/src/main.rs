//! Runs the component `image_monitor`.

fn main() -> std::process::ExitCode {
    image_monitor_generated::run::<image_monitor::SpecificWorker>()
}
