//! The part of quality of service by which peers match.

use super::{Durability, PolicyName, Qos, Reliability};
use crate::duration;
use std::fmt;
use std::time::Duration;

/// The quality of service that an endpoint offers or requests, as far as peers are matched by it
/// (DDS 1.4, 2.2.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contract {
    /// Whether samples are sent again until they arrive.
    pub reliability: Reliability,
    /// Whether late readers receive the samples that the writer has kept.
    pub durability: Durability,
    /// The longest time between two samples; `None` for no limit.
    pub deadline: Option<Duration>,
    /// The silence after which a writer counts as dead; `None` for no limit.
    pub liveliness: Option<Duration>,
}

/// A policy of which a writer offers less than a reader requests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The policy.
    pub policy: PolicyName,
    /// The value that the writer offers, as files have it.
    pub offered: String,
    /// The value that the reader requests.
    pub requested: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (policy, offered, requested) = (self.policy, &self.offered, &self.requested);
        write!(f, "{policy}: offered {offered}, requested {requested}")
    }
}

impl From<&Qos> for Contract {
    fn from(qos: &Qos) -> Self {
        Self {
            reliability: qos.reliability,
            durability: qos.durability,
            deadline: qos.deadline,
            liveliness: qos.liveliness,
        }
    }
}

impl Contract {
    /// The policies of which this writer offers less than a reader requests.
    pub fn differences(&self, requested: &Self) -> Vec<Difference> {
        let mut found = Vec::new();
        let mut differ = |policy, offered: String, requested: String| {
            found.push(Difference {
                policy,
                offered,
                requested,
            });
        };
        let (offered, asked) = (self.reliability, requested.reliability);
        if offered < asked {
            differ(
                PolicyName::Reliability,
                offered.to_string(),
                asked.to_string(),
            );
        }
        let (offered, asked) = (self.durability, requested.durability);
        if offered < asked {
            differ(
                PolicyName::Durability,
                offered.to_string(),
                asked.to_string(),
            );
        }
        for (policy, offered, asked) in [
            (PolicyName::Deadline, self.deadline, requested.deadline),
            (
                PolicyName::Liveliness,
                self.liveliness,
                requested.liveliness,
            ),
        ] {
            let Some(asked) = asked else { continue };
            if offered.is_none_or(|offered| offered > asked) {
                let offered = offered.map_or_else(|| "none".to_owned(), duration::text_of);
                differ(policy, offered, duration::text_of(asked));
            }
        }
        found
    }

    /// Reads the text that `Display` writes.
    pub fn parse(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        let time = |word: &str| match word {
            "-" => Some(None),
            _ => Some(Some(Duration::from_nanos(word.parse().ok()?))),
        };
        Some(Self {
            reliability: match words.next()? {
                "true" => Reliability::Reliable,
                _ => Reliability::BestEffort,
            },
            durability: match words.next()? {
                "true" => Durability::TransientLocal,
                _ => Durability::Volatile,
            },
            deadline: time(words.next()?)?,
            liveliness: time(words.next()?)?,
        })
    }
}

/// The form in which endpoints of one machine tell each other.
impl fmt::Display for Contract {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time =
            |time: Option<Duration>| time.map_or("-".to_owned(), |t| t.as_nanos().to_string());
        let (deadline, liveliness) = (time(self.deadline), time(self.liveliness));
        let reliable = self.reliability == Reliability::Reliable;
        let kept = self.durability == Durability::TransientLocal;
        write!(f, "{reliable} {kept} {deadline} {liveliness}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_writer_offers_at_least_what_a_reader_requests() {
        let careless = Contract::from(&Qos::SUBSCRIBER);
        let offered = Contract {
            liveliness: Some(Duration::from_secs(2)),
            ..careless
        };
        let requested = Contract {
            reliability: Reliability::Reliable,
            deadline: Some(Duration::from_millis(100)),
            liveliness: Some(Duration::from_secs(1)),
            ..careless
        };
        let found = offered.differences(&requested);
        assert_eq!(
            found.iter().map(Difference::to_string).collect::<Vec<_>>(),
            [
                "reliability: offered best_effort, requested reliable",
                "deadline: offered none, requested 100ms",
                "liveliness: offered 2s, requested 1s",
            ]
        );
        assert!(requested.differences(&offered).is_empty());
        for contract in [offered, requested] {
            assert_eq!(Contract::parse(&contract.to_string()), Some(contract));
        }
    }
}
