//! Runs the component `inner_model`.

fn main() -> std::process::ExitCode {
    inner_model_generated::run::<inner_model::SpecificWorker>()
}
