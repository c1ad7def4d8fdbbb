//! The way of a managed unit to the goal of its life cycle.

use super::{Bench, component, exit, is_after, managed};
use rc_management::lifecycle::LifecycleState::{
    self, Activating, Active, Configuring, Deactivating, ErrorProcessing, Finalized, Inactive,
    Unconfigured,
};
use rc_management::lifecycle::Transition;
use rc_management::link::{ComponentMessage, SupervisorMessage};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(5);

fn goal(bench: &Bench) -> LifecycleState {
    bench.unit.lifecycle_goal().expect("it is managed")
}

/// The conditions of a unit: ready, settled, settled once, dependents can work.
fn facts(bench: &Bench) -> [bool; 4] {
    let unit = &bench.unit;
    let works = unit.lets_others_work();
    [
        unit.is_ready(),
        unit.is_settled(),
        unit.has_settled(),
        works,
    ]
}

/// Tells a unit its next goal.
fn send(bench: &mut Bench, goal: LifecycleState) {
    assert_eq!(bench.unit.next_goal(), Some(goal));
    bench.unit.send_goal(goal, LIMIT);
    assert_eq!(bench.unit.next_goal(), None);
}

#[test]
fn a_managed_unit_is_configured_and_then_activated() {
    let mut bench = Bench::started(managed("a"));
    bench.report(Unconfigured, 0, None);
    assert_eq!(bench.unit.next_goal(), None, "its loop does not run yet");
    bench.say(&ComponentMessage::Ready);
    bench.outbox.take();
    let begun = Instant::now();
    send(&mut bench, Inactive);
    let first = SupervisorMessage::Lifecycle {
        number: 1,
        goal: Inactive,
    };
    assert_eq!(bench.told(), [first]);
    assert!(is_after(bench.unit.goal_deadline(), begun, LIMIT));
    assert_eq!(bench.unit.deadline(), bench.unit.goal_deadline());
    bench.report(Configuring, 0, None);
    assert!(bench.unit.is_in_transition());
    assert_eq!(facts(&bench), [false; 4]);
    bench.report(Inactive, 1, None);
    assert!(!bench.unit.is_in_transition());
    assert_eq!(bench.unit.goal_deadline(), None);
    assert_eq!(facts(&bench), [true, false, false, false]);
    send(&mut bench, Active);
    let second = SupervisorMessage::Lifecycle {
        number: 2,
        goal: Active,
    };
    assert_eq!(bench.told(), [second]);
    bench.report(Activating, 1, None);
    // It is on the way until it says that it has done the second one.
    bench.report(Active, 1, None);
    assert_eq!(facts(&bench), [true, false, false, false]);
    bench.report(Active, 2, None);
    assert_eq!(facts(&bench), [true; 4]);
    assert_eq!(bench.unit.next_goal(), None);
    let mut events = bench.events();
    events.retain(|event| event.starts_with("lifecycle"));
    let states = [
        "unconfigured",
        "configuring",
        "inactive",
        "activating",
        "active",
    ];
    assert_eq!(events, states.map(|state| format!("lifecycle: {state}")));
}

#[test]
fn a_unit_that_is_not_managed_has_no_life_cycle() {
    let mut bench = Bench::ready(component("a"));
    assert_eq!(
        (bench.unit.lifecycle_state(), bench.unit.lifecycle_goal()),
        (None, None)
    );
    assert_eq!(facts(&bench), [true; 4]);
    bench.report(Finalized, 0, None);
    bench.unit.set_lifecycle_goal(Inactive);
    bench.unit.abandon_goal();
    bench.unit.send_goal(Inactive, LIMIT);
    assert_eq!(bench.told(), []);
    assert_eq!(bench.unit.meant(Transition::Activate), None);
    assert_eq!(bench.unit.next_goal(), None);
    assert_eq!(bench.unit.missed_goal(Instant::now()), None);
    assert_eq!(bench.events(), [""; 0]);
    assert!(!bench.unit.is_in_transition());
    assert_eq!(facts(&bench), [true; 4]);
}

