//! Commands to several units.

use super::{Bench, component, exit, is_after, managed};
use crate::supervisor::commands::Commands;
use crate::supervisor::control::ClientRequest;
use crate::supervisor::unit::Unit;
use rc_management::lifecycle::LifecycleState::{self, Active, Inactive, Unconfigured};
use rc_management::lifecycle::Transition;
use rc_management::link::{ComponentMessage, UnsavedParameters};
use rc_management::supervisor::{Request, Verb};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

const ACTIVATE: Verb = Verb::Lifecycle(Transition::Activate);
const CLEAN_UP: Verb = Verb::Lifecycle(Transition::Cleanup);

/// Units with their commands. Each unit needs the one before it.
struct Group {
    benches: Vec<Bench>,
    needs: Vec<BTreeSet<usize>>,
    commands: Commands,
}

/// Changes all units as if they were in one place.
fn with<T>(benches: &mut [Bench], change: impl FnOnce(&mut [Unit]) -> T) -> T {
    let none = || Unit::new(component("none"), "/".into());
    let mut units: Vec<Unit> = benches
        .iter_mut()
        .map(|bench| std::mem::replace(&mut bench.unit, none()))
        .collect();
    let result = change(&mut units);
    for (bench, unit) in benches.iter_mut().zip(units) {
        bench.unit = unit;
    }
    result
}

impl Group {
    fn new(benches: Vec<Bench>) -> Self {
        let needs: Vec<BTreeSet<usize>> = (0..benches.len())
            .map(|i| i.checked_sub(1).into_iter().collect())
            .collect();
        let mates: Vec<BTreeSet<usize>> = (0..benches.len()).map(|i| BTreeSet::from([i])).collect();
        Self {
            benches,
            commands: Commands::new(&needs, &mates),
            needs,
        }
    }

    /// Units that are ready, with these names.
    fn ready(names: &[&str]) -> Self {
        Self::new(
            names
                .iter()
                .map(|name| Bench::ready(component(name)))
                .collect(),
        )
    }

    fn managed(state: LifecycleState, count: usize) -> Self {
        let mut benches: Vec<Bench> = (0..count).map(|_| Bench::managed(state)).collect();
        for (at, bench) in benches.iter_mut().enumerate() {
            bench.unit.component.name = format!("m{at}");
        }
        Self::new(benches)
    }

    fn take(&mut self, client: u64, verb: Verb, members: &[usize]) {
        let request = ClientRequest::of(client, Request::Status);
        let members = members.iter().copied().collect();
        let commands = &mut self.commands;
        with(&mut self.benches, |units| {
            commands.take(request, verb, members, units);
        });
    }

    /// The results of commands that have ended: `CLIENT done NAME… failed NAME: REASON…`
    fn advance_at(&mut self, now: Instant) -> Vec<String> {
        let (commands, needs) = (&mut self.commands, &self.needs);
        let ended = with(&mut self.benches, |units| {
            commands.advance(units, needs, now)
        });
        let texts = ended.into_iter().map(|(request, result)| {
            let mut text = format!("{}", request.client());
            for name in result.done {
                text += &format!(" done {name}");
            }
            for failed in result.failed {
                text += &format!(" failed {}: {}", failed.name, failed.reason);
            }
            text
        });
        texts.collect()
    }

    fn advance(&mut self) -> Vec<String> {
        self.advance_at(Instant::now())
    }

    /// The results when the limits of all commands are over.
    fn late(&mut self) -> Vec<String> {
        let limit = self.commands.deadline().expect("a command");
        let early = limit.checked_sub(Duration::from_nanos(1)).expect("a time");
        assert_eq!(self.advance_at(early), [""; 0]);
        self.advance_at(limit)
    }

    fn unit(&mut self, i: usize) -> &mut Unit {
        &mut self.benches[i].unit
    }

    fn end(&mut self, i: usize) {
        self.benches[i].end(exit(0));
    }

    fn start(&mut self, i: usize) {
        assert!(self.unit(i).is_due());
        self.benches[i].start();
    }

    fn become_ready(&mut self, i: usize) {
        self.benches[i].say(&ComponentMessage::Ready);
    }

    fn asked(&self) -> Vec<bool> {
        let units = self.benches.iter().map(|bench| &bench.unit);
        units.map(Unit::is_asked_to_stop).collect()
    }
}

