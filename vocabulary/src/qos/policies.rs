//! Policies that differ from the default of a role.

use super::policy::{Policy, PolicyName};
use super::{Durability, Qos, Reliability};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::time::Duration;

/// Policies that are set, each at most once. The others have the default of the role.
///
/// As JSON they are `{"reliable": true, "transient_local": false, "depth": 5, "deadline_ns": 1}`:
/// durations in nanoseconds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Policies(BTreeMap<PolicyName, Policy>);

impl Policies {
    /// Sets a policy, also if it was set before.
    pub fn set(&mut self, policy: Policy) {
        self.0.insert(policy.name(), policy);
    }

    /// A policy, if it is set.
    pub fn get(&self, name: PolicyName) -> Option<Policy> {
        self.0.get(&name).copied()
    }

    /// All that are set, in the order of [`PolicyName::ALL`].
    pub fn iter(&self) -> impl Iterator<Item = Policy> {
        self.0.values().copied()
    }

    /// Whether none is set.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The whole quality of service, over the default of a role.
    #[must_use]
    pub fn over(&self, mut default: Qos) -> Qos {
        self.iter().for_each(|policy| default.set(policy));
        default
    }
}

impl Extend<Policy> for Policies {
    fn extend<I: IntoIterator<Item = Policy>>(&mut self, policies: I) {
        policies.into_iter().for_each(|policy| self.set(policy));
    }
}

/// The key of a policy in JSON.
fn key(name: PolicyName) -> &'static str {
    match name {
        PolicyName::Reliability => "reliable",
        PolicyName::Durability => "transient_local",
        PolicyName::Depth => "depth",
        PolicyName::Deadline => "deadline_ns",
        PolicyName::Lifespan => "lifespan_ns",
        PolicyName::Liveliness => "liveliness_ns",
        PolicyName::Timeout => "timeout_ns",
        PolicyName::Spin => "spin_ns",
    }
}

/// The value of a policy in JSON.
#[derive(Clone, Copy, Deserialize, Serialize)]
#[serde(untagged)]
enum Scalar {
    Choice(bool),
    Number(u64),
    Nothing,
}

fn write(policy: Policy) -> Scalar {
    let time = |time: Duration| Scalar::Number(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
    match policy {
        Policy::Reliability(value) => Scalar::Choice(value == Reliability::Reliable),
        Policy::Durability(value) => Scalar::Choice(value == Durability::TransientLocal),
        Policy::Depth(depth) => Scalar::Number(depth.into()),
        Policy::Deadline(limit) | Policy::Lifespan(limit) | Policy::Liveliness(limit) => {
            limit.map_or(Scalar::Nothing, time)
        }
        Policy::Timeout(limit) | Policy::Spin(limit) => time(limit),
    }
}

/// The policy with this value. `None` if the value has another type.
fn read(name: PolicyName, value: Scalar) -> Option<Policy> {
    let choice = match value {
        Scalar::Choice(choice) => Some(choice),
        Scalar::Number(_) | Scalar::Nothing => None,
    };
    let number = match value {
        Scalar::Number(number) => Some(number),
        Scalar::Choice(_) | Scalar::Nothing => None,
    };
    let time = number.map(Duration::from_nanos);
    Some(match name {
        PolicyName::Reliability => Policy::Reliability(if choice? {
            Reliability::Reliable
        } else {
            Reliability::BestEffort
        }),
        PolicyName::Durability => Policy::Durability(if choice? {
            Durability::TransientLocal
        } else {
            Durability::Volatile
        }),
        PolicyName::Depth => Policy::Depth(u32::try_from(number?).ok()?),
        PolicyName::Deadline => Policy::Deadline(Some(time?)),
        PolicyName::Lifespan => Policy::Lifespan(Some(time?)),
        PolicyName::Liveliness => Policy::Liveliness(Some(time?)),
        PolicyName::Timeout => Policy::Timeout(time?),
        PolicyName::Spin => Policy::Spin(time?),
    })
}

impl Serialize for Policies {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(
            self.iter()
                .map(|policy| (key(policy.name()), write(policy))),
        )
    }
}

impl<'de> Deserialize<'de> for Policies {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let written = BTreeMap::<String, Scalar>::deserialize(from)?;
        let mut policies = Self::default();
        for name in PolicyName::ALL {
            match written.get(key(name)) {
                None | Some(Scalar::Nothing) => {}
                Some(value) => policies.set(read(name, *value).ok_or_else(|| {
                    D::Error::custom(format!("`{}` has a value of another type", key(name)))
                })?),
            }
        }
        Ok(policies)
    }
}
