//! `start`, `stop` and `restart` of components and groups while the network is up: which, in which order, and when it is done.
//!
//! What is stopped stays so until it is started; what needs it runs on. Of the components of one command, the one that
//! needs another one is stopped before it and started after it. Parameters that were changed and not saved survive a
//! `restart`; a `start` begins with the configuration.

use crate::supervisor::control::ClientRequest;
use crate::supervisor::unit::Unit;
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_network::plan::reachable;
use rc_management::supervisor::{CommandResult, FailedCommand, Verb};
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

/// What is added to the limits of the components, which come first.
const MARGIN: Duration = Duration::from_secs(5);

/// Of the components called `all`, those that `names` mean: each a component, or a group with all that is in it. The error
/// is for people.
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

fn unknown(name: &str, all: &[&str]) -> String {
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

/// The commands that are being carried out.
#[derive(Debug)]
pub(crate) struct Commands {
    jobs: Vec<Job>,
    /// Whom each unit needs, directly or through others.
    reach: Vec<BTreeSet<usize>>,
}

#[derive(Debug)]
struct Job {
    request: ClientRequest,
    verb: Verb,
    members: BTreeSet<usize>,
    /// Those that are to end first, and then those that are to start.
    stops: BTreeSet<usize>,
    starts: BTreeSet<usize>,
    failed: BTreeMap<usize, String>,
    deadline: Instant,
}

impl Commands {
    pub(crate) fn new(needs: &[BTreeSet<usize>]) -> Self {
        Self {
            jobs: Vec::new(),
            reach: (0..needs.len()).map(|i| reachable(needs, i)).collect(),
        }
    }

    /// Takes a command. The components of an earlier one that it names, too, are its own from now on.
    pub(crate) fn take(
        &mut self,
        request: ClientRequest,
        verb: Verb,
        members: BTreeSet<usize>,
        units: &[Unit],
    ) {
        for job in &mut self.jobs {
            let lost: Vec<usize> = job.members.intersection(&members).copied().collect();
            for i in lost {
                job.stops.remove(&i);
                job.starts.remove(&i);
                let text = format!("`{}` was asked for meanwhile", verb.word());
                job.failed.entry(i).or_insert(text);
            }
        }
        let runs = |i: &&usize| units[**i].is_alive() && !units[**i].is_stopped();
        let (stops, starts): (BTreeSet<usize>, BTreeSet<usize>) = match verb {
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
            component.stop + KILL_LIMIT + component.ready
        };
        let limits: Duration = members.iter().map(limit).sum();
        self.jobs.push(Job {
            request,
            verb,
            members,
            stops,
            starts,
            failed: BTreeMap::new(),
            deadline: Instant::now() + limits + MARGIN,
        });
    }

    /// A unit did not get ready, or ended in a way that was not asked for.
    pub(crate) fn failed(&mut self, i: usize, reason: &str) {
        for job in &mut self.jobs {
            if job.verb != Verb::Stop && job.stops.is_empty() && job.members.contains(&i) {
                job.failed.entry(i).or_insert_with(|| reason.to_owned());
            }
        }
    }

    /// When the passing of time next matters.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.jobs.iter().map(|job| job.deadline).min()
    }

    /// Does what is next, and gives the answers to what is done.
    pub(crate) fn advance(
        &mut self,
        units: &mut [Unit],
        needs: &[BTreeSet<usize>],
    ) -> Vec<(ClientRequest, CommandResult)> {
        let now = Instant::now();
        let mut answers = Vec::new();
        let Self { jobs, reach } = self;
        for mut job in std::mem::take(jobs) {
            job.stop(units, reach);
            if job.stops.is_empty() {
                for i in std::mem::take(&mut job.starts) {
                    if job.verb == Verb::Start {
                        units[i].forget_changes();
                    }
                    units[i].release();
                }
            }
            if job.is_done(units, needs) || now >= job.deadline {
                answers.push(job.result(units, needs));
            } else {
                jobs.push(job);
            }
        }
        answers
    }

    /// The network ends, and with it all that is not done.
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
    /// Asks those to end whom no other one needs any more that is to end.
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

    fn is_done(&mut self, units: &[Unit], needs: &[BTreeSet<usize>]) -> bool {
        if !self.stops.is_empty() {
            return false;
        }
        if self.verb == Verb::Stop {
            return true;
        }
        // Who waits for one that has failed is not waited for, nor is who waits for that one in turn.
        loop {
            let waits_in_vain = |&&i: &&usize| {
                !self.failed.contains_key(&i)
                    && units[i].is_waiting()
                    && blockers(i, units, needs).any(|j| self.failed.contains_key(&j))
            };
            let Some(&i) = self.members.iter().find(waits_in_vain) else {
                break;
            };
            self.failed.insert(i, account(i, units, needs));
        }
        let settled = |i: &usize| units[*i].is_ready() || self.failed.contains_key(i);
        self.members.iter().all(settled)
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
                Verb::Start | Verb::Restart => !units[i].is_ready(),
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

/// The units that must be ready first, and are not.
fn blockers<'a>(
    i: usize,
    units: &'a [Unit],
    needs: &'a [BTreeSet<usize>],
) -> impl Iterator<Item = usize> + 'a {
    let needed = needs.get(i).into_iter().flatten().copied();
    needed.filter(|&j| !units[j].lets_others_start())
}

/// Why a unit is not as it should be.
fn account(i: usize, units: &[Unit], needs: &[BTreeSet<usize>]) -> String {
    let unit = &units[i];
    let names: Vec<&str> = blockers(i, units, needs).map(|j| units[j].name()).collect();
    match unit.end_text() {
        Some(text) => text.to_owned(),
        None if unit.is_alive() && unit.is_asked_to_stop() => "has not ended yet".to_owned(),
        None if unit.is_alive() => "is not ready yet".to_owned(),
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
    fn a_group_means_all_that_is_in_it() {
        assert_eq!(selected(&["base"]), Ok(vec![0, 1]));
        assert_eq!(selected(&["base.arm", "lidar", "lidar"]), Ok(vec![1, 3]));
    }

    #[test]
    fn a_wrong_name_gets_the_nearest() {
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