#[test]
fn a_stop_ends_dependents_first() {
    let mut group = Group::ready(&["a", "b", "c"]);
    let begun = Instant::now();
    group.take(7, Verb::Stop, &[0, 2]);
    // 3 s for the end, 2 s for the kill and 10 s for the start of each, and a margin.
    assert!(is_after(
        group.commands.deadline(),
        begun,
        Duration::from_secs(2 * 15 + 5)
    ));
    assert_eq!(group.advance(), [""; 0]);
    assert_eq!(
        group.asked(),
        [false, false, true],
        "`c` needs `a` through `b`"
    );
    group.end(2);
    assert_eq!(group.advance(), [""; 0]);
    assert_eq!(group.asked(), [true, false, false]);
    group.end(0);
    assert_eq!(group.advance(), ["7 done a done c"]);
    assert_eq!(group.commands.deadline(), None);
    assert!(group.unit(0).is_stopped() && group.unit(2).is_stopped());
    assert!(!group.unit(1).is_stopped());
}

#[test]
fn a_restart_is_done_when_all_are_ready_again() {
    let mut group = Group::ready(&["a", "b"]);
    group.take(7, Verb::Restart, &[0, 1]);
    group.advance();
    group.end(1);
    group.advance();
    assert!(
        group.unit(1).is_stopped(),
        "none starts before all have ended"
    );
    group.end(0);
    assert_eq!(group.advance(), [""; 0]);
    group.start(0);
    group.become_ready(0);
    assert_eq!(group.advance(), [""; 0]);
    group.start(1);
    group.become_ready(1);
    assert_eq!(group.advance(), ["7 done a done b"]);
}

#[test]
fn a_restart_says_why_units_are_late() {
    let mut group = Group::ready(&["a", "b", "c", "d"]);
    group.take(7, Verb::Restart, &[0, 1, 2, 3]);
    group.advance();
    for i in [3, 2, 1, 0] {
        group.end(i);
        group.advance();
    }
    group.start(0);
    group.become_ready(0);
    group.start(1);
    let late = group.late();
    let reasons = "failed b: is not ready yet failed c: waits for b failed d: waits for c";
    assert_eq!(late, [format!("7 done a {reasons}")]);
}

#[test]
fn a_stop_that_is_late_names_those_that_have_not_ended() {
    let mut group = Group::ready(&["a", "b"]);
    group.take(7, Verb::Stop, &[0, 1]);
    group.advance();
    group.end(1);
    group.advance();
    assert_eq!(group.late(), ["7 done b failed a: has not ended yet"]);
    // One that was given up counts as ended, and not as done.
    let mut group = Group::ready(&["a"]);
    group.take(7, Verb::Stop, &[0]);
    group.advance();
    group.unit(0).kill();
    let limit = group.unit(0).deadline().expect("a time");
    let bench = &mut group.benches[0];
    bench.unit.check(limit, &bench.report);
    let lost = "7 failed a: process  does not end after SIGKILL";
    assert_eq!(group.advance(), [lost]);
}

#[test]
fn a_start_begins_with_the_configuration_and_leaves_running_units_alone() {
    let changes = |bench: &mut Bench| {
        let changed = serde_json::json!({ "speed": 3 });
        bench.say(&ComponentMessage::Parameters(UnsavedParameters {
            changed: changed.as_object().expect("a table").clone(),
            unkept: Vec::new(),
        }));
    };
    let mut group = Group::ready(&["a", "b", "c"]);
    group.benches.iter_mut().for_each(changes);
    group.end(0);
    // `c` is about to end, since a command has stopped it.
    group.unit(2).hold();
    group.take(7, Verb::Start, &[0, 1, 2]);
    assert_eq!(group.advance(), [""; 0]);
    assert!(!group.unit(0).is_waiting(), "it starts when `c` has ended");
    group.end(2);
    assert_eq!(group.advance(), [""; 0]);
    assert!(group.unit(1).is_ready() && !group.unit(1).is_restarted());
    for (i, restores) in [(0, false), (1, true), (2, false)] {
        let restored = group.unit(i).changes.line(&[]);
        assert_eq!(restored.is_some(), restores, "{i}");
    }
    for i in [0, 2] {
        group.start(i);
        group.become_ready(i);
    }
    assert_eq!(group.advance(), ["7 done a done b done c"]);

    let mut group = Group::ready(&["a"]);
    changes(&mut group.benches[0]);
    group.take(7, Verb::Restart, &[0]);
    group.advance();
    group.end(0);
    group.advance();
    assert!(
        group.unit(0).changes.line(&[]).is_some(),
        "a restart keeps them"
    );
}

