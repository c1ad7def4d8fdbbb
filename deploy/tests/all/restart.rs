//! Restarts of components as their descriptions say.

use crate::bench::{Bench, codes, component, kill, well};
use rc_deploy::{Component, ComponentState, Policy, Restart};
use rc_deploy_client::status::table;
use rustix::process::{Pid, Signal, kill_process};
use std::time::Duration;

/// A component that follows `turns`, one exit code per start.
fn turns(name: &str, turns: &str, policy: Policy, limit: Option<u32>) -> Component {
    Component {
        restart: Restart {
            policy,
            hung: None,
            limit: limit.map(|most| (most, Duration::from_mins(10))),
            backoff: Duration::from_millis(20),
        },
        ..component(name, &format!("turns {turns}"), &[])
    }
}

#[test]
fn a_failed_component_is_restarted() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        turns("a", "1 4 1 0", Policy::OnFailure, Some(3)),
        well("other"),
    ]);
    for pause in ["20ms", "40ms", "80ms"] {
        let message = up.await_event("restarting", Some("a"));
        assert_eq!(message, format!("restarts in {pause}"));
    }
    up.await_event("ready", Some("a"));
    let status = bench.status();
    let restarts: Vec<u32> = status.components.iter().map(|c| c.restarts).collect();
    assert_eq!(restarts, [3, 0]);
    assert_eq!(status.components[0].state, ComponentState::Running);
    assert!(table(&status).contains("restarted 3 times"), "{status:?}");
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    // A restart resolved all failures.
    assert_eq!(code, Some(0), "{events:#?}");
    // The other component was not affected.
    assert_eq!(
        codes(&events, "other"),
        ["starting", "state", "ready", "exited"]
    );
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_fails_too_often_stops_the_network() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        turns("a", "1", Policy::OnFailure, Some(2)),
        well("other"),
    ]);
    let message = up.await_event("gave-up", Some("a"));
    assert!(
        message.contains("restarted 2 times within 600s and ended again"),
        "{message}"
    );
    assert!(message.contains("a is about to fail"), "{message}");
    let (code, events) = up.end();
    assert_eq!(code, Some(3), "{events:#?}");
    let starts = codes(&events, "a")
        .iter()
        .filter(|c| *c == "starting")
        .count();
    assert_eq!(starts, 3);
    assert!(bench.journal().contains(&"other end".to_owned()));
    bench.assert_nothing_left();
}

#[test]
fn a_successful_exit_is_restarted_by_always_only() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        Component {
            after: vec!["once".to_owned(), "failed".to_owned()],
            ..turns("always", "2 2 0", Policy::Always, None)
        },
        turns("once", "2", Policy::OnFailure, None),
        turns("failed", "1", Policy::Never, None),
    ]);
    up.await_event("restarting", Some("always"));
    up.await_event("restarting", Some("always"));
    up.await_event("ready", Some("always"));
    up.signal(Signal::INT);
    let (code, events) = up.end();
    // A failure without a restart remains a failure.
    assert_eq!(code, Some(3), "{events:#?}");
    for name in ["once", "failed"] {
        let codes = codes(&events, name);
        assert!(!codes.contains(&"restarting".to_owned()), "{events:#?}");
    }
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_does_not_become_ready_again_is_restarted() {
    let bench = Bench::new();
    let mut up = bench.start(vec![Component {
        ready: Duration::from_millis(300),
        ..turns("a", "1 3 0", Policy::OnFailure, None)
    }]);
    up.await_event("restarting", Some("a"));
    let message = up.await_event("not-ready", Some("a"));
    assert_eq!(message, "was not ready within 300ms");
    up.await_event("restarting", Some("a"));
    up.await_event("ready", Some("a"));
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    bench.assert_nothing_left();
}

#[test]
fn the_first_start_has_to_succeed() {
    let bench = Bench::new();
    let mut up = bench.start(vec![turns("a", "4 0", Policy::Always, None)]);
    let message = up.await_event("start-failed", Some("a"));
    assert!(message.contains("ended before it was ready"), "{message}");
    assert_eq!(up.end().0, Some(3));
    bench.assert_nothing_left();
}

