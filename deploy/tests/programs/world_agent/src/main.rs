//! Runs the component `world_agent`.

fn main() -> std::process::ExitCode {
    world_agent_generated::run::<world_agent::SpecificWorker>()
}
