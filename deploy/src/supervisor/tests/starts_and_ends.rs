//! Which units start and stop, and what follows their end.

use super::net::{Net, after, on, with_policy};
use super::{component, exit, managed};
use crate::supervisor::start_scheduler::LIMIT;
use crate::supervisor::supervise::StopReason;
use crate::supervisor::unit::Phase;
use rc_deploy_client::logs;
use rc_deploy_client::start_report::{self, CriticalChain};
use rc_deploy_network::plan::{Component, Policy};
use rc_management::agent::AgentMessage;
use rc_management::link::ComponentMessage;
use rc_management::supervisor::Verb;
use std::time::{Duration, Instant};

#[test]
fn two_units_start_in_a_turn_and_a_few_at_a_time() {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    assert_eq!(*LIMIT, 4 * processors);
    let names: Vec<String> = (0..*LIMIT + 3).map(|at| format!("c{at}")).collect();
    let mut components: Vec<Component> = names.iter().map(|name| component(name)).collect();
    components.push(on("other", component("far")));
    let mut net = Net::connected(components);
    net.start_ready_units();
    assert_eq!(net.alive(), ["c0", "c1"]);
    assert!(
        net.starts
            .deadline()
            .is_some_and(|next| next <= Instant::now())
    );
    // As if no time passed, however long the test takes.
    let later = Instant::now() + Duration::from_hours(1);
    for _ in 0..net.units.len() {
        for unit in &mut net.units {
            if let Phase::Alive(running) = &mut unit.phase {
                running.started = later;
            }
        }
        net.start_ready_units();
    }
    let alive = net.alive();
    assert_eq!(alive.len(), *LIMIT + 1);
    assert!(alive.contains(&"far"), "another machine has its own limit");
    let next = net.starts.deadline().expect("a time");
    assert_eq!(
        Some(next),
        net.units[0].starting(),
        "when the first one counts no longer"
    );
    // One that is ready does not count, and neither does one that starts for long.
    net.say(0, &ComponentMessage::Ready);
    net.start_ready_units();
    assert_eq!(net.alive().len(), *LIMIT + 2);
    let long = Duration::from_mins(1);
    if let Phase::Alive(running) = &mut net.units[1].phase {
        running.started = Instant::now().checked_sub(long).expect("a time");
    }
    net.start_ready_units();
    assert_eq!(net.alive().len(), *LIMIT + 3);
}

#[test]
fn a_unit_starts_when_those_that_it_needs_are_ready() {
    let components = vec![component("a"), after("a", component("b"))];
    let mut net = Net::connected(components);
    net.start_ready_units();
    assert_eq!(net.alive(), ["a"]);
    net.start_ready_units();
    assert_eq!((net.alive(), net.starts.deadline()), (vec!["a"], None));
    assert!(!net.is_up);
    net.say(0, &ComponentMessage::Ready);
    net.start_ready_units();
    assert_eq!(net.alive(), ["a", "b"]);
    net.note_up();
    assert!(!net.is_up);
    net.say(1, &ComponentMessage::Ready);
    net.events();
    net.note_up();
    net.note_up();
    let text = format!("- up: network {} is up", net.plan.network);
    assert_eq!(net.events(), [text]);
}

#[test]
fn nothing_starts_without_its_machine_or_while_the_network_stops() {
    let local = || vec![on("g", component("a")), on("h", component("b"))];
    let mut net = Net::new(local());
    net.hosts.pretend(0);
    net.start_ready_units();
    assert_eq!(net.alive(), [""; 0], "`h` was never connected");
    net.hosts.pretend(1);
    net.hosts.leave_one(0);
    net.start_ready_units();
    assert_eq!(net.alive(), ["b"]);
    let mut net = Net::connected(local());
    net.stop(StopReason::Asked, "a test");
    net.start_ready_units();
    assert_eq!(net.alive(), [""; 0]);
    net.note_up();
    assert!(!net.is_up);
    let mut net = Net::connected(local());
    net.units[0].hold();
    net.start_ready_units();
    assert_eq!(net.alive(), ["b"]);
    assert_eq!(net.gone().into_iter().collect::<Vec<_>>(), ["a"]);
}

