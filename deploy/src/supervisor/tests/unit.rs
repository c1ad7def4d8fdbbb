//! The reports of a unit, and its limits.

use super::{Bench, component, exit, is_after, managed};
use crate::remote::HOST_LIMIT;
use crate::supervisor::restart::Next;
use crate::supervisor::unit::{HEARTBEAT_LIMIT, Overdue, Phase, Unit, until};
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_network::plan::{Component, Host, Policy, Restart};
use rc_management::agent::Exit;
use rc_management::component::State;
use rc_management::link::ComponentMessage;
use rc_management::supervisor::ComponentState;
use std::time::{Duration, Instant};

const SECOND: Duration = Duration::from_secs(1);

/// The conditions of a unit.
fn facts(unit: &Unit) -> Vec<&'static str> {
    let all = [
        ("waiting", unit.is_waiting()),
        ("due", unit.is_due()),
        ("restarted", unit.is_restarted()),
        ("stopped", unit.is_stopped()),
        ("gone", unit.is_gone()),
        ("lost", unit.is_lost()),
        ("alive", unit.is_alive()),
        ("asked", unit.is_asked_to_stop()),
        ("ready", unit.is_ready()),
        ("settled", unit.is_settled()),
        ("lets others start", unit.lets_others_start()),
        ("lets others work", unit.lets_others_work()),
        ("managed", unit.is_managed()),
    ];
    let facts = all.into_iter().filter(|(_, is)| *is);
    facts.map(|(fact, _)| fact).collect()
}

fn restarting(name: &str, policy: Policy) -> Component {
    Component {
        restart: Restart {
            policy,
            ..Restart::default()
        },
        ..component(name)
    }
}

#[test]
fn a_unit_goes_from_its_start_to_its_end() {
    let others = ["lets others start", "lets others work"];
    let mut bench = Bench::new(component("a"));
    assert_eq!(facts(&bench.unit), ["waiting", "due"]);
    assert_eq!(bench.unit.status().state, ComponentState::Waiting);
    bench.start();
    assert_eq!(facts(&bench.unit), ["alive"]);
    assert_eq!(bench.unit.status().state, ComponentState::Starting);
    assert_eq!(bench.unit.end_text(), None);
    bench.say(&ComponentMessage::Ready);
    let works = [&["alive", "ready", "settled"], &others[..]].concat();
    assert_eq!(facts(&bench.unit), works);
    assert_eq!(bench.unit.status().state, ComponentState::Running);
    let state = State::Emergency;
    bench.say(&ComponentMessage::State { state });
    assert_eq!(bench.unit.status().state, ComponentState::Emergency);
    bench.unit.ask_to_stop();
    assert!(bench.unit.is_asked_to_stop());
    assert_eq!(bench.unit.status().state, ComponentState::Stopping);
    bench.end(exit(0));
    let ended = [&["gone", "ready", "settled"], &others[..]].concat();
    assert_eq!(facts(&bench.unit), ended);
    assert_eq!(bench.unit.status().state, ComponentState::Done);
    assert_eq!(bench.unit.end_text(), Some("exit status 0"));
    assert!(bench.unit.end(&bench.report).is_none());
}

#[test]
fn a_unit_that_ends_is_done_by_success_or_by_the_signal_that_it_was_sent() {
    let by_term = || Exit {
        signal: Some(15),
        ..exit(-1)
    };
    let mut bench = Bench::ready(component("a"));
    assert!(!bench.end(by_term()).done);
    assert_eq!(bench.unit.status().state, ComponentState::Failed);
    let mut bench = Bench::ready(component("a"));
    bench.unit.ask_to_stop();
    assert!(bench.end(by_term()).done);
    let mut bench = Bench::ready(component("a"));
    assert!(bench.end(exit(0)).done);
}

#[test]
fn a_unit_that_a_command_has_stopped_waits_for_a_command() {
    let others = ["lets others start", "lets others work"];
    let mut bench = Bench::ready(component("a"));
    bench.unit.hold();
    let facts_of = |bench: &Bench| facts(&bench.unit);
    let stops = [
        &["stopped", "gone", "alive", "asked", "ready", "settled"],
        &others[..],
    ]
    .concat();
    assert_eq!(facts_of(&bench), stops);
    assert_eq!(bench.unit.status().state, ComponentState::Stopping);
    // A `start` before its end: it is not held any longer, and ends all the same.
    bench.unit.release();
    let ends = [&["alive", "asked", "ready", "settled"], &others[..]].concat();
    assert_eq!(facts_of(&bench), ends);
    bench.unit.hold();
    bench.end(exit(0));
    assert_eq!(bench.unit.status().state, ComponentState::Stopped);
    bench.unit.release();
    assert_eq!(facts_of(&bench), ["waiting", "due", "restarted"]);
    bench.unit.hold();
    let held = [&["waiting", "restarted", "stopped", "gone"], &others[..]].concat();
    assert_eq!(facts_of(&bench), held);
    assert_eq!(bench.unit.status().state, ComponentState::Stopped);
}

