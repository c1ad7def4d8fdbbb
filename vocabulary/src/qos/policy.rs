//! The policies, with their words and limits.

use super::{Durability, Reliability, Stale};
use crate::duration;
use crate::role::Role;
use crate::scalar::Scalar;
use crate::word::words;
use std::fmt;
use std::ops::RangeInclusive;
use std::time::Duration;

/// The name of a policy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PolicyName {
    /// Whether lost samples are sent again.
    Reliability,
    /// Whether late joiners get samples that were sent before.
    Durability,
    /// How many samples the history keeps.
    Depth,
    /// The longest time between two samples.
    Deadline,
    /// The time after which a sample expires.
    Lifespan,
    /// The time of silence after which a publisher counts as dead.
    Liveliness,
    /// The longest time of a call.
    Timeout,
    /// How long a waiting thread polls before it sleeps.
    Spin,
    /// The age up to which a value counts as fresh.
    Fresh,
    /// The use of a value that is not fresh.
    Stale,
    /// How long the last reply answers a query.
    Cache,
    /// How long the last value of the worker answers a query.
    Latest,
}

/// The values that a policy takes.
#[derive(Debug)]
pub enum Values {
    /// One of these words.
    Words(Vec<&'static str>),
    /// A whole number within limits.
    Count(RangeInclusive<u32>),
    /// A duration above zero, or no limit.
    Limit,
    /// A duration above zero.
    Time,
    /// A duration within limits.
    Within(RangeInclusive<Duration>),
}

/// A policy with its value. A duration of `None` means that there is no limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// Whether lost samples are sent again.
    Reliability(Reliability),
    /// Whether late joiners get samples that were sent before.
    Durability(Durability),
    /// How many samples the history keeps.
    Depth(u32),
    /// The longest time between two samples.
    Deadline(Option<Duration>),
    /// The time after which a sample expires.
    Lifespan(Option<Duration>),
    /// The time of silence after which a publisher counts as dead.
    Liveliness(Option<Duration>),
    /// The longest time of a call.
    Timeout(Duration),
    /// How long a waiting thread polls before it sleeps.
    Spin(Duration),
    /// The age up to which a value counts as fresh.
    Fresh(Option<Duration>),
    /// The use of a value that is not fresh.
    Stale(Stale),
    /// How long the last reply answers a query; never without a time.
    Cache(Option<Duration>),
    /// How long the last value of the worker answers a query; never without a time.
    Latest(Option<Duration>),
}

/// The value of a policy, by what kind of value it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolicyValue {
    /// One of the words of the policy.
    Word(&'static str),
    /// A whole number.
    Count(u32),
    /// A duration, or no limit.
    Limit(Option<Duration>),
    /// A duration.
    Time(Duration),
}

words!(PolicyName);

