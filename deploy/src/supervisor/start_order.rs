//! What the order of starts decides before a start: which services come first, and which followers a
//! source of time expects.

use crate::supervisor::unit::Unit;
use rc_deploy_network::plan::{self, Component, Plan, reachable};
use rc_deploy_network::services::Service;
use std::borrow::Cow;
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

/// The managed units that can be configured before any other one is active: those that need no
/// unmanaged unit that needs a managed one.
pub(super) fn configured_first(units: &[Unit], needs: &[BTreeSet<usize>]) -> BTreeSet<usize> {
    let reach: Vec<BTreeSet<usize>> = (0..needs.len()).map(|i| reachable(needs, i)).collect();
    let waits =
        |j: &usize| !units[*j].is_managed() && reach[*j].iter().any(|&k| units[k].is_managed());
    let managed = (0..units.len()).filter(|&i| units[i].is_managed());
    managed.filter(|&i| !reach[i].iter().any(waits)).collect()
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
