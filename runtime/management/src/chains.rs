//! The chains of a network as its supervisor measures them.

use rc_vocabulary::foreign;
use serde::{Deserialize, Serialize};

/// The answer to [`Request::Chains`](crate::supervisor::Request::Chains).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Chains {
    /// The chains, in the order of the network.
    pub chains: Vec<ChainStatus>,
}

/// A measured chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChainStatus {
    /// Its name, with those of groups.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// The message that begins it.
    #[serde(deserialize_with = "foreign::text")]
    pub from: String,
    /// The message that ends it.
    #[serde(deserialize_with = "foreign::text")]
    pub to: String,
    /// The most time that it may take, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within_ms: Option<f64>,
    /// The most age of the data in an effect, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub age_ms: Option<f64>,
    /// The components that cannot be followed at present, each with the reason.
    #[serde(default, deserialize_with = "foreign::texts")]
    pub missing: Vec<String>,
    /// The messages that have begun the chain.
    pub begun: u64,
    /// The messages that have come to its end.
    pub complete: u64,
    /// The messages that took longer than allowed.
    pub late: u64,
    /// The effects with data that were older than allowed.
    pub old: u64,
    /// The part of the messages that was followed, from 0 to 1.
    pub coverage: f64,
    /// From the beginning to the end, of the last messages; none before the first one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<Times>,
    /// The greatest age of the data in an effect, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub oldest_ms: Option<f64>,
    /// The greatest error of these times, in milliseconds: the clocks of its machines differ, and
    /// how far is estimated.
    pub uncertainty_ms: f64,
    /// The components that it passes.
    pub hops: Vec<HopStatus>,
    /// Which of `chain-late`, `chain-old` and `chain-broken` hold.
    #[serde(default, deserialize_with = "foreign::texts")]
    pub conditions: Vec<String>,
    /// The newest messages that came to the end, if the request asks for them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traces: Vec<Trace>,
}

/// A message that came to the end of a chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// When it began: microseconds since 1970, by the clock of the supervisor's machine.
    pub began_us: u64,
    /// For each component of the chain: on the way, until `compute()`, work; in milliseconds.
    pub hops: Vec<[f64; 3]>,
    /// Whether it took longer than `within` allows.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub late: bool,
}

impl Trace {
    /// How long it took, in milliseconds.
    pub fn total_ms(&self) -> f64 {
        self.hops.iter().flatten().sum()
    }
}

/// A component on a chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HopStatus {
    /// The component.
    #[serde(deserialize_with = "foreign::text")]
    pub component: String,
    /// The message that it receives: `SLOT.OPERATION`.
    #[serde(deserialize_with = "foreign::text")]
    pub receives: String,
    /// The sum of the following ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<Times>,
    /// From sending the message to the begin of its handler.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub way: Option<Times>,
    /// Until `compute()` begins; zero for a handler that reacts itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period: Option<Times>,
    /// Until the next message is sent, or the handler has run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work: Option<Times>,
    /// The worst case that the check has found, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst_case_ms: Option<f64>,
    /// The messages that were lost on the way to it.
    pub lost: u64,
    /// The messages that newer ones replaced before it used them.
    pub replaced: u64,
    /// The messages after which its handler has sent nothing.
    pub ended: u64,
    /// The messages that came after a later one of their sender.
    pub swapped: u64,
    /// How often it was started again.
    pub restarts: u64,
    /// The messages of programs outside that have a stamp of their own, younger than those of all
    /// messages that they received.
    #[serde(default)]
    pub restamped: u64,
}

/// Times in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// The median of the last messages.
    pub p50_ms: f64,
    /// The 99th percentile of the last messages.
    pub p99_ms: f64,
    /// The value of the message that took longest of all.
    pub worst_ms: f64,
}

impl Times {
    /// Median and percentile of times, with the longest one ever; none without times.
    pub fn of(times: impl Iterator<Item = f64>, worst_ms: f64) -> Option<Self> {
        let mut all: Vec<f64> = times.collect();
        let last = all.len().checked_sub(1)?;
        let mut at = |part: f64| {
            let place = (last as f64 * part).round() as usize;
            *all.select_nth_unstable_by(place, f64::total_cmp).1
        };
        Some(Self {
            p50_ms: at(0.5),
            p99_ms: at(0.99),
            worst_ms,
        })
    }
}
