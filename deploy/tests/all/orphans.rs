//! Processes that a component leaves in a session of their own, without an environment.

use crate::bench::{Bench, LIMIT, Up, await_end, component, kill};
use rc_deploy::process::Identity;
use rc_deploy::{Component, Policy, Restart};
use rustix::process::{Pid, Signal, kill_process};
use std::time::{Duration, Instant};

/// A component that leaves such a process, and restarts when it is killed.
pub(crate) fn forsaking(name: &str) -> Component {
    Component {
        restart: Restart {
            policy: Policy::OnFailure,
            hung: None,
            limit: None,
            backoff: Duration::from_millis(20),
        },
        ..component(name, "forsaken", &[])
    }
}

/// The latest process that a component has left, once it has removed what names its component.
pub(crate) fn forsaken(bench: &Bench, name: &str) -> Identity {
    let entry = format!("{name} child");
    let entries = bench.entries();
    let mut pids = entries
        .iter()
        .rev()
        .filter_map(|line| line.strip_prefix(&entry)?.trim().parse().ok());
    let child = pids.next().and_then(Identity::of).expect("a child");
    let environment = format!("/proc/{}/environ", child.pid);
    let limit = Instant::now() + LIMIT;
    while std::fs::read(&environment).expect("it runs") != b"" {
        assert!(Instant::now() < limit, "it keeps its environment");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

fn start(bench: &Bench) -> (Up, [Identity; 2]) {
    let mut up = bench.start(vec![forsaking("a"), forsaking("b")]);
    up.await_event("up", None);
    let children = ["a", "b"].map(|name| forsaken(bench, name));
    (up, children)
}

#[test]
fn a_forsaken_process_ends_before_its_component_restarts() {
    let bench = Bench::new();
    let (mut up, [of_a, of_b]) = start(&bench);
    kill(bench.processes("a start")[0]);
    let told = up.await_event("left-over", Some("a"));
    assert_eq!(told, "killed 1 orphaned processes");
    up.await_event("ready", Some("a"));
    forsaken(&bench, "a");
    assert!(!of_a.is_alive(), "it runs beside the new one");
    assert!(of_b.is_alive(), "it belongs to another component");
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    let left = events.iter().rfind(|event| event["code"] == "left-over");
    let text = "killed 2 orphaned processes of components";
    assert_eq!(left.expect("an event")["message"], text);
    bench.assert_nothing_left();
}

#[test]
fn a_forsaken_process_ends_with_its_killed_supervisor() {
    let bench = Bench::new();
    let (up, children) = start(&bench);
    up.kill();
    await_end(&children);
}

/// Neither the supervisor nor the guard has seen the end of the component.
#[test]
fn the_next_up_ends_forsaken_processes() {
    let bench = Bench::new();
    let (up, children) = start(&bench);
    let components = ["a start", "b start"].map(|entry| bench.processes(entry)[0]);
    let guard = bench
        .status()
        .guard
        .and_then(Identity::of)
        .expect("a guard");
    // A stopped guard can neither clean up nor be replaced.
    kill_process(Pid::from_raw(guard.pid).expect("a pid"), Signal::STOP).expect("it runs");
    up.kill();
    kill(guard);
    await_end(&[guard]);
    await_end(&components);
    assert!(children.iter().all(Identity::is_alive));
    let mut up = bench.start(vec![component("c", "well", &[])]);
    let told = up.await_event("recovered", None);
    assert!(told.contains("killed 2 orphaned processes"), "{told}");
    up.await_event("up", None);
    await_end(&children);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}