#[test]
fn a_network_can_be_stopped_while_a_component_waits_for_its_start() {
    let bench = Bench::new();
    let mut long = turns("a", "1 0", Policy::Always, None);
    long.restart.backoff = Duration::from_hours(1);
    let mut up = bench.start(vec![long, well("b")]);
    up.await_event("restarting", Some("a"));
    assert_eq!(bench.status().components[0].state, ComponentState::Waiting);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// Components that need it would wait forever.
#[test]
fn an_exit_before_becoming_ready_again_is_a_failure() {
    let bench = Bench::new();
    let a = turns("a", "1 6 0", Policy::OnFailure, Some(3));
    let mut up = bench.start(vec![a, component("b", "well", &["a"])]);
    for _ in 0..2 {
        up.await_event("restarting", Some("a"));
    }
    up.await_event("ready", Some("a"));
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    bench.assert_nothing_left();
}

/// For example, while the program is being rebuilt.
#[test]
fn a_missing_program_is_tried_again() {
    let bench = Bench::new();
    let a = turns("a", "1 0", Policy::Always, None);
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("program");
    let away = folder.path().join("away");
    std::fs::copy(&a.executable, &program).expect("a copy of the program");
    let a = Component {
        executable: program.clone(),
        restart: Restart {
            backoff: Duration::from_millis(300),
            ..a.restart
        },
        ..a
    };
    let mut up = bench.start(vec![a, well("b")]);
    up.await_event("restarting", Some("a"));
    std::fs::rename(&program, &away).expect("the program can be moved");
    up.await_event("start-failed", Some("a"));
    std::fs::rename(&away, &program).expect("and moved back");
    up.await_event("ready", Some("a"));
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    assert_eq!(
        codes(&events, "b")
            .iter()
            .filter(|c| *c == "starting")
            .count(),
        1
    );
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_hangs_too_long_is_restarted() {
    let bench = Bench::new();
    let a = turns("a", "9 0", Policy::OnFailure, Some(3));
    let a = Component {
        restart: Restart {
            hung: Some(Duration::from_secs(3)),
            ..a.restart
        },
        ..a
    };
    // Without `hung`, a policy ignores it.
    let patient = turns("patient", "9", Policy::OnFailure, Some(3));
    let mut up = bench.start(vec![patient, a, well("other")]);
    up.await_event("hung", Some("a"));
    let message = up.await_event("hung-too-long", Some("a"));
    assert_eq!(message, "has been hung for 3s and is stopped");
    up.await_event("restarting", Some("a"));
    up.await_event("ready", Some("a"));
    let status = bench.status();
    let states: Vec<ComponentState> = status.components.iter().map(|c| c.state).collect();
    assert_eq!(
        states,
        [
            ComponentState::Hung,
            ComponentState::Running,
            ComponentState::Running
        ]
    );
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    assert!(!codes(&events, "patient").contains(&"hung-too-long".to_owned()));
    bench.assert_nothing_left();
}

/// Remains of a dead process do not delay the next one.
#[test]
fn a_component_restarts_once_the_guard_has_cleaned_up_after_it() {
    let bench = Bench::new();
    let permit = bench.path("permit");
    let mut up = bench.start_in(
        vec![turns("a", "1 0", Policy::OnFailure, None), well("b")],
        &[],
        &[("RC_TEST_CLEAN", permit.to_str().expect("a path"))],
    );
    up.await_event("restarting", Some("a"));
    // The guard, which reports that it goes on, is not taken for stuck.
    std::thread::sleep(Duration::from_millis(2500));
    let starts = || {
        let journal = bench.journal();
        journal.iter().filter(|entry| *entry == "a start").count()
    };
    assert_eq!(starts(), 1);
    std::fs::write(&permit, "").expect("written");
    up.await_event("ready", Some("a"));
    assert_eq!(starts(), 2);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// Its deadline passes while its start is held back.
#[test]
fn a_restart_that_is_late_does_not_say_that_it_is_done() {
    let bench = Bench::new();
    let permit = bench.path("permit");
    let short = Duration::from_millis(100);
    let components = ["a", "b"].map(|name| Component {
        ready: short,
        stop: short,
        ..well(name)
    });
    let mut up = bench.start_in(
        components.to_vec(),
        &[],
        &[("RC_TEST_CLEAN", permit.to_str().expect("a path"))],
    );
    up.await_event("up", None);
    let restart = bench.command("restart", &["a"]);
    let result: serde_json::Value = serde_json::from_slice(&restart.stdout).expect("a result");
    assert_eq!(result["done"], serde_json::json!([]), "{result}");
    assert_eq!(result["failed"][0]["name"], "a", "{result}");
    assert_eq!(
        result["failed"][0]["reason"], "is not started yet",
        "{result}"
    );
    std::fs::write(&permit, "").expect("written");
    up.await_event("ready", Some("a"));
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn a_component_does_not_wait_for_a_stopped_guard() {
    let bench = Bench::new();
    let mut up = bench.start(vec![turns("a", "0", Policy::OnFailure, None)]);
    up.await_event("up", None);
    let guard = bench.status().guard.and_then(Pid::from_raw);
    kill_process(guard.expect("a guard"), Signal::STOP).expect("it runs");
    kill(bench.processes("a start")[0]);
    up.await_event("restarting", Some("a"));
    up.await_event("ready", Some("a"));
    kill_process(guard.expect("a guard"), Signal::CONT).expect("it runs");
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0));
    // Otherwise it was killed for being stuck, which takes much longer.
    let replaced = events.iter().any(|event| event["code"] == "guard-ended");
    assert!(!replaced, "{events:#?}");
    bench.assert_nothing_left();
}
