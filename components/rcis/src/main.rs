//! Runs the component `rcis`.

fn main() -> std::process::ExitCode {
    rcis_generated::run::<rcis::SpecificWorker>()
}
