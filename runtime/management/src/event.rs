//! Events of a network.

use crate::lines;
use rc_vocabulary::foreign;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::borrow::Cow;
use std::fmt;
use std::time::SystemTime;

/// How severe an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Expected.
    Info,
    /// Worth a look; the network runs on.
    Warning,
    /// Something failed.
    Error,
}

/// One event. `docs/protocol/output.md` lists the codes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Event {
    /// The time, RFC 3339 in JSON.
    #[serde(
        serialize_with = "serialize_time",
        deserialize_with = "deserialize_time"
    )]
    pub time: SystemTime,
    /// The component; none for an event of the whole network.
    #[serde(deserialize_with = "foreign::optional")]
    pub component: Option<String>,
    /// The kind of event, in kebab case.
    #[serde(deserialize_with = "foreign::code")]
    pub code: Cow<'static, str>,
    /// The event for people, with particulars.
    #[serde(deserialize_with = "foreign::lines")]
    pub message: String,
    /// The severity.
    pub severity: Severity,
}

impl Event {
    /// An event of the network, now.
    pub fn network(severity: Severity, code: &'static str, message: impl Into<String>) -> Self {
        Self {
            time: SystemTime::now(),
            component: None,
            code: Cow::Borrowed(code),
            message: message.into(),
            severity,
        }
    }

    /// An event of a component, now.
    pub fn component(
        name: &str,
        severity: Severity,
        code: &'static str,
        message: impl Into<String>,
    ) -> Self {
        Self {
            component: Some(name.to_owned()),
            ..Self::network(severity, code, message)
        }
    }
}

impl Event {
    /// The event as one line of JSON, with its end.
    pub fn json_line(&self) -> String {
        String::from_utf8_lossy(&lines::encode(self)).into_owned()
    }
}

impl fmt::Display for Event {
    /// One line for people; the message of a failure may add lines of a log.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.severity {
            Severity::Info => {}
            Severity::Warning => f.write_str("warning: ")?,
            Severity::Error => f.write_str("error: ")?,
        }
        match &self.component {
            Some(component) => write!(f, "{component}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}

/// A time as RFC 3339 in UTC, with milliseconds. A time before 1970 or after 9999 becomes the first
/// of 1970.
pub fn time_text(time: SystemTime) -> String {
    let last = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(253_402_300_799);
    let is_valid = (SystemTime::UNIX_EPOCH..=last).contains(&time);
    let time = if is_valid {
        time
    } else {
        SystemTime::UNIX_EPOCH
    };
    humantime::format_rfc3339_millis(time).to_string()
}

fn serialize_time<S: Serializer>(time: &SystemTime, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&time_text(*time))
}

/// A time as RFC 3339 in UTC. The `T` may be a blank, and the `Z` may be missing.
pub fn parse_time(text: &str) -> Option<SystemTime> {
    humantime::parse_rfc3339_weak(text).ok()
}

fn deserialize_time<'de, D: Deserializer<'de>>(deserializer: D) -> Result<SystemTime, D::Error> {
    let text: Cow<'de, str> = Cow::deserialize(deserializer)?;
    humantime::parse_rfc3339(&text).map_err(de::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, UNIX_EPOCH};

    #[test]
    fn times_are_rfc_3339() {
        let at = |seconds, milliseconds: u32| {
            time_text(UNIX_EPOCH + Duration::new(seconds, milliseconds * 1_000_000))
        };
        assert_eq!(at(0, 0), "1970-01-01T00:00:00.000Z");
        assert_eq!(at(951_827_696, 5), "2000-02-29T12:34:56.005Z");
        assert_eq!(at(1_735_689_599, 999), "2024-12-31T23:59:59.999Z");
        assert_eq!(
            time_text(UNIX_EPOCH - Duration::from_secs(1)),
            "1970-01-01T00:00:00.000Z"
        );
        assert_eq!(at(300_000_000_000, 0), "1970-01-01T00:00:00.000Z");
    }

    #[test]
    fn an_event_is_printed_as_severity_component_message() {
        let event = Event::component("lidar", Severity::Error, "hung", "does not answer");
        assert_eq!(event.to_string(), "error: lidar: does not answer");
    }
}
