//! All integration tests of the backend in one program.

mod conformance;
mod external_programs;
mod half_made;
mod killed;
mod leaving;
mod memory;
mod other_user;
mod processes;
mod restarts;
mod stopped;
mod wakes;

/// The entry point of the processes that tests start; no test by itself.
#[test]
fn role() {
    let Some((role, network)) = processes::role() else {
        return;
    };
    match role.split_once(' ') {
        Some(("stopped", role)) => stopped::play(role, &network),
        Some(("restarts", role)) => restarts::play(role, &network),
        _ if role == "external" => external_programs::external(&network),
        _ => processes::play(&role, &network),
    }
}
