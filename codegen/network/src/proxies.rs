//! Timeouts and routes of proxies. They depend on the connections of the whole network.

use rc_cdsl::model::{Role, Slot};
use rc_codegen::Project;
use rc_codegen::proxies::Proxies;
use rc_ddsl::model::Deployment;
use rc_ddsl::{Connection, Endpoint};
use rc_vocabulary::member;
use rc_vocabulary::qos::{Policy, Qos};
use std::rc::Rc;

/// Gives each proxy the time that its callers have: it waits for a reply as long as the longest
/// `timeout` of the slots that call it.
pub(crate) fn take_timeouts(
    deployment: &Deployment,
    connections: &[Connection],
    projects: &mut [Option<Rc<Project>>],
    proxies: &mut Proxies,
) {
    // The proxies of groups around call those inside.
    let groups = deployment.groups.iter();
    for instance in groups.filter_map(|group| Some(group.proxy.as_ref()?.instance)) {
        let Some(project) = projects[instance].clone() else {
            continue;
        };
        let slots = &project.component.slots;
        let half = slots.len() / 2;
        for slot in (0..half).filter(|slot| slots[*slot].role == Role::Implements) {
            let end = Endpoint { instance, slot };
            let callers = connections.iter().filter(|made| made.provider == end);
            let times = callers.filter_map(|made| {
                let consumer = projects[made.consumer.instance].as_deref()?;
                let slot = consumer.component.slots.get(made.consumer.slot)?;
                Some(slot.qos.over(Qos::CALL).timeout)
            });
            let Some(time) = times.max() else { continue };
            let name = &slots[half + slot].name;
            let array = member::split(name).map_or(name.as_str(), |(array, _)| array);
            let both = [projects[instance].as_mut(), proxies.get_mut(&instance)];
            for project in both.into_iter().flatten() {
                let slots = &mut Rc::make_mut(project).component.slots;
                let mut own = slots.iter_mut();
                if let Some(own) = own.find(|own| own.name == *name || own.name == array) {
                    // Other members of an array may have set one.
                    let least = Qos {
                        timeout: time,
                        ..Qos::CALL
                    };
                    let longest = own.qos.over(least).timeout.max(time);
                    own.qos.set(Policy::Timeout(longest));
                }
            }
        }
    }
}

/// The routes of a proxy: what its first slots receive goes to their opposites, and back.
pub(crate) fn routes(slots: &[Slot]) -> Vec<(String, String)> {
    let (outer, inner) = slots.split_at(slots.len() / 2);
    let pairs = outer.iter().zip(inner);
    let pairs = pairs.map(|(one, other)| match one.role {
        Role::Implements | Role::SubscribesTo => (one, other),
        Role::Requires | Role::Publishes => (other, one),
    });
    let names = |(from, to): (&Slot, &Slot)| (from.name.clone(), to.name.clone());
    pairs.map(names).collect()
}
