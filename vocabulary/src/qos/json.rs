//! The quality of service of an endpoint as JSON, as components describe themselves to tools.
//!
//! Durations are milliseconds, and left out if there is no limit. The timeout of calls and polling
//! concern the component alone, so they are not part of it.

use super::{Policy, PolicyName, PolicyValue, Qos};
use crate::duration;
use serde::de::{Error as _, IgnoredAny};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::time::Duration;

/// The key of a policy: the word for which it is `true`, or its name and the unit.
fn key(name: PolicyName) -> String {
    let unit = if name.is_time() { "_ms" } else { "" };
    format!("{}{unit}", name.flag().unwrap_or(name.word()))
}

#[derive(Serialize)]
#[serde(untagged)]
enum Written {
    Choice(bool),
    Count(u32),
    Milliseconds(f64),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Read {
    Choice(bool),
    Count(u32),
    Number(f64),
    Other(IgnoredAny),
}

fn write(policy: Policy) -> Option<Written> {
    Some(match policy.kind() {
        PolicyValue::Word(word) => Written::Choice(policy.name().flag() == Some(word)),
        PolicyValue::Count(count) => Written::Count(count),
        PolicyValue::Limit(None) => return None,
        PolicyValue::Limit(Some(time)) | PolicyValue::Time(time) => {
            Written::Milliseconds(time.as_secs_f64() * 1e3)
        }
    })
}

/// The policy with this value. An invalid duration of another program counts as no limit.
fn read(name: PolicyName, value: &Read) -> Option<Policy> {
    let time = |ms: f64| {
        let nanoseconds = duration::from_fractional_milliseconds(ms);
        PolicyValue::Limit(nanoseconds.map(Duration::from_nanos))
    };
    let value = match *value {
        Read::Choice(choice) => name.chosen(choice)?,
        Read::Count(count) if name.is_time() => time(count.into()),
        Read::Count(count) => PolicyValue::Count(count),
        Read::Number(ms) => time(ms),
        Read::Other(_) if name.is_time() => PolicyValue::Limit(None),
        Read::Other(_) => return None,
    };
    Policy::new(name, value)
}

impl Serialize for Qos {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(PolicyName::of_topics().filter_map(|name| {
            let value = write(self.get(name))?;
            Some((key(name), value))
        }))
    }
}

impl<'de> Deserialize<'de> for Qos {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let written = BTreeMap::<String, Read>::deserialize(from)?;
        let mut qos = Self::PUBLISHER;
        for name in PolicyName::of_topics() {
            let Some(value) = written.get(&key(name)) else {
                if name.is_time() {
                    continue;
                }
                // A default would claim what the other program did not say.
                return Err(D::Error::custom(format!("missing field `{}`", key(name))));
            };
            qos.set(read(name, value).ok_or_else(|| {
                D::Error::custom(format!("`{}` has a value of another type", key(name)))
            })?);
        }
        Ok(qos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Qos, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn what_another_program_says_is_read_whole_or_not_at_all() {
        let qos = Qos {
            deadline: Some(Duration::from_millis(20)),
            ..Qos::PUBLISHER
        };
        let text = serde_json::to_string(&qos).expect("JSON");
        assert_eq!(read(&text), Ok(qos));
        // An invalid duration counts as no limit.
        let endless = text.replace(":20.0", ":null");
        assert_ne!(endless, text);
        assert_eq!(read(&endless), Ok(Qos::PUBLISHER));
        for (text, error) in [
            ("{}", "missing field `reliable`"),
            (
                r#"{"reliable":true,"transient_local":false}"#,
                "missing field `depth`",
            ),
            (
                r#"{"reliable":1,"transient_local":false,"depth":1}"#,
                "`reliable` has a value of another type",
            ),
        ] {
            let found = read(text).expect_err("an error");
            assert!(found.starts_with(error), "{found}");
        }
    }
}