#[test]
fn a_failure_ends_a_start_and_those_that_wait_for_it() {
    let mut group = Group::ready(&["a", "b", "c"]);
    for i in [2, 1, 0] {
        group.end(i);
        group.unit(i).hold();
    }
    group.take(7, Verb::Start, &[0, 1, 2]);
    group.advance();
    group.start(0);
    group.commands.failed(0, "no motor");
    group.commands.failed(0, "later");
    let failed = "failed a: no motor failed b: waits for a failed c: waits for b";
    assert_eq!(group.advance(), [format!("7 {failed}")]);
}

#[test]
fn a_failure_concerns_commands_that_start_the_unit() {
    let mut group = Group::ready(&["a", "b"]);
    group.take(1, Verb::Stop, &[0]);
    group.take(2, Verb::Restart, &[1]);
    group.advance();
    group.commands.failed(0, "a fault");
    // It may end as it likes before it starts again.
    group.commands.failed(1, "a fault");
    group.end(0);
    group.end(1);
    assert_eq!(group.advance(), ["1 done a"]);
    group.commands.failed(0, "another unit");
    group.start(1);
    group.become_ready(1);
    assert_eq!(group.advance(), ["2 done b"]);
}

#[test]
fn a_later_command_takes_units_over() {
    let mut group = Group::ready(&["a", "b"]);
    group.take(1, Verb::Restart, &[0, 1]);
    group.take(2, Verb::Stop, &[1]);
    assert_eq!(group.advance(), [""; 0]);
    group.end(1);
    assert_eq!(group.advance(), ["2 done b"]);
    assert!(group.unit(1).is_stopped());
    group.end(0);
    group.advance();
    group.start(0);
    group.become_ready(0);
    let taken = "1 done a failed b: `stop` was asked for meanwhile";
    assert_eq!(group.advance(), [taken]);
}

#[test]
fn the_end_of_the_network_ends_all_commands() {
    let mut group = Group::ready(&["a", "b"]);
    group.take(1, Verb::Stop, &[0]);
    group.take(2, Verb::Restart, &[1]);
    let commands = &mut group.commands;
    let ended = with(&mut group.benches, |units| commands.end(units));
    let reasons: Vec<&str> = ended
        .iter()
        .flat_map(|(_, result)| &result.failed)
        .map(|failed| &*failed.reason)
        .collect();
    assert_eq!(reasons, ["the network stops"; 2]);
    assert_eq!(group.commands.deadline(), None);
}

/// Takes a managed unit one step further.
fn step(group: &mut Group, i: usize) {
    let bench = &mut group.benches[i];
    let goal = bench.unit.next_goal().expect("a goal");
    bench.unit.send_goal(goal, Duration::from_secs(5));
    let control = bench.unit.lifecycle.as_ref();
    let (number, _) = control.expect("it is managed").sent();
    bench.report(goal, number, None);
}

#[test]
fn a_life_cycle_command_is_done_when_all_have_come_to_their_state() {
    let mut group = Group::managed(Active, 2);
    let begun = Instant::now();
    assert!(!group.commands.changes_lifecycle(0));
    group.take(7, CLEAN_UP, &[0]);
    assert!(is_after(
        group.commands.deadline(),
        begun,
        Duration::from_secs(25)
    ));
    assert!(group.commands.changes_lifecycle(0) && !group.commands.changes_lifecycle(1));
    assert_eq!(group.unit(0).lifecycle_goal(), Some(Unconfigured));
    assert_eq!(group.advance(), [""; 0]);
    step(&mut group, 0);
    assert_eq!(group.advance(), [""; 0]);
    step(&mut group, 0);
    assert_eq!(group.advance(), ["7 done m0"]);
    assert!(group.asked() == [false, false] && !group.unit(0).is_stopped());
    group.take(8, Verb::Stop, &[1]);
    assert!(!group.commands.changes_lifecycle(1));
}

