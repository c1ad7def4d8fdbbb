//! Commands to components and groups of a running network: `start`, `stop`, `restart`, and those of
//! the life cycle.
//!
//! A stopped component stays stopped until `start`; its dependents continue to run. Within one
//! command, dependents stop first and start last. Unsaved parameter changes survive a `restart`; a
//! `start` begins with the configuration.

use crate::supervisor::control::ClientRequest;
use crate::supervisor::unit::Unit;
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_network::plan::reachable;
use rc_management::lifecycle::{LifecycleState, Transition};
use rc_management::supervisor::{CommandResult, FailedCommand, Verb};
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

/// The margin of a command beyond the limits of its components.
const MARGIN: Duration = Duration::from_secs(5);

/// Selects the components of `all` that `names` mean. A name is a component, or a group with
/// everything in it. The error is for people.
pub(crate) fn select(names: &[String], all: &[&str]) -> Result<BTreeSet<usize>, String> {
    let mut selected = BTreeSet::new();
    for name in names {
        let inside = |whole: &str| {
            let rest = whole.strip_prefix(name.as_str());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let found: Vec<usize> = (0..all.len()).filter(|&i| inside(all[i])).collect();
        if found.is_empty() {
            return Err(unknown(name, all));
        }
        selected.extend(found);
    }
    Ok(selected)
}

/// Names in which that of a process means its components.
pub(crate) fn with_processes(names: &[String], units: &[Unit]) -> Vec<String> {
    let mut meant = Vec::new();
    for name in names {
        let threads = units.iter().filter(|unit| {
            let thread = unit.component.thread.as_ref();
            thread.is_some_and(|thread| thread.process == *name)
        });
        let known = meant.len();
        meant.extend(threads.map(|unit| unit.name().to_owned()));
        if meant.len() == known {
            meant.push(name.clone());
        }
    }
    meant
}

/// Refuses a selection with only some threads of a process: they start and end together.
pub(crate) fn check_whole(
    selected: &BTreeSet<usize>,
    verb: Verb,
    units: &[Unit],
    mates: &[BTreeSet<usize>],
) -> Result<(), String> {
    let part = selected.iter().find(|&&i| !mates[i].is_subset(selected));
    let Some(&i) = part else {
        return Ok(());
    };
    let others = mates[i].difference(selected);
    let others: Vec<&str> = others.map(|&j| units[j].name()).collect();
    Err(format!(
        "`{}` is a thread of process `{process}`, which is started and stopped as a whole; `{} {process}` means {} as well",
        units[i].name(),
        verb.word(),
        others.join(", "),
        process = units[i].process_name(),
    ))
}

/// The message about a name that no component and no group has.
pub(crate) fn unknown(name: &str, all: &[&str]) -> String {
    let groups = all.iter().flat_map(|whole| {
        let dots = whole.match_indices('.');
        dots.map(|(at, _)| &whole[..at])
    });
    let known: BTreeSet<&str> = all.iter().copied().chain(groups).collect();
    let help = match rc_diagnostics::nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", Vec::from_iter(known).join(", ")),
    };
    format!("there is no component and no group `{name}`; {help}")
}

/// The commands in progress.
#[derive(Debug)]
pub(crate) struct Commands {
    jobs: Vec<Job>,
    /// For each unit, the units of other processes that its process needs, directly or through
    /// others.
    reach: Vec<BTreeSet<usize>>,
    /// For each unit, the units of its process.
    mates: Vec<BTreeSet<usize>>,
}

#[derive(Debug)]
struct Job {
    request: ClientRequest,
    verb: Verb,
    members: BTreeSet<usize>,
    /// The units that still have to end, and then those that have to start.
    stops: BTreeSet<usize>,
    starts: BTreeSet<usize>,
    failed: BTreeMap<usize, String>,
    deadline: Instant,
}

impl Commands {
    pub(crate) fn new(needs: &[BTreeSet<usize>], mates: &[BTreeSet<usize>]) -> Self {
        let whole = needs.iter().zip(mates).map(|(needs, mates)| needs | mates);
        let whole: Vec<BTreeSet<usize>> = whole.collect();
        let reach = |i: usize| &reachable(&whole, i) - &mates[i];
        Self {
            jobs: Vec::new(),
            reach: (0..needs.len()).map(reach).collect(),
            mates: mates.to_vec(),
        }
    }