#[test]
fn a_unit_that_ends_before_it_was_ready_stops_the_network() {
    let mut net = Net::connected(vec![component("a"), component("b")]);
    net.start_ready_units();
    net.events();
    net.end(0, exit(0));
    let reason = net.failure().expect("a failure").to_owned();
    assert!(
        reason.starts_with("a: ended before it was ready: exit status 0"),
        "{reason}"
    );
    let events = net.events();
    let failed = "!! a start-failed: ended before it was ready: exit status 0";
    assert_eq!(
        events,
        [failed, "- stopping: stopping: a component did not start"]
    );
    // Only the first reason counts.
    net.fail(1, "later");
    assert_eq!(net.failure(), Some(&*reason));
}

#[test]
fn a_unit_that_cannot_start_stops_the_network_only_at_its_first_start() {
    let not_started = || AgentMessage::NotStarted {
        name: "a".to_owned(),
        reason: "no such file".to_owned(),
    };
    let policy = with_policy(Policy::OnFailure, component("a"));
    let mut net = Net::connected(vec![policy.clone()]);
    net.start_ready_units();
    net.take_agent_message(0, not_started());
    assert!(
        net.failure()
            .expect("a failure")
            .starts_with("a: no such file")
    );

    let mut net = Net::up(vec![policy]);
    net.end(0, exit(1));
    net.units[0].due = None;
    net.start_ready_units();
    net.events();
    net.take_agent_message(0, not_started());
    assert_eq!(net.events()[0], "!! a start-failed: no such file");
    // It has restarted once, which is its limit.
    assert!(net.failure().expect("a failure").contains("restarted once"));
}

#[test]
fn the_end_of_a_unit_has_the_consequence_that_its_policy_says() {
    let mut net = Net::up(vec![component("a"), component("b")]);
    net.end(0, exit(0));
    assert_eq!(net.events(), ["a exited: ended: exit status 0"]);
    net.end(1, exit(1));
    assert_eq!(net.events(), ["!! b exited: ended: exit status 1"]);
    assert_eq!(net.failed, ["b"]);
    assert!(net.ending.is_none());

    let mut net = Net::up(vec![with_policy(Policy::Always, component("a"))]);
    net.end(0, exit(0));
    let events = net.events();
    assert_eq!(
        events,
        [
            "a exited: ended: exit status 0",
            "! a restarting: restarts in 500ms"
        ]
    );
    net.units[0].due = None;
    net.start_ready_units();
    net.end(0, exit(0));
    let events = net.events();
    // It was not ready again, so its end is a failure.
    assert_eq!(events[1], "!! a exited: ended: exit status 0");
    assert!(
        events[2].starts_with("!! a gave-up: restarted once"),
        "{events:?}"
    );
    assert!(
        net.failure()
            .expect("a failure")
            .starts_with("a: restarted once")
    );
    assert_eq!(net.failed, [""; 0]);
}

#[test]
fn a_unit_that_was_asked_to_end_fails_while_the_network_goes_on() {
    // It did not get ready again, and was asked to end for that.
    let mut net = Net::up(vec![with_policy(Policy::OnFailure, component("a"))]);
    net.units[0].ask_to_stop();
    net.end(0, exit(0));
    let events = net.events();
    assert_eq!(events[0], "! a exited: ended: exit status 0");
    assert!(events[1].starts_with("! a restarting"), "{events:?}");
}

#[test]
fn the_end_of_a_unit_that_a_command_has_stopped_is_as_asked() {
    let mut net = Net::up(vec![
        with_policy(Policy::Always, component("a")),
        component("b"),
    ]);
    for i in [0, 1] {
        net.units[i].hold();
        net.end(i, exit(i32::try_from(i).expect("a number")));
    }
    let events = [
        "a stopped: stopped: exit status 0",
        "! b stopped: stopped: exit status 1",
    ];
    assert_eq!(net.events(), events);
    assert_eq!(net.failed, [""; 0]);
    // A command that starts it again forgets that it has failed.
    let mut net = Net::up(vec![component("a"), component("b")]);
    net.end(0, exit(1));
    net.end(1, exit(1));
    assert_eq!(net.failed, ["a", "b"]);
    net.events();
    net.command(Verb::Start, &["a"]);
    assert_eq!(net.events(), ["- asked: asked to start a"]);
    assert_eq!(net.failed, ["b"]);
}

