//! Runs the component `world_keeper`.

fn main() -> std::process::ExitCode {
    world_keeper_generated::run::<world_keeper::SpecificWorker>()
}
