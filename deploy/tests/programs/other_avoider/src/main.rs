//! The avoider with one other constant, for the test of exact recordings: its first effect is
//! found.

mod policy {
    include!(concat!(env!("OUT_DIR"), "/policy.rs"));
}
// A worker is compiled against the policy of the crate that it is in.
#[path = "../../../../../components/avoider/src/specific_worker.rs"]
mod specific_worker;

fn main() -> std::process::ExitCode {
    avoider_generated::run::<specific_worker::SpecificWorker>()
}
