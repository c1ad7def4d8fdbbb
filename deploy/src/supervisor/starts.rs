//! Which components start now: those whose needs are ready, a few at a time.

use crate::supervisor::supervise::Supervisor;
use rc_deploy_network::plan::{self, Component, Plan};
use rc_deploy_network::process_name;
use rc_deploy_network::services::Service;
use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::sync::LazyLock;
use std::time::Instant;

/// How many components of a machine start at once, for each processor. More would only delay each
/// other, the supervisor, and those that run.
const STARTS_PER_PROCESSOR: usize = 4;
/// How many components of a machine start at once. Other machines count as this one.
static LIMIT: LazyLock<usize> = LazyLock::new(|| {
    STARTS_PER_PROCESSOR * std::thread::available_parallelism().map_or(1, usize::from)
});

/// Sorts services by the first wave in which a component needs them, so that the components of the
/// first wave need not wait for the services of the last one.
pub(super) fn in_order_of_start(
    mut services: Vec<Service>,
    plan: &Plan,
    needs: &[BTreeSet<usize>],
) -> Vec<Service> {
    let waves = plan::waves(needs);
    let names = plan.components.iter().map(|c| c.name.as_str());
    let ranks: HashMap<&str, (usize, usize)> = names.zip(waves.into_iter().zip(0..)).collect();
    services.sort_by_cached_key(|service| {
        let ranks = service
            .users
            .iter()
            .filter_map(|user| ranks.get(user.as_str()));
        ranks.min().copied()
    });
    services
}

/// The option that lists the followers of a source of time.
const FOLLOWERS: &str = "--followers";

/// `component` without its followers in `gone`, which are names of processes: a source of time would
/// wait for them in its first tick.
pub(super) fn without_followers<'a>(
    component: &'a Component,
    gone: &BTreeSet<String>,
) -> Cow<'a, Component> {
    let option = component.args.iter().position(|arg| arg == FOLLOWERS);
    let Some(at) = option.filter(|at| at + 1 < component.args.len()) else {
        return Cow::Borrowed(component);
    };
    let followers = component.args[at + 1].split(',');
    let here: Vec<&str> = followers.filter(|name| !gone.contains(*name)).collect();
    let here = here.join(",");
    let mut component = component.clone();
    if here.is_empty() {
        component.args.drain(at..at + 2);
    } else {
        component.args[at + 1] = here;
    }
    Cow::Owned(component)
}

impl Supervisor<'_> {
    /// The processes that have ended for good, or that a command has stopped.
    pub(super) fn gone(&self) -> BTreeSet<String> {
        let gone = self.units.iter().filter(|unit| unit.is_gone());
        gone.map(|unit| process_name(unit.name())).collect()
    }

    /// Returns whether a unit was started. Other units may wait for one that failed to start.
    pub(super) fn start_ready_units(&mut self) -> bool {
        let now = Instant::now();
        let mut any = false;
        self.next_start = None;
        // The ends of the times for which starts count, of each machine.
        let mut starting: HashMap<Option<usize>, Vec<Instant>> = HashMap::new();
        for (unit, host) in self.units.iter().zip(&self.host_of) {
            if let Some(end) = unit.starting().filter(|end| now < *end) {
                starting.entry(*host).or_default().push(end);
            }
        }
        for i in 0..self.units.len() {
            let lets = |&j: &usize| self.units[j].lets_others_start();
            let may = self.needs[i].iter().all(lets);
            let name = self.units[i].name();
            let due = self.units[i].is_due() && !self.sweeps.hold_back(name);
            let held = self.host_of[i].is_some() || self.custody.lets_start(name);
            if self.ending.is_some() || !(may && due && held && self.has_host(i)) {
                continue;
            }
            let beside = starting.entry(self.host_of[i]).or_default();
            if beside.len() >= *LIMIT {
                let next = beside.iter().copied().chain(self.next_start).min();
                self.next_start = next;
                continue;
            }
            self.start(i);
            any = true;
            beside.extend(self.units[i].starting());
        }
        any
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn a_source_of_time_does_not_expect_followers_that_have_ended() {
        let mut source: Component = serde_json::from_value(serde_json::json!({
            "name": "clock", "executable": "clock", "directory": PathBuf::from("/"),
        }))
        .expect("a component");
        let gone = BTreeSet::from(["arm.monitor".to_owned(), "b".to_owned()]);
        let mut args = |text: &str| {
            source.args = text.split(' ').map(str::to_owned).collect();
            without_followers(&source, &gone).args.join(" ")
        };
        assert_eq!(
            args("--clock source --followers a,arm.monitor,b,c --name x"),
            "--clock source --followers a,c --name x"
        );
        assert_eq!(
            args("--clock source --followers b --name x"),
            "--clock source --name x"
        );
        assert_eq!(args("--clock system"), "--clock system");
    }
}