    /// Begins a command. It takes over components that an earlier command names, too.
    pub(crate) fn take(
        &mut self,
        request: ClientRequest,
        verb: Verb,
        members: BTreeSet<usize>,
        units: &mut [Unit],
    ) {
        for job in &mut self.jobs {
            let lost: Vec<usize> = job.members.intersection(&members).copied().collect();
            for i in lost {
                job.stops.remove(&i);
                job.starts.remove(&i);
                if job.is_for_lifecycle() && !job.failed.contains_key(&i) {
                    units[i].abandon_goal();
                }
                let text = format!("`{}` was asked for meanwhile", verb.word());
                job.failed.entry(i).or_insert(text);
            }
        }
        let runs = |i: &&usize| units[**i].is_alive() && !units[**i].is_stopped();
        let (stops, starts): (BTreeSet<usize>, BTreeSet<usize>) = match verb {
            Verb::Lifecycle(_) => (BTreeSet::new(), BTreeSet::new()),
            Verb::Stop => (members.clone(), BTreeSet::new()),
            Verb::Restart => (members.clone(), members.clone()),
            // One that a `stop` has asked to end ends first.
            Verb::Start => (
                members
                    .iter()
                    .filter(|&&i| units[i].is_alive() && units[i].is_stopped())
                    .copied()
                    .collect(),
                members.iter().filter(|i| !runs(i)).copied().collect(),
            ),
        };
        let limit = |i: &usize| {
            let component = &units[*i].component;
            match verb {
                // At most two transitions.
                Verb::Lifecycle(_) => component.ready * 2,
                Verb::Start | Verb::Stop | Verb::Restart => {
                    component.stop + KILL_LIMIT + component.ready
                }
            }
        };
        let limits: Duration = members.iter().map(limit).sum();
        let mut failed = BTreeMap::new();
        let mut starts = starts;
        if verb == Verb::Start {
            // A thread that has ended starts with its process, which may run on.
            starts.retain(|&i| {
                let runs_on = self.mates[i].iter().any(|j| *j != i && runs(&j));
                if runs_on {
                    let process = units[i].process_name();
                    let text = format!("has ended, and its process runs on; restart `{process}`");
                    failed.insert(i, text);
                }
                !runs_on
            });
        }
        if let Verb::Lifecycle(transition) = verb {
            for &i in &members {
                match refusal(&units[i]) {
                    Some(reason) => drop(failed.insert(i, reason)),
                    None => {
                        if let Some(goal) = units[i].meant(transition) {
                            units[i].set_lifecycle_goal(goal);
                        }
                    }
                }
            }
        }
        self.jobs.push(Job {
            request,
            verb,
            members,
            stops,
            starts,
            failed,
            deadline: Instant::now() + limits + MARGIN,
        });
    }

    /// Notes that a unit did not get ready, or ended unexpectedly.
    pub(crate) fn failed(&mut self, i: usize, reason: &str) {
        for job in &mut self.jobs {
            if job.verb != Verb::Stop && job.stops.is_empty() && job.members.contains(&i) {
                job.failed.entry(i).or_insert_with(|| reason.to_owned());
            }
        }
    }

    /// Whether a command changes the life cycle of a unit.
    pub(crate) fn changes_lifecycle(&self, i: usize) -> bool {
        let mut jobs = self.jobs.iter().filter(|job| job.is_for_lifecycle());
        jobs.any(|job| job.members.contains(&i))
    }

    /// Whether a command of the supervisor itself is in progress for one of these units.
    pub(crate) fn has_own(&self, members: &BTreeSet<usize>) -> bool {
        let mut own = self.jobs.iter().filter(|job| job.request.is_own());
        own.any(|job| !job.members.is_disjoint(members))
    }

    /// The next deadline.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.jobs.iter().map(|job| job.deadline).min()
    }

    /// Takes the next steps. Returns the results of commands that have ended.
    pub(crate) fn advance(
        &mut self,
        units: &mut [Unit],
        needs: &[BTreeSet<usize>],
        now: Instant,
    ) -> Vec<(ClientRequest, CommandResult)> {
        let mut answers = Vec::new();
        let Self { jobs, reach, .. } = self;
        for mut job in std::mem::take(jobs) {
            job.stop(units, reach);
            if job.stops.is_empty() {
                for i in std::mem::take(&mut job.starts) {
                    if job.verb == Verb::Start {
                        units[i].forget_changes();
                        units[i].set_lifecycle_goal(LifecycleState::Active);
                    }
                    units[i].release();
                }
            }
            if job.is_done(units, needs) || now >= job.deadline {
                let late = job.late(units);
                answers.push(job.result(units, needs));
                late.into_iter().for_each(|i| units[i].abandon_goal());
            } else {
                jobs.push(job);
            }
        }
        answers
    }

    /// Ends all commands, because the network stops.
    pub(crate) fn end(&mut self, units: &[Unit]) -> Vec<(ClientRequest, CommandResult)> {
        let ends = |mut job: Job| {
            for &i in &job.members {
                let failed = job.failed.entry(i);
                failed.or_insert_with(|| "the network stops".to_owned());
            }
            job.result(units, &[])
        };
        std::mem::take(&mut self.jobs)
            .into_iter()
            .map(ends)
            .collect()
    }
}

impl Job {
    /// Asks units to end that no other unit of this command needs any more.
    fn stop(&mut self, units: &mut [Unit], reach: &[BTreeSet<usize>]) {
        let stops = self.stops.iter().copied();
        let alive: Vec<usize> = stops.filter(|&i| units[i].is_alive()).collect();
        for &i in &self.stops {
            if !alive.iter().any(|&j| reach[j].contains(&i)) {
                units[i].hold();
            }
        }
        if alive.is_empty() {
            self.stops.clear();
        }
    }

