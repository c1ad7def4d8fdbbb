//! All integration tests of the backend, in one program.

mod conformance;
mod half_made;
mod killed;
mod leaving;
mod memory;
mod processes;
mod stopped;
mod strangers;
mod wakes;

/// Not a test: the body of each process that a test starts.
#[test]
fn role() {
    let Some((role, network)) = processes::role() else {
        return;
    };
    match role.strip_prefix("stopped ") {
        Some(role) => stopped::play(role, &network),
        None if role == "stranger" => strangers::stranger(&network),
        None => processes::play(&role, &network),
    }
}