#[test]
fn a_life_cycle_that_cannot_change_is_refused() {
    let mut group = Group::managed(Active, 3);
    group.benches[0].report(LifecycleState::Finalized, 2, None);
    group.unit(1).ask_to_stop();
    group.end(2);
    group.take(7, ACTIVATE, &[0, 1, 2]);
    let reasons = "failed m0: is finalized; restart it failed m1: does not run; start it failed m2: does not run; start it";
    assert_eq!(group.advance(), [format!("7 {reasons}")]);
}

#[test]
fn a_late_life_cycle_command_gives_its_goals_up() {
    let mut group = Group::managed(Inactive, 2);
    group.take(7, ACTIVATE, &[0, 1]);
    step(&mut group, 0);
    assert_eq!(group.late(), ["7 done m0 failed m1: is inactive"]);
    assert_eq!(group.unit(0).lifecycle_goal(), Some(Active));
    assert_eq!(group.unit(1).lifecycle_goal(), Some(Inactive));
    // Those that failed before have nothing to give up.
    let mut group = Group::managed(Inactive, 2);
    group.take(7, ACTIVATE, &[0, 1]);
    group.commands.failed(0, "no motor");
    let failed = "7 failed m0: no motor failed m1: waits for m0";
    assert_eq!(group.advance(), [failed]);
    assert_eq!(group.unit(0).lifecycle_goal(), Some(Active));
    assert_eq!(group.unit(1).lifecycle_goal(), Some(Inactive));
}

#[test]
fn only_an_activation_waits_for_the_units_that_are_needed() {
    let mut group = Group::managed(Active, 2);
    group.take(7, CLEAN_UP, &[0, 1]);
    group.commands.failed(0, "no motor");
    assert_eq!(group.advance(), [""; 0], "`m1` does not wait for `m0`");
    step(&mut group, 1);
    step(&mut group, 1);
    assert_eq!(group.advance(), ["7 done m1 failed m0: no motor"]);
}

#[test]
fn a_command_that_takes_units_over_gives_their_goals_up() {
    let mut group = Group::managed(Inactive, 2);
    group.take(1, ACTIVATE, &[0, 1]);
    group.take(2, Verb::Stop, &[0]);
    assert_eq!(group.unit(0).lifecycle_goal(), Some(Inactive));
    assert_eq!(group.unit(1).lifecycle_goal(), Some(Active));
    // One that was refused keeps its goal.
    let mut group = Group::managed(Inactive, 1);
    group.unit(0).set_lifecycle_goal(Active);
    group.unit(0).ask_to_stop();
    group.take(1, ACTIVATE, &[0]);
    group.end(0);
    group.unit(0).release();
    group.take(2, Verb::Start, &[0]);
    group.benches[0].start();
    assert_eq!(group.unit(0).lifecycle_goal(), Some(Active));
}

#[test]
fn a_start_brings_a_managed_unit_to_its_first_goal() {
    for (verb, goal) in [(Verb::Start, Active), (Verb::Restart, Inactive)] {
        let mut group = Group::managed(Inactive, 1);
        group.unit(0).hold();
        group.end(0);
        group.take(7, verb, &[0]);
        group.advance();
        assert_eq!(group.unit(0).lifecycle_goal(), Some(goal));
    }
}

#[test]
fn the_reason_of_a_late_unit_says_where_it_is() {
    let reason = |group: &mut Group| group.late().remove(0);
    let mut group = Group::new(vec![Bench::started(managed("a"))]);
    group.take(7, ACTIVATE, &[0]);
    assert_eq!(reason(&mut group), "7 failed a: is not ready yet");
    let mut group = Group::new(vec![Bench::new(component("a"))]);
    group.take(7, Verb::Start, &[0]);
    assert_eq!(reason(&mut group), "7 failed a: is not started yet");
    // It runs, and its neighbour does not let it be activated.
    let mut group = Group::managed(Inactive, 2);
    group.unit(0).set_lifecycle_goal(Active);
    group.take(7, ACTIVATE, &[1]);
    assert_eq!(reason(&mut group), "7 failed m1: waits for m0");
    let mut group = Group::new(vec![
        Bench::ready(component("a")),
        Bench::started(component("b")),
    ]);
    group.take(7, Verb::Start, &[1]);
    assert_eq!(reason(&mut group), "7 failed b: is not ready yet");
}
