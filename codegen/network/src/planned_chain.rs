//! A chain as the supervisor follows it, as plain data.

use rc_vocabulary::Stamp;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A chain that is measured while the network runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedChain {
    /// Its name, with those of groups.
    pub name: String,
    /// The message that begins it, for people.
    pub from: String,
    /// The message that ends it, for people.
    pub to: String,
    /// The most time from its beginning to its end.
    pub within: Option<Duration>,
    /// The most age of the data in an effect.
    pub age: Option<Duration>,
    /// The action if it is late.
    #[serde(default)]
    pub late: LateAction,
    /// The message that begins it, if a component of the network sends it.
    pub source: Option<PlannedMessage>,
    /// The components that it passes; at least one.
    pub hops: Vec<PlannedHop>,
}

/// The action if a chain is late.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LateAction {
    /// A warning.
    #[default]
    Warn,
    /// An event that is not a warning.
    Event,
    /// The supervisor stops this component.
    Stop(String),
    /// This component enters its emergency.
    Emergency(String),
    /// The state machine of a component gets an event.
    Fire {
        /// The component.
        component: String,
        /// The event.
        event: String,
    },
}

/// An operation of a slot of a component.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PlannedMessage {
    /// The component.
    pub component: String,
    /// The slot.
    pub slot: String,
    /// The operation.
    pub operation: String,
}

/// The way of a chain through one component.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedHop {
    /// The input.
    pub input: PlannedMessage,
    /// The message that it sends. `None`: the chain ends here.
    pub output: Option<PlannedMessage>,
    /// Where it sends it.
    pub reacts_in: ReactsIn,
    /// What programs outside of the network do on the way of the input to it.
    #[serde(default)]
    pub outside: Option<PlannedOutside>,
    /// The worst case: transport, until `compute()`, and work. `None`: there is no bound.
    pub worst: Option<[Duration; 3]>,
}

/// Programs outside of the network that send one message for another one, with the same stamp.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedOutside {
    /// The message that they receive.
    pub sent: PlannedMessage,
    /// Where the stamp of that message is, and where that of the one that they send.
    pub stamps: [Stamp; 2],
}

/// Where a component reacts to a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReactsIn {
    /// In its handler.
    Handler,
    /// In a later `compute()`.
    Compute,
    /// Its `.cdsl` does not say it.
    Unknown,
}
