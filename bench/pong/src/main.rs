//! The component `pong`.

mod specific_worker;

fn main() -> std::process::ExitCode {
    pong_generated::run::<specific_worker::SpecificWorker>()
}