#[test]
fn a_restart_waits_for_its_pause() {
    let mut bench = Bench::ready(restarting("a", Policy::Always));
    assert_eq!(bench.unit.run(), "a/1");
    bench.end(exit(0));
    let begun = Instant::now();
    let next = bench.unit.follow(SECOND, false);
    let pause = Duration::from_millis(500);
    assert_eq!(next, Next::Again(pause));
    assert_eq!(facts(&bench.unit), ["waiting", "restarted"]);
    let due = bench.unit.deadline();
    assert!(is_after(due, begun, pause));
    let due = due.expect("a time");
    let early = due.checked_sub(Duration::from_nanos(1)).expect("a time");
    assert_eq!(bench.unit.check(early, &bench.report), Overdue::Nothing);
    assert!(!bench.unit.is_due());
    assert_eq!(bench.unit.check(due, &bench.report), Overdue::Nothing);
    assert_eq!(facts(&bench.unit), ["waiting", "due", "restarted"]);
    bench.start();
    assert_eq!(bench.unit.run(), "a/2");
    assert_eq!(facts(&bench.unit), ["restarted", "alive"]);
}

#[test]
fn a_unit_that_ends_without_a_restart_has_failed_if_its_end_is_a_failure() {
    for (code, failed, done) in [(0, false, true), (0, true, false), (1, true, false)] {
        let mut bench = Bench::ready(component("a"));
        bench.end(exit(code));
        assert_eq!(bench.unit.follow(SECOND, failed), Next::Nothing);
        assert!(matches!(&bench.unit.phase, Phase::Ended(end) if end.done == done));
        assert_eq!(bench.unit.end_text(), Some(&*format!("exit status {code}")));
    }
    let mut bench = Bench::started(component("a"));
    bench.unit.not_started();
    assert!(bench.unit.is_waiting());
    bench.unit.follow(Duration::ZERO, true);
    assert_eq!(bench.unit.end_text(), Some("could not be started"));
    assert_eq!(bench.unit.status().state, ComponentState::Failed);
}

#[test]
fn a_start_counts_for_a_share_of_its_time() {
    let begun = Instant::now();
    let mut bench = Bench::started(component("a"));
    assert!(is_after(
        bench.unit.starting(),
        begun,
        Duration::from_millis(250)
    ));
    bench.unit.ask_to_stop();
    assert_eq!(bench.unit.starting(), None);
    assert_eq!(Bench::ready(component("a")).unit.starting(), None);
    assert_eq!(Bench::new(component("a")).unit.starting(), None);
}

#[test]
fn a_unit_has_a_limit_until_it_is_ready() {
    let begun = Instant::now();
    let mut bench = Bench::started(component("a"));
    let limit = bench.unit.deadline();
    assert!(is_after(limit, begun, bench.unit.component.ready));
    let limit = limit.expect("a time");
    assert_eq!(bench.unit.check(begun, &bench.report), Overdue::Nothing);
    assert_eq!(bench.unit.check(limit, &bench.report), Overdue::NotReady);
}