    fn is_done(&mut self, units: &mut [Unit], needs: &[BTreeSet<usize>]) -> bool {
        if !self.stops.is_empty() {
            return false;
        }
        if self.verb == Verb::Stop {
            return true;
        }
        // A unit that waits for a failed unit fails as well, also indirectly.
        loop {
            let waits_in_vain = |&&i: &&usize| {
                let activates = self.verb == Verb::Lifecycle(Transition::Activate);
                !self.failed.contains_key(&i)
                    && (units[i].is_waiting() || (activates && !units[i].is_settled()))
                    && blockers(i, units, needs).any(|j| self.failed.contains_key(&j))
            };
            let Some(&i) = self.members.iter().find(waits_in_vain) else {
                break;
            };
            self.failed.insert(i, account(i, units, needs));
            units[i].abandon_goal();
        }
        let settled = |i: &usize| units[*i].is_settled() || self.failed.contains_key(i);
        self.members.iter().all(settled)
    }

    fn is_for_lifecycle(&self) -> bool {
        matches!(self.verb, Verb::Lifecycle(_))
    }

    /// The units whose state of the life cycle this command still waits for.
    fn late(&self, units: &[Unit]) -> Vec<usize> {
        if !self.is_for_lifecycle() {
            return Vec::new();
        }
        let waits = |i: &usize| !units[*i].is_settled() && !self.failed.contains_key(i);
        self.members.iter().copied().filter(waits).collect()
    }

    fn result(
        mut self,
        units: &[Unit],
        needs: &[BTreeSet<usize>],
    ) -> (ClientRequest, CommandResult) {
        let mut result = CommandResult::default();
        for &i in &self.members {
            let name = units[i].name().to_owned();
            let late = match self.verb {
                Verb::Stop => units[i].is_alive() || units[i].is_lost(),
                // At the deadline, some may not have ended, and the others wait for them.
                Verb::Start | Verb::Restart | Verb::Lifecycle(_) => {
                    self.starts.contains(&i) || !units[i].is_settled()
                }
            };
            let failed = self.failed.remove(&i);
            let reason = failed.or_else(|| late.then(|| account(i, units, needs)));
            match reason {
                Some(reason) => result.failed.push(FailedCommand { name, reason }),
                None => result.done.push(name),
            }
        }
        (self.request, result)
    }
}

/// Why the life cycle of a unit cannot be changed.
fn refusal(unit: &Unit) -> Option<String> {
    if !unit.is_alive() || unit.is_asked_to_stop() {
        return Some("does not run; start it".to_owned());
    }
    let finalized = unit.lifecycle_state() == Some(LifecycleState::Finalized);
    finalized.then(|| "is finalized; restart it".to_owned())
}

/// The units that a unit still waits for.
fn blockers<'a>(
    i: usize,
    units: &'a [Unit],
    needs: &'a [BTreeSet<usize>],
) -> impl Iterator<Item = usize> + 'a {
    let needed = needs.get(i).into_iter().flatten().copied();
    needed.filter(move |&j| match units[i].lifecycle_state() {
        // One that runs waits to be activated.
        Some(_) => !units[j].lets_others_work(),
        None => !units[j].lets_start(&units[i]),
    })
}

/// Why a unit has not reached its goal.
fn account(i: usize, units: &[Unit], needs: &[BTreeSet<usize>]) -> String {
    let unit = &units[i];
    let names: Vec<&str> = blockers(i, units, needs).map(|j| units[j].name()).collect();
    match unit.end_text() {
        Some(_) if unit.is_stopped() && !unit.is_lost() => {
            "is stopped; others of the command have not ended".to_owned()
        }
        Some(text) => text.to_owned(),
        None if unit.is_alive() && unit.is_asked_to_stop() => "has not ended yet".to_owned(),
        None if unit.is_alive() && unit.is_ready() && names.is_empty() => {
            let state = unit.lifecycle_state();
            state.map_or("is not ready yet".to_owned(), |state| format!("is {state}"))
        }
        None if unit.is_alive() && !(unit.is_managed() && unit.is_ready()) => {
            "is not ready yet".to_owned()
        }
        None if names.is_empty() => "is not started yet".to_owned(),
        None => format!("waits for {}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [&str; 4] = ["base.motor", "base.arm.grip", "base2", "lidar"];

    fn selected(names: &[&str]) -> Result<Vec<usize>, String> {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        select(&names, &ALL).map(Vec::from_iter)
    }

    #[test]
    fn a_group_selects_all_its_members() {
        assert_eq!(selected(&["base"]), Ok(vec![0, 1]));
        assert_eq!(selected(&["base.arm", "lidar", "lidar"]), Ok(vec![1, 3]));
    }

    #[test]
    fn an_unknown_name_is_reported_with_the_nearest_one() {
        let near = |name| selected(&["lidar", name]).unwrap_err();
        assert!(near("base.amr").ends_with("did you mean `base.arm`?"));
        assert!(near("ldar").ends_with("did you mean `lidar`?"));
        let far = near("something");
        assert!(
            far.contains("there are base, base.arm, base.arm.grip,"),
            "{far}"
        );
    }
}
