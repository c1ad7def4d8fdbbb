//! A unit's handling of the messages of its component.

use super::{Bench, component, exit, managed};
use crate::remote::SupervisorMessage;
use crate::supervisor::unit::Overdue;
use rc_management::component::{ConvertedStatus, State};
use rc_management::lifecycle::LifecycleState;
use rc_management::lines::Line;
use rc_management::link::{self, ComponentMessage, Heartbeat, MOST_GARBAGE, UnsavedParameters};
use std::collections::BTreeMap;
use std::time::Instant;

#[test]
fn a_new_state_is_one_event() {
    let mut bench = Bench::started(component("a"));
    let states = [
        State::Starting,
        State::Running,
        State::Running,
        State::Emergency,
        State::Stopping,
    ];
    for state in states {
        bench.say(&ComponentMessage::State { state });
    }
    assert_eq!(
        bench.events(),
        ["state: running", "! state: emergency", "state: stopping"]
    );
    bench.end(exit(0));
    let state = State::Running;
    bench.say(&ComponentMessage::State { state });
    assert_eq!(bench.events(), [""; 0], "it has ended");
}

#[test]
fn a_unit_is_ready_once_in_a_run() {
    let mut bench = Bench::started(component("a"));
    bench.say(&ComponentMessage::Ready);
    bench.say(&ComponentMessage::Ready);
    let events = bench.events();
    assert_eq!(events.len(), 1, "{events:?}");
    assert!(events[0].starts_with("ready: ready after "), "{events:?}");
    let mut bench = Bench::started(managed("a"));
    bench.say(&ComponentMessage::Ready);
    assert_eq!(bench.events(), [""; 0], "it is not configured yet");
}

#[test]
fn heartbeats_say_whether_the_event_loop_runs() {
    let hung = "! hung: its event loop has not run for 2001 ms";
    let again = "answers-again: its event loop runs again";
    let mut bench = Bench::ready(component("a"));
    bench.beat(2000);
    assert_eq!(bench.events(), [""; 0]);
    bench.beat(2001);
    bench.beat(2001);
    let since = bench.unit.hung.expect("it hangs");
    assert!(since < bench.unit.heard);
    assert_eq!(bench.events(), [hung]);
    bench.beat(2000);
    bench.beat(0);
    assert_eq!(bench.events(), [again]);
    bench.unit.ask_to_stop();
    bench.beat(9000);
    assert_eq!(bench.events(), [""; 0]);

    let mut starts = Bench::started(component("a"));
    starts.beat(9000);
    assert_eq!(starts.events(), [""; 0], "its limit is that of its start");
}

#[test]
fn a_hook_may_take_as_long_as_a_start() {
    let mut bench = Bench::managed(LifecycleState::Active);
    bench.report(LifecycleState::Deactivating, 2, None);
    bench.events();
    bench.beat(10_000);
    assert_eq!(bench.events(), [""; 0]);
    bench.beat(10_001);
    assert_eq!(bench.events().len(), 1);
}

#[test]
fn conditions_are_reported_until_the_network_stops() {
    let unlike = |text: &str| {
        ComponentMessage::Heartbeat(Heartbeat {
            mismatches: vec![text.to_owned()],
            lost: BTreeMap::from([("Laser".to_owned(), 3)]),
            converted: BTreeMap::from([(
                "Laser".to_owned(),
                ConvertedStatus {
                    messages: 9,
                    bad_values: 1,
                    unplaced: 0,
                    locked: 0,
                    bad_value: Some("from `lidar.Laser`: no length".to_owned()),
                },
            )]),
            ..Heartbeat::default()
        })
    };
    let mut bench = Bench::ready(component("a"));
    bench.say(&unlike("one"));
    let refused = "! bad-value: slot Laser refused a message from `lidar.Laser`: no length";
    assert_eq!(bench.events(), ["!! mismatch: one", refused]);
    assert_eq!(bench.unit.lost["Laser"], 3);
    assert_eq!(bench.unit.status().converted["Laser"].messages, 9);
    assert_eq!(bench.unit.status().troubles.len(), 2);
    bench.unit.be_quiet();
    bench.say(&unlike("two"));
    assert_eq!(bench.events(), [""; 0]);
    let mut bench = Bench::ready(component("a"));
    bench.unit.ask_to_stop();
    bench.say(&unlike("three"));
    assert_eq!(bench.events(), [""; 0]);
}

