//! Quality of service as Rust writes it: fields of `rc_middleware::Qos`.

use super::names;
use crate::view;
use rc_vocabulary::qos::{Policy, PolicyValue};
use std::collections::BTreeSet;
use std::time::Duration;

/// A policy as a field with its value.
pub(crate) fn field(policy: Policy) -> String {
    let value = match policy.kind() {
        PolicyValue::Word(word) => format!("{}::{}", ty(policy), names::camel(word)),
        PolicyValue::Count(count) => count.to_string(),
        PolicyValue::Limit(None) => "None".to_owned(),
        PolicyValue::Limit(Some(limit)) => format!("Some({})", time(limit)),
        PolicyValue::Time(limit) => time(limit),
    };
    format!("{}: {value}", policy.name())
}

/// The enum of a policy whose value is a word. It and its variants have the words as names.
fn ty(policy: Policy) -> String {
    names::camel(policy.name().word())
}

fn time(time: Duration) -> String {
    format!("Duration::new({}, {})", time.as_secs(), time.subsec_nanos())
}

/// The types whose variants the slots of a component name, but for those of a world.
pub(crate) fn types(view: &view::Component) -> BTreeSet<String> {
    let own = view.slots.iter().filter(|slot| !slot.of_world);
    let policies = own.flat_map(|slot| slot.qos.0.iter());
    let words = policies.filter(|policy| matches!(policy.kind(), PolicyValue::Word(_)));
    words.map(ty).collect()
}