impl PolicyName {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 12] = [
        Self::Reliability,
        Self::Durability,
        Self::Depth,
        Self::Deadline,
        Self::Lifespan,
        Self::Liveliness,
        Self::Timeout,
        Self::Spin,
        Self::Fresh,
        Self::Stale,
        Self::Cache,
        Self::Latest,
    ];
    /// The limits of the depth, in samples.
    const DEPTH: RangeInclusive<u32> = 1..=1000;
    /// The limits of polling.
    const SPIN: RangeInclusive<Duration> = Duration::from_micros(1)..=Duration::from_millis(10);

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Reliability => "reliability",
            Self::Durability => "durability",
            Self::Depth => "depth",
            Self::Deadline => "deadline",
            Self::Lifespan => "lifespan",
            Self::Liveliness => "liveliness",
            Self::Timeout => "timeout",
            Self::Spin => "spin",
            Self::Fresh => "fresh",
            Self::Stale => "stale",
            Self::Cache => "cache",
            Self::Latest => "latest",
        }
    }

    /// Its values.
    pub fn values(self) -> Values {
        match self {
            Self::Reliability => Values::Words(Reliability::words().collect()),
            Self::Durability => Values::Words(Durability::words().collect()),
            Self::Depth => Values::Count(Self::DEPTH),
            Self::Deadline
            | Self::Lifespan
            | Self::Liveliness
            | Self::Fresh
            | Self::Cache
            | Self::Latest => Values::Limit,
            Self::Stale => Values::Words(Stale::words().collect()),
            Self::Timeout => Values::Time,
            Self::Spin => Values::Within(Self::SPIN),
        }
    }

    /// Whether an end of this role has it. A publisher never waits, and has no value of others.
    pub fn is_of(self, role: Role) -> bool {
        match self {
            Self::Timeout => !role.is_topic(),
            Self::Spin => role != Role::Publishes,
            Self::Fresh | Self::Stale => !role.is_provided(),
            Self::Cache => role == Role::Requires,
            Self::Latest => role == Role::Implements,
            Self::Reliability
            | Self::Durability
            | Self::Depth
            | Self::Deadline
            | Self::Lifespan
            | Self::Liveliness => role.is_topic(),
        }
    }

    /// Whether it says how old values may be, or what is kept.
    pub fn is_of_ages(self) -> bool {
        matches!(self, Self::Fresh | Self::Stale | Self::Cache | Self::Latest)
    }

    /// The policies of topics. Rules can set them, and peers see them.
    pub fn of_topics() -> impl Iterator<Item = Self> + Clone {
        let all = Self::ALL.into_iter();
        all.filter(|name| name.is_of(Role::Publishes))
    }

    /// Whether its values are whole numbers.
    pub fn counts(self) -> bool {
        matches!(self.values(), Values::Count(_))
    }

    /// Whether its values are durations.
    pub fn is_time(self) -> bool {
        match self.values() {
            Values::Words(_) | Values::Count(_) => false,
            Values::Limit | Values::Time | Values::Within(_) => true,
        }
    }

    /// The policy with this value, if it is allowed. An integer counts milliseconds if a duration
    /// is expected; `none` means no limit.
    pub fn read(self, scalar: Scalar<'_>) -> Option<Policy> {
        let time = || {
            let nanoseconds = match scalar {
                Scalar::Text(text) => duration::parse(text),
                Scalar::Int(milliseconds) => duration::from_milliseconds(milliseconds),
                Scalar::Duration(nanoseconds) => Some(nanoseconds),
                Scalar::Bool(_) | Scalar::Other => None,
            };
            nanoseconds.filter(|ns| *ns > 0).map(Duration::from_nanos)
        };
        let limit = || match scalar {
            Scalar::Text("none") => Some(None),
            Scalar::Int(_)
            | Scalar::Bool(_)
            | Scalar::Duration(_)
            | Scalar::Text(_)
            | Scalar::Other => time().map(Some),
        };
        let value = match self.values() {
            Values::Words(words) => {
                let Scalar::Text(text) = scalar else {
                    return None;
                };
                PolicyValue::Word(words.into_iter().find(|word| *word == text)?)
            }
            Values::Count(range) => {
                let Scalar::Int(count) = scalar else {
                    return None;
                };
                let count = u32::try_from(count).ok();
                PolicyValue::Count(count.filter(|count| range.contains(count))?)
            }
            Values::Limit => PolicyValue::Limit(limit()?),
            Values::Time => PolicyValue::Time(time()?),
            Values::Within(range) => PolicyValue::Time(time().filter(|time| range.contains(time))?),
        };
        Policy::new(self, value)
    }

    /// The word for which the policy is `true` in JSON. `None` if its values are not words.
    pub(super) fn flag(self) -> Option<&'static str> {
        match self {
            Self::Reliability => Some(Reliability::Reliable.word()),
            Self::Durability => Some(Durability::TransientLocal.word()),
            Self::Depth
            | Self::Deadline
            | Self::Lifespan
            | Self::Liveliness
            | Self::Timeout
            | Self::Spin
            | Self::Fresh
            | Self::Stale
            | Self::Cache
            | Self::Latest => None,
        }
    }

    /// The word that JSON `true` or `false` represents.
    pub(super) fn chosen(self, choice: bool) -> Option<PolicyValue> {
        let Values::Words(words) = self.values() else {
            return None;
        };
        let mut words = words.into_iter();
        let word = words.find(|word| (self.flag() == Some(word)) == choice);
        word.map(PolicyValue::Word)
    }
}

