//! The chains of a network: which messages they follow, and how long that takes at worst.

mod check;
mod flow;
mod freshness;
mod report;
mod search;
mod stamp;

use crate::bounds::{Cost, Way};
pub(crate) use check::check;
pub(crate) use freshness::check as check_freshness;
use rc_vocabulary::Stamp;
pub use report::{ChainReport, HopReport};
use std::time::Duration;

/// An operation of a slot of a component: where messages are sent or received.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Port {
    /// The component: an index into the instances.
    pub instance: usize,
    /// An index into its slots.
    pub slot: usize,
    /// An index into the operations of the slot.
    pub operation: usize,
}

/// A message on a chain, from one component to the next one, and how that component goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// The sender. `None` for the first message of a chain that begins at a receiver.
    pub from: Option<Port>,
    /// The receiver.
    pub to: Port,
    /// The way from the receiver to its output.
    pub way: Way,
}

/// The messages of a chain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// Each message that is received, in order. At least one.
    pub links: Vec<Link>,
    /// The last message, if the chain ends where it is sent.
    pub sent: Option<Port>,
}

/// Where the longest time of a message on its way is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TransportFrom {
    /// The chain declares it.
    Declared,
    /// `rcdeploy transport` measured it on this machine.
    Measured,
    /// Nobody knows it: [`ASSUMED_TRANSPORT`].
    Assumed,
}

/// Programs outside of the network, which send one message for another one with the same stamp.
#[derive(Clone, Debug)]
pub(crate) struct OutsideLink {
    /// The message that they receive.
    pub(crate) from: Port,
    /// The message that they send.
    pub(crate) to: Port,
    /// The longest time from sending the one to receiving the other.
    pub(crate) within: u64,
    /// Where the stamps of both are.
    pub(crate) stamps: [Stamp; 2],
}

impl OutsideLink {
    /// Whether this is a message of a chain.
    pub(crate) fn is(&self, link: &Link) -> bool {
        link.from == Some(self.from) && link.to == self.to
    }
}

/// A chain that the network has, with its worst case.
#[derive(Clone, Debug)]
pub struct CheckedChain {
    /// An index into the chains of the deployment.
    pub declared: usize,
    /// The messages.
    pub path: Path,
    /// What programs outside of the network do on its way.
    pub(crate) outside: Vec<OutsideLink>,
    /// Where the time on the way of each link is from.
    pub(crate) transports: Vec<TransportFrom>,
    /// The longest time of each link. `None`: there is no bound.
    pub costs: Option<Vec<Cost>>,
    /// The age of the oldest data in any effect. `None`: there is no bound.
    pub oldest: Option<Duration>,
    /// Components with budgets that the bound assumes, since their files name none.
    pub assumed: Vec<usize>,
    /// Components that get more work than they have time.
    overloaded: Vec<usize>,
    /// Receivers whose queues are too short, each with the messages that may wait.
    short: Vec<(Port, u64)>,
}

impl CheckedChain {
    /// The longest time from sending the first message to the last effect.
    pub fn worst(&self) -> Option<Duration> {
        let costs = self.costs.as_ref()?.iter();
        let total = costs.fold(0, |sum: u64, cost| sum.saturating_add(cost.total()));
        Some(Duration::from_nanos(total))
    }
}

/// The budget of a handler or of `compute()` whose file names none: a tenth of the period, at most
/// this.
pub const ASSUMED_BUDGET: Duration = Duration::from_millis(1);
/// The longest time of a message on its way, where a chain does not declare it and it was not measured: between hosts, within
/// a host over a middleware of networks, and over shared memory.
pub const ASSUMED_TRANSPORT: [Duration; 3] = [
    Duration::from_millis(5),
    Duration::from_millis(1),
    Duration::from_micros(200),
];

#[cfg(test)]
mod tests;