#[test]
fn a_managed_dependent_may_start_before_a_unit_is_active() {
    let mut bench = Bench::started(managed("a"));
    let lets = |bench: &Bench| {
        [managed("b"), component("b")].map(|b| bench.unit.lets_start(&Bench::new(b).unit))
    };
    assert_eq!(lets(&bench), [false, false]);
    bench.say(&ComponentMessage::Ready);
    bench.report(Unconfigured, 0, None);
    send(&mut bench, Inactive);
    bench.report(Inactive, 1, None);
    assert_eq!(lets(&bench), [true, false]);
    send(&mut bench, Active);
    bench.report(Active, 2, None);
    assert_eq!(lets(&bench), [true, true]);
    // One that is finalized will not come back by itself, and neither will one that has ended.
    bench.report(Finalized, 2, None);
    assert_eq!(lets(&bench), [true, true]);
    let mut ended = Bench::started(managed("a"));
    ended.end(exit(1));
    assert_eq!(lets(&ended), [true, true]);
}

#[test]
fn a_steady_unit_may_be_changed_by_others() {
    let mut bench = Bench::managed(Active);
    bench.report(Deactivating, 2, None);
    assert_eq!(goal(&bench), Active, "it is on the way");
    bench.report(Inactive, 2, None);
    assert_eq!(goal(&bench), Inactive);
    assert!(bench.unit.is_settled());
    bench.report(Finalized, 2, None);
    assert_eq!(goal(&bench), Inactive, "it is not restarted for that");
    let events = [
        "lifecycle: deactivating",
        "lifecycle: inactive",
        "! lifecycle: finalized",
    ];
    assert_eq!(bench.events(), events);
    // The state that others have brought it to is that of its next run.
    let mut bench = Bench::managed(Active);
    bench.report(Inactive, 2, None);
    bench.end(exit(1));
    bench.unit.release();
    bench.unit.abandon_goal();
    bench.start();
    assert_eq!(goal(&bench), Inactive);
}

#[test]
fn a_unit_with_a_new_goal_is_not_changed_by_others() {
    let mut bench = Bench::managed(Active);
    bench.unit.set_lifecycle_goal(Unconfigured);
    bench.report(Inactive, 2, None);
    assert_eq!(goal(&bench), Unconfigured);
    let mut bench = Bench::managed(Active);
    bench.unit.set_lifecycle_goal(Inactive);
    send(&mut bench, Inactive);
    // A report of another state, on the way.
    bench.report(Unconfigured, 2, None);
    assert_eq!(goal(&bench), Inactive);
    bench.report(Inactive, 2, None);
    assert!(!bench.unit.is_settled());
    bench.report(Inactive, 3, None);
    assert!(bench.unit.is_settled());
}

#[test]
fn a_hook_that_fails_is_a_missed_goal() {
    let mut bench = Bench::managed(Inactive);
    bench.unit.set_lifecycle_goal(Active);
    send(&mut bench, Active);
    bench.report(ErrorProcessing, 1, None);
    bench.report(Unconfigured, 2, Some("activate: no motor"));
    assert_eq!(bench.unit.next_goal(), None, "its supervisor decides first");
    assert_eq!(goal(&bench), Active);
    let events = ["! lifecycle: errorprocessing", "lifecycle: unconfigured"];
    assert_eq!(bench.events(), events);
    let now = Instant::now();
    let reason = bench.unit.missed_goal(now);
    assert_eq!(reason.as_deref(), Some("activate: no motor"));
    assert_eq!(bench.unit.missed_goal(now), None);
    assert_eq!(bench.unit.next_goal(), Some(Inactive));

    // The goal state alone is not enough if the hook failed.
    let mut bench = Bench::managed(Inactive);
    bench.unit.set_lifecycle_goal(Active);
    send(&mut bench, Active);
    bench.report(Active, 2, Some("half"));
    assert!(bench.unit.missed_goal(now).is_some());
    bench.report(Inactive, 2, None);
    assert_eq!(goal(&bench), Active, "it has never been steady");
}

#[test]
fn a_goal_that_is_late_is_missed() {
    let mut bench = Bench::managed(Inactive);
    bench.unit.set_lifecycle_goal(Active);
    send(&mut bench, Active);
    bench.report(Activating, 1, None);
    let late = bench.unit.goal_deadline().expect("a time");
    assert_eq!(bench.unit.missed_goal(Instant::now()), None);
    let reason = bench.unit.missed_goal(late);
    assert_eq!(
        reason.as_deref(),
        Some("is activating, not active, after 10s")
    );
    assert_eq!(bench.unit.missed_goal(late), None);
    let mut bench = Bench::started(managed("a"));
    bench.unit.send_goal(Inactive, Duration::ZERO);
    let reason = bench.unit.missed_goal(Instant::now());
    assert_eq!(
        reason.as_deref(),
        Some("is silent, not inactive, after 10s")
    );
}

