//! Runs the component `mirror`.

fn main() -> std::process::ExitCode {
    mirror_generated::run::<mirror::SpecificWorker>()
}
