//! Runs the component `pong`.

fn main() -> std::process::ExitCode {
    pong_generated::run::<pong::SpecificWorker>()
}
