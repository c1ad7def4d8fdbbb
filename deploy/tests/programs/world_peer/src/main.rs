//! Runs the component `world_peer`.

fn main() -> std::process::ExitCode {
    world_peer_generated::run::<world_peer::SpecificWorker>()
}
