//! The order of starts and ends: which units wait for which, which services come first, and which
//! units are configured first.

use crate::supervisor::unit::Unit;
use rc_deploy_network::plan::{self, Plan, reachable};
use rc_deploy_network::services::Service;
use rc_management::lifecycle::LifecycleState;
use std::collections::{BTreeSet, HashMap};

/// Which units wait for which, and which are in one process. It does not change while the network
/// is up.
#[derive(Debug)]
pub(super) struct StartOrder {
    /// For each unit, the units that must be ready before it starts.
    needs: Vec<BTreeSet<usize>>,
    /// For each unit, the units of its process, also itself.
    mates: Vec<BTreeSet<usize>>,
    /// The managed units that are configured before the first one is activated.
    configured_first: BTreeSet<usize>,
}

impl StartOrder {
    pub(super) fn new(plan: &Plan, units: &[Unit]) -> Self {
        let (needs, mates) = (plan.needs(), plan.mates());
        Self {
            configured_first: configured_first(units, &needs, &mates),
            needs,
            mates,
        }
    }

    pub(super) fn needs(&self, i: usize) -> &BTreeSet<usize> {
        &self.needs[i]
    }

    pub(super) fn all_needs(&self) -> &[BTreeSet<usize>] {
        &self.needs
    }

    pub(super) fn mates(&self, i: usize) -> &BTreeSet<usize> {
        &self.mates[i]
    }

    pub(super) fn all_mates(&self) -> &[BTreeSet<usize>] {
        &self.mates
    }

    /// Whether a unit represents all units of its process.
    pub(super) fn leads(&self, i: usize) -> bool {
        self.mates[i].first() == Some(&i)
    }

    /// The units in other processes that must be ready before a unit starts.
    pub(super) fn needs_outside(&self, i: usize) -> impl Iterator<Item = usize> {
        self.needs[i].difference(&self.mates[i]).copied()
    }

    /// The units in the same process that must be ready before a unit starts.
    pub(super) fn needs_inside(&self, i: usize) -> impl Iterator<Item = usize> {
        self.needs[i].intersection(&self.mates[i]).copied()
    }

    /// The units that need a unit.
    pub(super) fn dependents(&self, i: usize) -> impl Iterator<Item = usize> {
        (0..self.needs.len()).filter(move |&k| self.needs[k].contains(&i))
    }

    /// The units whose processes no unit in another process needs that is alive.
    pub(super) fn unneeded(&self, alive: impl Iterator<Item = usize>) -> Vec<usize> {
        let needed: BTreeSet<usize> = alive.flat_map(|i| self.needs_outside(i)).collect();
        let all = 0..self.needs.len();
        all.filter(|&i| needed.is_disjoint(&self.mates[i]))
            .collect()
    }

    /// Whether it is the turn of a managed unit to be taken to `goal`. `is_up`: the network was up
    /// before.
    pub(super) fn may_go(
        &self,
        i: usize,
        goal: LifecycleState,
        units: &[Unit],
        is_up: bool,
    ) -> bool {
        let active = LifecycleState::Active;
        if goal == active {
            let all_configured = is_up || self.are_configured(units);
            let needs = self.needs(i);
            return all_configured && needs.iter().all(|&j| units[j].lets_others_work());
        }
        if units[i].lifecycle_state() != Some(active) {
            return true;
        }
        // Dependents that are to be deactivated, too, go first.
        let dependents = self.dependents(i);
        let mut waiting = dependents.filter(|&k| {
            let unit = &units[k];
            let goal = unit.lifecycle_goal();
            let goes_on = match unit.lifecycle_state() {
                Some(LifecycleState::Active) => true,
                Some(LifecycleState::Inactive) => goal == Some(LifecycleState::Unconfigured),
                Some(
                    LifecycleState::Unconfigured
                    | LifecycleState::Finalized
                    | LifecycleState::Configuring
                    | LifecycleState::CleaningUp
                    | LifecycleState::Activating
                    | LifecycleState::Deactivating
                    | LifecycleState::ShuttingDown
                    | LifecycleState::ErrorProcessing,
                )
                | None => unit.is_in_transition(),
            };
            unit.is_alive() && goes_on && goal != Some(active)
        });
        waiting.next().is_none()
    }

    /// The managed units that are configured before the first one is activated.
    pub(super) fn configured_first(&self) -> impl Iterator<Item = usize> {
        self.configured_first.iter().copied()
    }

    /// Whether all are configured that have to be before the first one is activated.
    pub(super) fn are_configured(&self, units: &[Unit]) -> bool {
        let mut first = self.configured_first.iter().map(|&i| &units[i]);
        first.all(|unit| unit.is_ready() || unit.is_gone())
    }
}

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

