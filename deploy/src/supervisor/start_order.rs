//! What the order of starts decides before a start: which services come first, and which units are
//! configured first.

use crate::supervisor::unit::Unit;
use rc_deploy_network::plan::{self, Plan, reachable};
use rc_deploy_network::services::Service;
use std::collections::{BTreeSet, HashMap};

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
pub(super) fn configured_first(
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
        Plan {
            network: "net".to_owned(),
            ddsl: "net.ddsl".into(),
            components: components.collect(),
            ring: None,
            chains: Vec::new(),
        }
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
}
