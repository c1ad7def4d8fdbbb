//! Policies that differ from the default of a role.

use super::Qos;
use super::policy::{Policy, PolicyName, PolicyValue, Values};
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

/// The key of a policy in JSON: the word for which it is `true`, or its name and the unit.
fn key(name: PolicyName) -> String {
    let unit = if name.is_time() { "_ns" } else { "" };
    format!("{}{unit}", name.flag().unwrap_or(name.word()))
}

/// The value of a policy in JSON.
#[derive(Deserialize, Serialize)]
#[serde(untagged)]
enum Scalar {
    Choice(bool),
    Number(u64),
    Word(String),
    Nothing,
}

fn write(policy: Policy) -> Scalar {
    let time = |time: Duration| Scalar::Number(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
    match policy.kind() {
        PolicyValue::Word(word) if policy.name().flag().is_none() => Scalar::Word(word.to_owned()),
        PolicyValue::Word(word) => Scalar::Choice(policy.name().flag() == Some(word)),
        PolicyValue::Count(count) => Scalar::Number(count.into()),
        PolicyValue::Limit(limit) => limit.map_or(Scalar::Nothing, time),
        PolicyValue::Time(limit) => time(limit),
    }
}

/// The policy with this value. `None` if the value has another type.
fn read(name: PolicyName, value: &Scalar) -> Option<Policy> {
    let value = match *value {
        Scalar::Word(ref word) => {
            // Other policies with words are `true` or `false`.
            let is_word = matches!(name.values(), Values::Words(_)) && name.flag().is_none();
            return is_word
                .then(|| name.read(crate::scalar::Scalar::Text(word)))
                .flatten();
        }
        Scalar::Choice(choice) => name.chosen(choice)?,
        Scalar::Number(time) if name.is_time() => PolicyValue::Time(Duration::from_nanos(time)),
        Scalar::Number(count) => PolicyValue::Count(u32::try_from(count).ok()?),
        Scalar::Nothing => return None,
    };
    Policy::new(name, value)
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
            match written.get(&key(name)) {
                None | Some(Scalar::Nothing) => {}
                Some(value) => policies.set(read(name, value).ok_or_else(|| {
                    D::Error::custom(format!("`{}` has a value of another type", key(name)))
                })?),
            }
        }
        Ok(policies)
    }
}
