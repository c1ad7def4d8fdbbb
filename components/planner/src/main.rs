//! Runs the component `planner`.

fn main() -> std::process::ExitCode {
    planner_generated::run::<planner::SpecificWorker>()
}
