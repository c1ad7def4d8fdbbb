//! Starts of networks: in order or not at all, with their events.

use crate::bench::{Bench, LIMIT, codes, component, text, well};
use rc_deploy::{Component, ComponentState};
use rustix::process::Signal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

#[test]
fn components_start_when_their_dependencies_are_ready() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        component("a", "well 200", &[]),
        well("other"),
        component("b", "well 100", &["a"]),
        component("c", "well", &["b", "other"]),
    ]);
    up.await_event("up", None);
    assert!(bench.position("a ready") < bench.position("b start"));
    assert!(bench.position("b ready") < bench.position("c start"));
    assert!(bench.position("other start") < bench.position("a ready"));

    let status = bench.status();
    assert_eq!(status.network, bench.network);
    assert_eq!(status.pid, up.identity().pid);
    assert_eq!(status.components.len(), 4);
    for component in &status.components {
        assert!(component.ready && component.exit.is_none() && component.pid.is_some());
        assert_eq!(component.state, ComponentState::Running);
        assert_eq!(component.middleware, "iceoryx2");
        assert_eq!(component.log, bench.log(&component.name));
    }

    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    assert!(bench.position("c end") < bench.position("b stop"));
    assert!(bench.position("b end") < bench.position("a stop"));
    bench.assert_nothing_left();
}

#[test]
fn components_that_need_each_other_start_together() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        component("base", "well 100", &[]),
        component("a", "well", &["b", "base"]),
        component("b", "well", &["a"]),
    ]);
    up.await_event("up", None);
    assert!(bench.position("base ready") < bench.position("a start"));
    assert!(bench.position("base ready") < bench.position("b start"));
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// The error of an `up` that fails because of `bad`, which starts after another component.
fn failure(bad: Component) -> String {
    let bench = Bench::new();
    let name = bad.name.clone();
    let log = bench.log(&name).display().to_string();
    let after = component("after", "well", &[&name]);
    let bad = Component {
        after: vec!["good".to_owned()],
        ..bad
    };
    let mut up = bench.start(vec![well("good"), bad, after]);
    let message = up.await_event("start-failed", Some(&name));
    let (code, events) = up.end();
    assert_eq!(code, Some(3), "{events:#?}");
    assert!(message.contains(&log), "{message}");
    assert!(bench.journal().contains(&"good end".to_owned()));
    assert!(!bench.journal().contains(&"after start".to_owned()));
    bench.assert_nothing_left();
    message
}

#[test]
fn a_component_that_exits_stops_the_start() {
    let message = failure(component("bad", "exit 7", &[]));
    assert!(
        message.contains("ended before it was ready: exit status 7"),
        "{message}"
    );
    assert!(message.contains("bad is about to fail"), "{message}");
    let message = failure(component("bad", "exit 0", &[]));
    assert!(message.contains("exit status 0"), "{message}");
}

#[test]
fn a_component_that_crashes_stops_the_start() {
    let message = failure(component("bad", "abort", &[]));
    assert!(message.contains("signal 6 (SIGABRT)"), "{message}");
}

#[test]
fn a_component_that_is_never_ready_stops_the_start() {
    let message = failure(Component {
        ready: Duration::from_millis(300),
        ..component("bad", "never-ready", &[])
    });
    assert!(message.contains("was not ready within 300ms"), "{message}");
    assert!(message.contains("bad says hello"), "{message}");
}

#[test]
fn a_component_that_cannot_run_stops_the_start() {
    let message = failure(Component {
        executable: PathBuf::from("/nowhere/bad"),
        ..well("bad")
    });
    assert!(message.contains("cannot run /nowhere/bad"), "{message}");
    let message = failure(Component {
        directory: PathBuf::from("/nowhere"),
        ..well("bad")
    });
    assert!(
        message.contains("working directory /nowhere does not exist"),
        "{message}"
    );
}

#[test]
fn a_guard_that_does_not_start_stops_the_start() {
    let bench = Bench::new();
    let mut up = bench.start_with(vec![well("a")], &["--no-guard"]);
    let message = up.await_event("refused", None);
    assert!(
        message.contains("the guard process does not start"),
        "{message}"
    );
    assert_eq!(up.end().0, Some(3));
    assert!(bench.journal().is_empty() && !bench.run_directory().exists());
}