impl Policy {
    /// The policy with this value, which other programs may have chosen: limits do not matter.
    /// `None` if it has values of another kind.
    pub(super) fn new(name: PolicyName, value: PolicyValue) -> Option<Self> {
        let word = || match value {
            PolicyValue::Word(word) => Some(word),
            PolicyValue::Count(_) | PolicyValue::Limit(_) | PolicyValue::Time(_) => None,
        };
        let count = || match value {
            PolicyValue::Count(count) => Some(count),
            PolicyValue::Word(_) | PolicyValue::Limit(_) | PolicyValue::Time(_) => None,
        };
        let limit = || match value {
            PolicyValue::Limit(limit) => Some(limit),
            PolicyValue::Time(time) => Some(Some(time)),
            PolicyValue::Word(_) | PolicyValue::Count(_) => None,
        };
        let time = || limit().flatten();
        match name {
            PolicyName::Reliability => Reliability::from_word(word()?).map(Self::Reliability),
            PolicyName::Durability => Durability::from_word(word()?).map(Self::Durability),
            PolicyName::Depth => count().map(Self::Depth),
            PolicyName::Deadline => limit().map(Self::Deadline),
            PolicyName::Lifespan => limit().map(Self::Lifespan),
            PolicyName::Liveliness => limit().map(Self::Liveliness),
            PolicyName::Timeout => time().map(Self::Timeout),
            PolicyName::Spin => time().map(Self::Spin),
            PolicyName::Fresh => limit().map(Self::Fresh),
            PolicyName::Stale => Stale::from_word(word()?).map(Self::Stale),
            PolicyName::Cache => limit().map(Self::Cache),
            PolicyName::Latest => limit().map(Self::Latest),
        }
    }

    /// Its name.
    pub fn name(&self) -> PolicyName {
        match self {
            Self::Reliability(_) => PolicyName::Reliability,
            Self::Durability(_) => PolicyName::Durability,
            Self::Depth(_) => PolicyName::Depth,
            Self::Deadline(_) => PolicyName::Deadline,
            Self::Lifespan(_) => PolicyName::Lifespan,
            Self::Liveliness(_) => PolicyName::Liveliness,
            Self::Timeout(_) => PolicyName::Timeout,
            Self::Spin(_) => PolicyName::Spin,
            Self::Fresh(_) => PolicyName::Fresh,
            Self::Stale(_) => PolicyName::Stale,
            Self::Cache(_) => PolicyName::Cache,
            Self::Latest(_) => PolicyName::Latest,
        }
    }

    /// The value by its kind.
    pub fn kind(&self) -> PolicyValue {
        match self {
            Self::Reliability(value) => PolicyValue::Word(value.word()),
            Self::Durability(value) => PolicyValue::Word(value.word()),
            Self::Depth(depth) => PolicyValue::Count(*depth),
            Self::Stale(value) => PolicyValue::Word(value.word()),
            Self::Deadline(limit)
            | Self::Lifespan(limit)
            | Self::Liveliness(limit)
            | Self::Fresh(limit)
            | Self::Cache(limit)
            | Self::Latest(limit) => PolicyValue::Limit(*limit),
            Self::Timeout(time) | Self::Spin(time) => PolicyValue::Time(*time),
        }
    }

    /// Its duration, which may be without a limit. `None` if its value is not a duration.
    pub fn time(&self) -> Option<Option<Duration>> {
        match self.kind() {
            PolicyValue::Limit(limit) => Some(limit),
            PolicyValue::Time(time) => Some(Some(time)),
            PolicyValue::Word(_) | PolicyValue::Count(_) => None,
        }
    }

    /// The value, as files have it.
    pub fn value(&self) -> String {
        match self.kind() {
            PolicyValue::Word(word) => word.to_owned(),
            PolicyValue::Count(count) => count.to_string(),
            PolicyValue::Limit(limit) => limit.map_or_else(|| "none".to_owned(), duration::text_of),
            PolicyValue::Time(time) => duration::text_of(time),
        }
    }
}

/// Prints `NAME:=VALUE`.
impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:={}", self.name(), self.value())
    }
}
