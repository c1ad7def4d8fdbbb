//! The component `avoider`.

mod policy;
mod specific_worker;

fn main() -> std::process::ExitCode {
    avoider_generated::run::<specific_worker::SpecificWorker>()
}