/// A command line has room for a tenth of them.
#[test]
fn a_guard_gets_any_number_of_services() {
    let bench = Bench::new();
    let mut up = bench.start_with(vec![well("a"), well("b")], &["--hold", "10000"]);
    up.await_event("up", None);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// The guard needs its time for the second half of the services.
#[test]
fn components_start_as_soon_as_their_own_services_are_held() {
    let bench = Bench::new();
    let permit = bench.path("permit");
    let mut up = bench.start_in(
        vec![well("first"), well("last")],
        &["--hold", "10"],
        &[("RC_TEST_HOLD", permit.to_str().expect("a path"))],
    );
    up.await_event("ready", Some("first"));
    assert!(bench.position("first ready") > bench.position("first start"));
    assert!(!bench.journal().contains(&"last start".to_owned()));
    assert_eq!(bench.status().components[1].state, ComponentState::Waiting);
    std::fs::write(&permit, "").expect("written");
    up.await_event("ready", Some("last"));
    up.await_event("up", None);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// No component may start yet: the guard has not said that it guards.
#[test]
fn a_down_is_served_while_the_guard_starts() {
    let bench = Bench::new();
    let up = bench.start_with(vec![well("a")], &["--silent-guard"]);
    let end = Instant::now() + LIMIT;
    while !bench.command("status", &[]).status.success() {
        assert!(Instant::now() < end, "no supervisor");
        std::thread::sleep(Duration::from_millis(5));
    }
    let components = bench.status().components;
    assert_eq!(components[0].state, ComponentState::Waiting);
    let down = bench.command("down", &["5000"]);
    assert!(down.status.success(), "{down:?}");
    assert_eq!(up.end().0, Some(0));
    assert!(!bench.journal().contains(&"a start".to_owned()));
    bench.assert_nothing_left();
}

/// They would only delay each other.
#[test]
fn only_some_components_start_at_once() {
    const MANY: usize = 30;
    let bench = Bench::new();
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let count = MANY + 4 * processors;
    let components = (0..count).map(|at| component(&format!("c{at}"), "well 20", &[]));
    let mut up = bench.start(components.collect());
    up.await_event("up", None);
    let (mut starting, mut most) = (0_usize, 0);
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    for event in &events {
        match event["code"].as_str() {
            Some("starting") => starting += 1,
            Some("ready") => starting -= 1,
            _ => {}
        }
        most = most.max(starting);
    }
    // On a busy machine, a start that takes long makes room for another one.
    assert!(most < count / 2, "{most} of {count}");
    bench.assert_nothing_left();
}

#[test]
fn an_invalid_plan_is_rejected() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("a", "well", &["b"])]);
    let message = up.await_event("refused", None);
    assert!(
        message.contains("a starts after b, which is not a component"),
        "{message}"
    );
    assert_eq!(up.end().0, Some(1));
}

#[test]
fn an_up_ends_when_all_components_are_done() {
    let bench = Bench::new();
    let up = bench.start(vec![
        component("a", "last 50 0", &[]),
        component("b", "brief", &["a"]),
    ]);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    assert_eq!(
        codes(&events, "b"),
        ["starting", "state", "ready", "exited"]
    );
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_fails_later_leaves_the_others_alone() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("a", "last 100 5", &[]), well("b")]);
    let message = up.await_event("exited", Some("a"));
    assert!(message.contains("exit status 5"), "{message}");
    let status = bench.status();
    assert_eq!(status.components[0].state, ComponentState::Failed);
    assert_eq!(status.components[0].exit.as_deref(), Some("exit status 5"));
    assert_eq!(status.components[1].state, ComponentState::Running);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(3));
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_hangs_is_reported_once() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        component("stuck", "stuck", &[]),
        component("silent", "silent 2500", &[]),
    ]);
    let message = up.await_event("hung", Some("stuck"));
    assert!(message.contains("has not run for 5000 ms"), "{message}");
    let message = up.await_event("hung", Some("silent"));
    assert!(message.contains("has not sent a heartbeat"), "{message}");
    assert_eq!(bench.status().components[0].state, ComponentState::Hung);
    up.await_event("answers-again", Some("silent"));
    assert_eq!(bench.status().components[1].state, ComponentState::Running);
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0));
    let hung = codes(&events, "stuck")
        .iter()
        .filter(|c| *c == "hung")
        .count();
    assert_eq!(hung, 1);
}

#[test]
fn garbage_and_a_closed_link_are_reported_and_tolerated() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        component("garbage", "garbage", &[]),
        component("shut", "shut", &["garbage"]),
    ]);
    up.await_event("link-closed", Some("shut"));
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    let garbage = ["starting", "garbage", "state", "ready"];
    assert_eq!(codes(&events, "garbage")[..4], garbage);
    bench.assert_nothing_left();
}

#[test]
fn the_foreground_shows_what_components_print() {
    let bench = Bench::new();
    let mut up = bench.start_with(
        vec![well("a"), component("b", "chatter 300", &["a"])],
        &["--relay"],
    );
    assert_eq!(up.await_event("log", Some("a")), "a says hello");
    assert_eq!(up.await_event("log", Some("b")), "b says hello");
    assert!(up.await_event("log", Some("b")).starts_with("blah blah"));
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();

    let logs = bench.command("logs", &["a"]);
    assert_eq!(text(&logs.stdout), "a says hello\n");
    let logs = text(&bench.command("logs", &[]).stdout);
    assert!(
        logs.contains("a | a says hello\n") && logs.contains("b | blah"),
        "{logs}"
    );
    assert_eq!(bench.command("logs", &["nobody"]).status.code(), Some(3));
}
