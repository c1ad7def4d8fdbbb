//! Runs the component `room_keeper`.

fn main() -> std::process::ExitCode {
    room_keeper_generated::run::<room_keeper::SpecificWorker>()
}