#[test]
fn a_unit_that_is_asked_to_end_has_no_goals() {
    let mut bench = Bench::managed(Active);
    bench.unit.set_lifecycle_goal(Inactive);
    assert_eq!(bench.unit.next_goal(), Some(Inactive));
    bench.unit.send_goal(Inactive, LIMIT);
    bench.unit.ask_to_stop();
    assert_eq!(bench.unit.goal_deadline(), None);
    bench.report(Inactive, 3, None);
    assert_eq!(bench.unit.next_goal(), None);

    let mut bench = Bench::managed(Active);
    bench.unit.ask_to_stop();
    bench.report(Inactive, 2, None);
    bench.report(Finalized, 2, None);
    assert_eq!(goal(&bench), Active);
    let events = ["lifecycle: inactive", "lifecycle: finalized"];
    assert_eq!(bench.events(), events, "as usual at its end");
    bench.end(exit(0));
    assert_eq!(
        (bench.unit.next_goal(), bench.unit.goal_deadline()),
        (None, None)
    );
    bench.unit.set_lifecycle_goal(Inactive);
    bench.report(Active, 0, None);
    assert_eq!(bench.unit.next_goal(), None, "it has ended");
}

#[test]
fn a_unit_rests_where_its_goal_is_given_up() {
    let mut bench = Bench::managed(Inactive);
    bench.unit.set_lifecycle_goal(Active);
    bench.unit.abandon_goal();
    assert_eq!(goal(&bench), Inactive);
    // A hook that runs ends first.
    bench.unit.set_lifecycle_goal(Active);
    send(&mut bench, Active);
    bench.report(Activating, 1, None);
    bench.unit.abandon_goal();
    assert_eq!(goal(&bench), Active);
    bench
        .unit
        .missed_goal(Instant::now() + Duration::from_mins(1));
    bench.unit.abandon_goal();
    assert_eq!(goal(&bench), Active, "the hook runs");
    bench.report(Inactive, 2, None);
    assert_eq!(goal(&bench), Inactive);
    // A goal that is set again counts again.
    bench.unit.set_lifecycle_goal(Active);
    bench.report(Inactive, 2, None);
    assert_eq!(goal(&bench), Active);
}

#[test]
fn a_unit_without_a_state_rests_at_the_goal_that_it_reached_last() {
    let mut bench = Bench::managed(Inactive);
    bench.unit.set_lifecycle_goal(Active);
    bench.unit.ask_to_stop();
    bench.unit.abandon_goal();
    assert_eq!(goal(&bench), Active, "it ends anyway");
    bench.end(exit(1));
    bench.unit.abandon_goal();
    assert_eq!(goal(&bench), Active);
    bench.unit.release();
    bench.start();
    assert_eq!(goal(&bench), Inactive);
    assert_eq!(bench.unit.lifecycle_state(), None);

    let mut bench = Bench::managed(Inactive);
    bench.unit.set_lifecycle_goal(Active);
    bench.report(Finalized, 1, None);
    bench.unit.abandon_goal();
    assert_eq!(goal(&bench), Inactive);
}

#[test]
fn a_command_means_a_state_from_where_a_unit_is_about_to_be() {
    let bench = Bench::managed(Active);
    assert_eq!(bench.unit.meant(Transition::Configure), Some(Active));
    let mut bench = Bench::managed(Inactive);
    assert_eq!(bench.unit.meant(Transition::Configure), Some(Inactive));
    assert_eq!(bench.unit.meant(Transition::Cleanup), Some(Unconfigured));
    bench.unit.set_lifecycle_goal(Active);
    send(&mut bench, Active);
    assert_eq!(bench.unit.meant(Transition::Configure), Some(Active));
    assert_eq!(bench.unit.meant(Transition::Deactivate), Some(Inactive));
    // Where nothing was sent, and a hook of others runs, its goal counts.
    let mut bench = Bench::managed(Active);
    bench.report(Deactivating, 2, None);
    assert_eq!(bench.unit.meant(Transition::Configure), Some(Active));
}