/// The managed units that can be configured before any other one is active: those that need no
/// unmanaged unit that needs a managed one, and start in one process with none.
fn configured_first(
    units: &[Unit],
    needs: &[BTreeSet<usize>],
    mates: &[BTreeSet<usize>],
) -> BTreeSet<usize> {
    let reach: Vec<BTreeSet<usize>> = (0..needs.len()).map(|i| reachable(needs, i)).collect();
    let waits = |j: &usize| {
        let mut outside = reach[*j].difference(&mates[*j]);
        !units[*j].is_managed() && outside.any(|&k| units[k].is_managed())
    };
    let managed = (0..units.len()).filter(|&i| units[i].is_managed());
    let first = managed.filter(|&i| {
        let mut before = reach[i].iter().flat_map(|&j| &mates[j]).chain(&mates[i]);
        !before.any(waits)
    });
    first.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_deploy_network::plan::Component;

    fn service(name: &str, users: &[&str]) -> Service {
        Service {
            address: name.to_owned(),
            types: "T".to_owned(),
            hash: 1,
            topic: false,
            depth: 0,
            keeps: false,
            users: users.iter().map(|&user| user.to_owned()).collect(),
        }
    }

    /// Components, of which each needs those that follow its name. Managed ones begin with `m`.
    fn plan(components: &[&[&str]]) -> Plan {
        let components = components.iter().map(|names| Component {
            after: names[1..].iter().map(|&name| name.to_owned()).collect(),
            managed: names[0].starts_with('m'),
            ..Component::new(names[0], "/bin/true", "/")
        });
        Plan::new("net", "net.ddsl", components)
    }

    #[test]
    fn services_come_in_the_order_of_their_first_users() {
        let plan = plan(&[&["c", "b"], &["b", "a"], &["a"], &["z"]]);
        let services = vec![
            service("of c", &["c"]),
            service("of all", &["c", "b", "a"]),
            service("of b", &["b"]),
            service("of z", &["z"]),
            service("of nobody", &["elsewhere"]),
        ];
        let ordered = in_order_of_start(services, &plan, &plan.needs());
        let names: Vec<&str> = ordered.iter().map(|service| &*service.address).collect();
        assert_eq!(names, ["of nobody", "of all", "of z", "of b", "of c"]);
    }

    #[test]
    fn a_unit_behind_an_unmanaged_one_that_waits_is_not_configured_first() {
        let first = |components: &[&[&str]]| {
            let plan = plan(components);
            let units = plan.components.iter();
            let units: Vec<Unit> = units
                .map(|c| Unit::new(c.clone(), "/nowhere".into()))
                .collect();
            let first = configured_first(&units, &plan.needs(), &plan.mates());
            Vec::from_iter(first)
        };
        assert_eq!(first(&[&["a"], &["m1"], &["m2", "m1"]]), [1, 2]);
        // `b` starts when `m1` is active, and `m2` after it.
        assert_eq!(first(&[&["m1"], &["b", "m1"], &["m2", "b"]]), [0]);
        // `b` needs no managed one.
        assert_eq!(first(&[&["b"], &["m1", "b"], &["m2", "m1"]]), [1, 2]);
    }

    #[test]
    fn the_last_dependents_end_first_and_processes_as_a_whole() {
        let mut plan = plan(&[&["a"], &["b", "a"], &["c", "b"], &["d"]]);
        let units = |plan: &Plan| -> Vec<Unit> {
            let components = plan.components.iter();
            components
                .map(|c| Unit::new(c.clone(), "/nowhere".into()))
                .collect()
        };
        let order = StartOrder::new(&plan, &units(&plan));
        assert_eq!(order.unneeded(0..4), [2, 3]);
        assert_eq!(order.unneeded([0, 1].into_iter()), [1, 2, 3]);
        assert_eq!(order.dependents(0).collect::<Vec<_>>(), [1]);
        assert!((0..4).all(|i| order.leads(i)));
        // `a` and `b` are threads of one process.
        for (at, component) in ["a", "b"].into_iter().enumerate() {
            plan.components[at].thread = Some(plan::Thread {
                process: "p".to_owned(),
                component: component.to_owned(),
            });
        }
        let order = StartOrder::new(&plan, &units(&plan));
        assert!(order.leads(0) && !order.leads(1));
        assert_eq!(order.unneeded([0, 1].into_iter()), [0, 1, 2, 3]);
        assert_eq!(order.unneeded([2].into_iter()), [2, 3]);
        assert_eq!(order.needs_inside(1).collect::<Vec<_>>(), [0]);
        assert_eq!(order.needs_outside(1).count(), 0);
    }
}
