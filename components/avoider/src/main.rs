//! Runs the component `avoider`.

fn main() -> std::process::ExitCode {
    avoider_generated::run::<avoider::SpecificWorker>()
}
