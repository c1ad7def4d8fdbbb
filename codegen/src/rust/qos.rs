//! Quality of service as Rust writes it: fields of `rc_middleware::Qos`.

use crate::view;
use rc_vocabulary::qos::{Durability, Policy, Reliability};
use std::collections::BTreeSet;
use std::time::Duration;

/// A policy as a field with its value.
pub(crate) fn field(policy: Policy) -> String {
    let value = match policy {
        Policy::Depth(depth) => depth.to_string(),
        Policy::Deadline(limit) | Policy::Lifespan(limit) | Policy::Liveliness(limit) => limit
            .map_or_else(
                || "None".to_owned(),
                |limit| format!("Some({})", time(limit)),
            ),
        Policy::Timeout(limit) | Policy::Spin(limit) => time(limit),
        Policy::Reliability(_) | Policy::Durability(_) => {
            variant(policy).map_or_else(String::new, |(ty, name)| format!("{ty}::{name}"))
        }
    };
    format!("{}: {value}", policy.name())
}

/// Type and variant of a policy whose value is a word.
fn variant(policy: Policy) -> Option<(&'static str, &'static str)> {
    Some(match policy {
        Policy::Reliability(Reliability::Reliable) => ("Reliability", "Reliable"),
        Policy::Reliability(Reliability::BestEffort) => ("Reliability", "BestEffort"),
        Policy::Durability(Durability::TransientLocal) => ("Durability", "TransientLocal"),
        Policy::Durability(Durability::Volatile) => ("Durability", "Volatile"),
        Policy::Depth(_)
        | Policy::Deadline(_)
        | Policy::Lifespan(_)
        | Policy::Liveliness(_)
        | Policy::Timeout(_)
        | Policy::Spin(_) => return None,
    })
}

fn time(time: Duration) -> String {
    format!("Duration::new({}, {})", time.as_secs(), time.subsec_nanos())
}

/// The types whose variants the slots of a component name.
pub(crate) fn types(view: &view::Component) -> BTreeSet<&'static str> {
    let policies = view.slots.iter().flat_map(|slot| slot.qos.0.iter());
    policies.filter_map(variant).map(|(ty, _)| ty).collect()
}