#[test]
fn a_heartbeat_keeps_a_unit_from_being_silent() {
    let mut bench = Bench::ready(component("a"));
    let first = bench.unit.deadline().expect("a time");
    bench.beat(0);
    let second = bench.unit.deadline().expect("a time");
    assert!(second > first);
    assert_eq!(bench.unit.check(first, &bench.report), Overdue::Nothing);
    assert_eq!(bench.events(), [""; 0]);
}

/// The first lines of the runs since the last call.
fn greetings(bench: &Bench) -> Vec<Option<String>> {
    let sent = bench.outbox.take().into_iter();
    sent.filter_map(|message| match message {
        SupervisorMessage::Start { greeting, .. } => Some(greeting),
        _ => None,
    })
    .collect()
}

#[test]
fn unsaved_changes_are_restored_in_the_next_run() {
    let mut bench = Bench::ready(component("a"));
    assert_eq!(greetings(&bench), [None]);
    let changed = serde_json::json!({ "speed": 3 });
    bench.say(&ComponentMessage::Parameters(UnsavedParameters {
        changed: changed.as_object().expect("a table").clone(),
        unkept: vec!["password".to_owned()],
    }));
    bench.end(exit(1));
    bench.unit.release();
    bench.start();
    let greeting = greetings(&bench).remove(0).expect("changes");
    let greeting = link::SupervisorMessage::decode(greeting.trim().as_bytes());
    let changes = changed.as_object().expect("a table").clone();
    assert_eq!(
        greeting,
        Some(link::SupervisorMessage::Restore {
            changes,
            ruled: Vec::new(),
        })
    );
    bench.say(&ComponentMessage::Ready);
    let lost = "! not-restored: changed parameters that are secret, or too long, were not restored: password; they are as in the configuration";
    assert_eq!(bench.events()[1..], [lost]);
    bench.say(&ComponentMessage::Restored { refused: None });
    let text = "restored: has its changed parameters again: speed";
    assert_eq!(bench.events(), [text]);
    let refused = Some("too fast".to_owned());
    bench.say(&ComponentMessage::Restored { refused });
    let text = "! not-restored: runs with its configuration; changed parameters were not restored: too fast";
    assert_eq!(bench.events(), [text]);
    bench.end(exit(1));
    bench.unit.release();
    bench.start();
    assert_eq!(greetings(&bench), [None], "they were refused");
    bench.say(&ComponentMessage::Ready);
    assert_eq!(bench.events().len(), 1);
}

#[test]
fn garbage_is_reported_once_and_too_much_of_it_ends_a_unit() {
    let mut bench = Bench::ready(component("a"));
    let lines = MOST_GARBAGE / Line::TooLong.size();
    for _ in 0..lines {
        bench.unit.handle_line(Line::TooLong, &bench.report);
    }
    let text = "! garbage: sent a line of more than 64 KiB to its supervisor; further faults are not reported";
    assert_eq!(bench.events(), [text]);
    assert!(!bench.unit.is_asked_to_stop());
    for _ in 0..3 {
        let line = Line::Complete(b"hello".to_vec());
        bench.unit.handle_line(line, &bench.report);
    }
    let text = "!! garbage: sent more than 1 MiB that its supervisor cannot read, and is stopped";
    assert_eq!(bench.events(), [text]);
    assert!(bench.unit.is_asked_to_stop());
}

#[test]
fn a_new_run_begins_without_the_faults_of_the_last_one() {
    let mut bench = Bench::ready(component("a"));
    bench.unit.handle_line(Line::TooLong, &bench.report);
    bench.unit.hang(&bench.report, Instant::now(), "it hangs");
    bench.end(exit(1));
    bench.unit.release();
    bench.start();
    assert_eq!((bench.unit.garbage, bench.unit.hung), (0, None));
    assert!(bench.unit.lost.is_empty() && bench.unit.reported.is_none());
    assert!(!bench.unit.is_ready());
}

#[test]
fn a_failure_quotes_the_log() {
    let bench = Bench::new(component("a"));
    let text = bench.unit.failure("ended");
    assert!(text.starts_with("ended; "), "{text}");
    assert!(text.contains("/nowhere/a.log"), "{text}");
}