#[test]
fn a_unit_that_does_not_end_is_killed_and_then_given_up() {
    let mut bench = Bench::ready(component("a"));
    bench.unit.remote_process().expect("it runs").pid = Some(4711);
    bench.outbox.take();
    let begun = Instant::now();
    bench.unit.ask_to_stop();
    let limit = bench.unit.deadline();
    assert!(is_after(limit, begun, bench.unit.component.stop));
    // Once more does not give it more time.
    bench.unit.ask_to_stop();
    assert_eq!(bench.unit.deadline(), limit);
    let begun = Instant::now();
    let at = limit.expect("a time");
    assert_eq!(bench.unit.check(at, &bench.report), Overdue::Nothing);
    assert_eq!(
        bench.events(),
        ["! killed: did not end within 3s and is killed"]
    );
    let limit = bench.unit.deadline();
    assert!(is_after(limit, begun, KILL_LIMIT));
    bench.unit.kill();
    bench.unit.ask_to_stop();
    assert_eq!(bench.unit.deadline(), limit);
    let sent = format!("{:?}", bench.outbox.take());
    assert_eq!(sent, r#"[Stop("a"), Kill("a")]"#);
    let at = limit.expect("a time");
    assert_eq!(bench.unit.check(at, &bench.report), Overdue::NotKilled);
    let text = "process 4711 does not end after SIGKILL";
    assert_eq!(bench.events(), [format!("!! not-killed: {text}")]);
    assert_eq!(bench.unit.end_text(), Some(text));
    assert!(bench.unit.is_lost() && bench.unit.is_gone());
    assert_eq!(bench.unit.status().state, ComponentState::Failed);
    let mut ended = Bench::ready(component("a"));
    ended.end(exit(1));
    assert!(!ended.unit.is_lost());
}

#[test]
fn a_silent_unit_hangs_and_its_policy_ends_that() {
    let hung = Some(Duration::from_secs(20));
    for policy in [Policy::Never, Policy::OnFailure, Policy::Always] {
        let mut component = restarting("a", policy);
        component.restart.hung = hung;
        let begun = Instant::now();
        let mut bench = Bench::ready(component);
        let limit = bench.unit.deadline();
        assert!(is_after(limit, begun, HEARTBEAT_LIMIT + HOST_LIMIT));
        let limit = limit.expect("a time");
        assert_eq!(bench.unit.check(limit, &bench.report), Overdue::Nothing);
        let text = "! hung: has not sent a heartbeat for 7s";
        assert_eq!(bench.events(), [text], "{policy:?}");
        assert_eq!(bench.unit.status().state, ComponentState::Hung);
        let end = bench.unit.deadline();
        if policy == Policy::Never {
            assert_eq!(end, None);
            continue;
        }
        assert_eq!(end, Some(bench.unit.heard + Duration::from_secs(20)));
        let end = end.expect("a time");
        assert_eq!(bench.unit.check(end, &bench.report), Overdue::HungTooLong);
    }
    let mut bench = Bench::ready(component("a"));
    bench.unit.remote_process().expect("it runs").linked = false;
    assert_eq!(bench.unit.deadline(), None, "nothing can come from it");
}

#[test]
fn a_closed_link_is_an_event_unless_the_unit_ends() {
    let closed = |linked: bool, asked: bool| {
        let mut bench = Bench::ready(component("a"));
        bench.unit.remote_process().expect("it runs").linked = linked;
        if asked {
            bench.unit.ask_to_stop();
        }
        let begun = Instant::now();
        bench.unit.link_closed();
        let limit = bench.unit.deadline();
        assert!(is_after(limit, begun, SECOND));
        let limit = limit.expect("a time");
        assert_eq!(bench.unit.check(begun, &bench.report), Overdue::Nothing);
        assert_eq!(bench.events(), [""; 0]);
        assert_eq!(bench.unit.check(limit, &bench.report), Overdue::Nothing);
        // It is said once.
        assert_ne!(bench.unit.deadline(), Some(limit));
        assert!(!bench.unit.is_asked_to_stop() || asked);
        bench.events().len()
    };
    assert_eq!(closed(false, false), 1);
    assert_eq!(closed(true, false), 0);
    assert_eq!(closed(false, true), 0);
}

#[test]
fn a_limit_before_a_closed_link_counts_first() {
    let mut component = component("a");
    component.stop = Duration::ZERO;
    let mut bench = Bench::ready(component);
    bench.unit.link_closed();
    bench.unit.ask_to_stop();
    bench.unit.check(Instant::now(), &bench.report);
    assert_eq!(
        bench.events(),
        ["! killed: did not end within 0ns and is killed"]
    );
}

#[test]
fn the_status_describes_the_present_run() {
    let host = Host {
        name: "robot".to_owned(),
        address: "robot.local".to_owned(),
        user: None,
        workspace: None,
        elsewhere: None,
    };
    let mut bench = Bench::new(Component {
        host: Some(host),
        ..restarting("a", Policy::Always)
    });
    let status = bench.unit.status();
    assert_eq!(
        (status.pid, status.uptime_s, status.exit),
        (None, None, None)
    );
    bench.start();
    bench.unit.remote_process().expect("it runs").pid = Some(7);
    bench.say(&ComponentMessage::Ready);
    if let Phase::Alive(running) = &mut bench.unit.phase {
        let ago = Duration::from_millis(1500);
        running.started = Instant::now().checked_sub(ago).expect("a time");
    }
    let status = bench.unit.status();
    assert_eq!(
        (&*status.name, status.pid, status.ready),
        ("a", Some(7), true)
    );
    assert_eq!(status.host.as_deref(), Some("robot"));
    let uptime = status.uptime_s.expect("it runs");
    assert!((1.5..60.0).contains(&uptime), "{uptime}");
    assert_eq!((status.ready_ms, status.stop_ms), (10_000, 3000));
    bench.end(exit(3));
    let status = bench.unit.status();
    assert_eq!(
        (status.pid, status.ready, status.restarts),
        (None, false, 0)
    );
    assert_eq!(status.exit.as_deref(), Some("exit status 3"));
    bench.unit.follow(SECOND, true);
    assert_eq!(bench.unit.status().restarts, 1);
    let managed = Bench::new(managed("a"));
    assert_eq!(facts(&managed.unit), ["waiting", "due", "managed"]);
}

#[test]
fn a_unit_that_is_not_local_has_no_descriptors() {
    let mut bench = Bench::ready(component("a"));
    assert!(bench.unit.registered().is_none() && bench.unit.process().is_none());
    assert!(bench.unit.link().is_none());
    bench.unit.read_link(&bench.report);
    assert!(bench.unit.is_alive());
    assert_eq!(
        bench.unit.deadline(),
        Some(bench.unit.heard + HEARTBEAT_LIMIT + HOST_LIMIT)
    );
    bench.end(exit(0));
    assert!(bench.unit.remote_process().is_none());
}

#[test]
fn a_poll_waits_until_the_deadline() {
    assert_eq!(until(None), None);
    let left = until(Some(Instant::now() + Duration::from_mins(1)));
    let left = left.expect("a time");
    assert!(left > SECOND && left <= Duration::from_mins(1), "{left:?}");
}
