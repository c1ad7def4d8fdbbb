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
/// unmanaged unit that needs a managed one.
pub(super) fn configured_first(units: &[Unit], needs: &[BTreeSet<usize>]) -> BTreeSet<usize> {
    let reach: Vec<BTreeSet<usize>> = (0..needs.len()).map(|i| reachable(needs, i)).collect();
    let waits =
        |j: &usize| !units[*j].is_managed() && reach[*j].iter().any(|&k| units[k].is_managed());
    let managed = (0..units.len()).filter(|&i| units[i].is_managed());
    managed.filter(|&i| !reach[i].iter().any(waits)).collect()
}