#[test]
fn a_network_stops_dependents_first() {
    let mut net = Net::up(vec![
        component("a"),
        after("a", component("b")),
        component("c"),
        component("d"),
    ]);
    net.stop_ready_units();
    assert_eq!(net.asked(), [""; 0]);
    net.stop(StopReason::Asked, "a test");
    net.stop_ready_units();
    assert_eq!(net.asked(), ["b", "c", "d"]);
    net.events();
    // An end as asked is not a failure, whatever its code is; that of another one is.
    net.end(1, exit(1));
    net.end(2, exit(0));
    net.end(0, exit(1));
    let events = [
        "! b exited: ended: exit status 1",
        "c exited: ended: exit status 0",
        "!! a exited: ended: exit status 1",
    ];
    assert_eq!(net.events(), events);
    assert_eq!(net.failed, ["a"]);
    net.stop_ready_units();
    assert_eq!(net.asked(), ["d"]);
}

#[test]
fn limits_of_units_are_handled() {
    let slow = || Component {
        ready: Duration::ZERO,
        ..with_policy(Policy::OnFailure, component("a"))
    };
    let mut net = Net::connected(vec![slow()]);
    net.start_ready_units();
    net.check_deadlines();
    assert!(
        net.failure()
            .expect("a failure")
            .starts_with("a: was not ready within 0ns")
    );
    net.check_deadlines();
    assert_eq!(net.asked(), ["a"]);

    let mut net = Net::up(vec![with_policy(Policy::OnFailure, component("a"))]);
    net.end(0, exit(1));
    net.units[0].component.ready = Duration::ZERO;
    net.units[0].due = None;
    net.start_ready_units();
    net.events();
    net.check_deadlines();
    assert_eq!(net.events(), ["! a not-ready: was not ready within 0ns"]);
    assert_eq!((net.asked(), net.failure()), (vec!["a"], None));

    let mut hangs = with_policy(Policy::OnFailure, component("a"));
    hangs.restart.hung = Some(Duration::ZERO);
    let mut net = Net::up(vec![hangs]);
    let report = net.report;
    net.units[0].hang(report, Instant::now(), "it hangs");
    net.events();
    net.check_deadlines();
    assert_eq!(
        net.events(),
        ["! a hung-too-long: has been hung for 0ns and is stopped"]
    );
    assert_eq!(net.asked(), ["a"]);
}

/// `status --start` shows the chain of a start: which component waited for which, also for the
/// activation of managed ones.
#[test]
fn a_start_is_reported_with_what_each_component_waited_for() {
    let mut net = Net::connected(vec![
        component("base"),
        component("quick"),
        after("base", managed("driver")),
        after("driver", component("planner")),
    ]);
    let place = logs::directory(&net.plan.network);
    net.start_ready_units();
    // The second of two that nobody waits for long.
    net.say(1, &ComponentMessage::Ready);
    net.note_up();
    net.say(0, &ComponentMessage::Ready);
    net.note_up();
    net.start_ready_units();
    net.say(2, &ComponentMessage::Ready);
    // It is configured, then active, and lets the planner start.
    for _ in 0..3 {
        net.obey(2);
        net.note_up();
        net.turn();
    }
    let report = |net: &mut Net| {
        net.note_up();
        net.save_start();
        let text = std::fs::read_to_string(start_report::file(&place)).expect("a report");
        CriticalChain::of(serde_json::from_str(&text).expect("a report"))
    };
    let names = |chain: &CriticalChain| -> Vec<String> {
        let links = chain.chain.iter();
        let names = links.map(|link| format!("{} {:?}", link.key.component, link.key.phase));
        names.collect()
    };
    // It has not come up: the one that is missing is the first.
    let unfinished = report(&mut net);
    assert_eq!(unfinished.start.up_ms, None);
    let wanted = [
        "planner Start",
        "driver Activate",
        "driver Start",
        "base Start",
    ];
    assert_eq!(names(&unfinished), wanted, "{unfinished}");
    assert_eq!(unfinished.chain[0].ended_ms, None);
    net.say(3, &ComponentMessage::Ready);
    let whole = report(&mut net);
    assert!(whole.start.up_ms.is_some(), "{whole}");
    assert_eq!(names(&whole), wanted, "{whole}");
    let ends: Vec<Option<f64>> = whole.chain.iter().map(|link| link.ended_ms).collect();
    assert!(ends.is_sorted_by(|a, b| a >= b), "{whole}");
    // What starts later is no part of it.
    let before = std::fs::read_to_string(start_report::file(&place)).expect("a report");
    net.save_start();
    let later = std::fs::read_to_string(start_report::file(&place)).expect("a report");
    assert_eq!(before, later);
}
