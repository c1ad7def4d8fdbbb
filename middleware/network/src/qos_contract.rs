//! Quality of service that an endpoint offers or requests, and whether two endpoints match.

use rc_middleware::qos;
use std::fmt;
use std::time::Duration;

/// The policies of which a writer offers less than a reader requests, each with both values (DDS
/// 1.4, 2.2.3).
pub fn differences(offered: &QosContract, requested: &QosContract) -> Vec<String> {
    let time = |time: Option<Duration>| time.map_or("none".to_owned(), |t| format!("{t:?}"));
    let word = |yes: bool, one: &str, other: &str| if yes { one } else { other }.to_owned();
    let mut found = Vec::new();
    let mut differ = |policy: &str, offered: String, requested: String| {
        found.push(format!(
            "{policy}: offered {offered}, requested {requested}"
        ));
    };
    if requested.reliable && !offered.reliable {
        let reliability = |yes| word(yes, "reliable", "best_effort");
        differ("reliability", reliability(false), reliability(true));
    }
    if requested.transient_local && !offered.transient_local {
        let durability = |yes| word(yes, "transient_local", "volatile");
        differ("durability", durability(false), durability(true));
    }
    let longer = |offered: Option<Duration>, requested: Option<Duration>| {
        requested.is_some_and(|r| offered.is_none_or(|o| o > r))
    };
    if longer(offered.deadline, requested.deadline) {
        differ("deadline", time(offered.deadline), time(requested.deadline));
    }
    if longer(offered.liveliness, requested.liveliness) {
        let times = (time(offered.liveliness), time(requested.liveliness));
        differ("liveliness", times.0, times.1);
    }
    found
}

/// The quality of service that an endpoint offers or requests, as far as peers are matched by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QosContract {
    /// Samples are sent again until they arrive.
    pub reliable: bool,
    /// Late readers receive the samples that the writer has kept.
    pub transient_local: bool,
    /// The longest time between two samples; `None` for no limit.
    pub deadline: Option<Duration>,
    /// The silence after which a writer counts as dead; `None` for no limit.
    pub liveliness: Option<Duration>,
}

impl From<&rc_middleware::Qos> for QosContract {
    fn from(qos: &rc_middleware::Qos) -> Self {
        Self {
            reliable: qos.reliability == qos::Reliability::Reliable,
            transient_local: qos.durability == qos::Durability::TransientLocal,
            deadline: qos.deadline,
            liveliness: qos.liveliness,
        }
    }
}

impl QosContract {
    /// Reads the text that `Display` writes.
    pub fn parse(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        let time = |word: &str| match word {
            "-" => Some(None),
            _ => Some(Some(Duration::from_nanos(word.parse().ok()?))),
        };
        Some(Self {
            reliable: words.next()? == "true",
            transient_local: words.next()? == "true",
            deadline: time(words.next()?)?,
            liveliness: time(words.next()?)?,
        })
    }
}

impl fmt::Display for QosContract {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time =
            |time: Option<Duration>| time.map_or("-".to_owned(), |t| t.as_nanos().to_string());
        let (deadline, liveliness) = (time(self.deadline), time(self.liveliness));
        let (reliable, kept) = (self.reliable, self.transient_local);
        write!(f, "{reliable} {kept} {deadline} {liveliness}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_writer_offers_at_least_what_a_reader_requests() {
        let offered = QosContract {
            liveliness: Some(Duration::from_secs(2)),
            ..QosContract::default()
        };
        let requested = QosContract {
            reliable: true,
            deadline: Some(Duration::from_millis(100)),
            liveliness: Some(Duration::from_secs(1)),
            ..QosContract::default()
        };
        assert_eq!(
            differences(&offered, &requested),
            [
                "reliability: offered best_effort, requested reliable",
                "deadline: offered none, requested 100ms",
                "liveliness: offered 2s, requested 1s",
            ]
        );
        assert!(differences(&requested, &offered).is_empty());
    }
}
