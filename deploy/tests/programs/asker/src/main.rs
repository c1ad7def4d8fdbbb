//! Runs the component `asker`.

fn main() -> std::process::ExitCode {
    asker_generated::run::<asker::SpecificWorker>()
}
