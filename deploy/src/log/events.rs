//! What happens to a network, one record each.

use serde::Serialize;
use std::fmt;
use std::time::{SystemTime, UNIX_EPOCH};

/// How much an event matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// As expected.
    Info,
    /// Worth a look; everything runs on.
    Warning,
    /// Something failed.
    Error,
}

/// One thing that happened.
///
/// ARCHITECTURE.md has a table of the codes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Event {
    /// When, in UTC.
    #[serde(serialize_with = "rfc3339")]
    pub time: SystemTime,
    /// To which component; `None` for the network as a whole.
    pub component: Option<String>,
    /// What, in kebab-case and stable.
    pub code: &'static str,
    /// The same for people, and with particulars.
    pub message: String,
    /// How much it matters.
    pub severity: Severity,
}

impl Event {
    /// An event of the network, now.
    pub fn network(severity: Severity, code: &'static str, message: impl Into<String>) -> Self {
        Self {
            time: SystemTime::now(),
            component: None,
            code,
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

    /// The event as one JSON object, with an end of line.
    pub fn json_line(&self) -> String {
        // It consists of strings, which can always be written.
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }
}

impl fmt::Display for Event {
    /// One line for people; a failure may bring lines of a log with it.
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

fn rfc3339<S: serde::Serializer>(time: &SystemTime, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&time_text(*time))
}

/// A time in UTC, as events have it.
pub(crate) fn time_text(time: SystemTime) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    utc(since.as_secs(), since.subsec_millis())
}

/// Date and time of RFC 3339. The date is computed as in Hinnant, "chrono-compatible low-level date algorithms".
fn utc(seconds: u64, milliseconds: u32) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = (month_from_march + 2) % 12 + 1;
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!(
        "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}.{milliseconds:03}Z",
        second / 3600,
        second / 60 % 60,
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        assert_eq!(utc(0, 0), "1970-01-01T00:00:00.000Z");
        assert_eq!(utc(951_827_696, 5), "2000-02-29T12:34:56.005Z");
        assert_eq!(utc(1_735_689_599, 999), "2024-12-31T23:59:59.999Z");
    }

    #[test]
    fn an_event_reads_like_a_sentence() {
        let event = Event::component("lidar", Severity::Error, "hung", "does not answer");
        assert_eq!(event.to_string(), "error: lidar: does not answer");
        let json = serde_json::to_value(&event).expect("json");
        assert_eq!(json["code"], "hung");
        assert_eq!(json["component"], "lidar");
        assert_eq!(json["severity"], "error");
    }
}
