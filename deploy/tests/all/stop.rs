//! Stops of networks: in order, complete and in time.

use crate::bench::{Bench, await_end, component, text, well};
use rc_deploy::Component;
use rustix::process::Signal;
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::{Duration, Instant};

#[test]
fn ctrl_c_stops_everything() {
    let bench = Bench::new();
    let up = bench.start_well();
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    assert_eq!(events.last().expect("events")["code"], "down");
    bench.assert_nothing_left();
    assert_eq!(bench.cleanups(), 1);
}

#[test]
fn ctrl_c_stops_a_start() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        component("slow", "never-ready", &[]),
        component("next", "well", &["slow"]),
    ]);
    up.await_event("starting", Some("slow"));
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    assert!(!bench.journal().contains(&"next start".to_owned()));
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_ignores_sigterm_is_killed_after_its_limit() {
    let bench = Bench::new();
    let mut up = bench.start(vec![Component {
        stop: Duration::from_millis(200),
        ..component("deaf", "deaf", &[])
    }]);
    up.await_event("up", None);
    up.signal(Signal::INT);
    let message = up.await_event("killed", Some("deaf"));
    assert!(message.contains("did not end within 200ms"), "{message}");
    let message = up.await_event("exited", Some("deaf"));
    assert!(message.contains("signal 9 (SIGKILL)"), "{message}");
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn a_second_ctrl_c_kills_at_once() {
    let bench = Bench::new();
    let mut up = bench.start(vec![Component {
        stop: Duration::from_mins(1),
        ..component("deaf", "deaf", &[])
    }]);
    up.await_event("up", None);
    let since = Instant::now();
    up.signal(Signal::INT);
    up.await_event("stopping", None);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    assert!(since.elapsed() < Duration::from_secs(10));
    bench.assert_nothing_left();
}

#[test]
fn orphaned_children_are_killed() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("parent", "children", &[])]);
    up.await_event("up", None);
    let children = bench.processes("parent child");
    assert_eq!(children.len(), 2);
    up.signal(Signal::INT);
    let message = up.await_event("left-over", None);
    assert!(
        message.contains("orphaned processes of components"),
        "{message}"
    );
    assert_eq!(up.end().0, Some(0));
    await_end(&children);
    bench.assert_nothing_left();
}

#[test]
fn down_returns_when_the_network_can_start_again() {
    let bench = Bench::new();
    for _ in 0..3 {
        let up = bench.start_well();
        let down = bench.command("down", &[]);
        assert!(down.status.success(), "{down:?}");
        assert!(!bench.run_directory().exists());
        assert_eq!(up.end().0, Some(0));
        bench.assert_nothing_left();
    }
    let down = bench.command("down", &[]);
    assert_eq!(down.status.code(), Some(3));
    let message = text(&down.stderr);
    assert!(message.contains("is not up; "), "{message}");
}

#[test]
fn down_reports_a_timeout() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("deaf", "deaf", &[])]);
    up.await_event("up", None);
    let down = bench.command("down", &["100"]);
    assert_eq!(down.status.code(), Some(3));
    assert!(text(&down.stderr).contains("is still stopping after 100ms"));
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
}

#[test]
fn a_network_can_be_up_only_once() {
    let bench = Bench::new();
    let up = bench.start_well();
    let mut second = bench.start(vec![well("c")]);
    let message = second.await_event("refused", None);
    assert!(
        message.contains(&format!("process {}", up.identity().pid)),
        "{message}"
    );
    assert!(
        message.contains(&format!("rcdeploy down {}", bench.network)),
        "{message}"
    );
    assert_eq!(second.end().0, Some(3));
    let recover = bench.command("recover", &[]);
    assert!(
        text(&recover.stderr).contains("is already up"),
        "{recover:?}"
    );
    assert_eq!(bench.status().components.len(), 2);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
}

#[test]
fn a_detached_network_runs_until_down() {
    let bench = Bench::new();
    let plan = bench.write(vec![well("a"), component("b", "well", &["a"])]);
    let up = bench
        .driver(&["up", &plan, "--detach"])
        .output()
        .expect("it runs");
    assert!(up.status.success(), "{up:?}");
    let shown = text(&up.stdout);
    assert!(
        shown.contains(&format!("network {}", bench.network)),
        "{shown}"
    );
    assert!(shown.contains("a          running"), "{shown}");
    let status = bench.status();
    let again = bench
        .driver(&["up", &plan, "--detach"])
        .output()
        .expect("it runs");
    assert_eq!(again.status.code(), Some(3));
    let message = text(&again.stderr);
    assert!(
        message.contains(&format!("process {}", status.pid)),
        "{message}"
    );

    let mut follow = bench.driver(&["logs", &bench.network, "--follow"]);
    let mut follow = follow.stdout(Stdio::piped()).spawn().expect("it runs");
    let mut first = String::new();
    let out = follow.stdout.as_mut().expect("a pipe");
    BufReader::new(out).read_line(&mut first).expect("a line");
    assert_eq!(first, "a | a says hello\n");
    follow.kill().expect("it runs");
    follow.wait().expect("it ended");

    assert!(bench.command("down", &[]).status.success());
    bench.assert_nothing_left();
    let log = std::fs::read_to_string(bench.log("rcdeploy")).expect("a log");
    assert!(log.contains(r#""code":"down""#), "{log}");
}

#[test]
fn a_failed_detached_start_gives_the_reason() {
    let bench = Bench::new();
    let plan = bench.write(vec![well("a"), component("bad", "exit 7", &["a"])]);
    let up = bench
        .driver(&["up", &plan, "--detach"])
        .output()
        .expect("it runs");
    assert_eq!(up.status.code(), Some(3));
    let message = text(&up.stderr);
    assert!(
        message.contains("bad: ended before it was ready: exit status 7"),
        "{message}"
    );
    assert!(message.contains("bad is about to fail"), "{message}");
    bench.assert_nothing_left();
}
