//! What a supervisor follows of a chain, as plain data.

use crate::bounds::Way;
use crate::chains::{CheckedChain, Port};
use crate::model::Network;
use rc_ddsl::model::Late;
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
    /// What is done if it is late.
    #[serde(default)]
    pub late: LateAction,
    /// The message that begins it, if a component of the network sends it.
    pub source: Option<PlannedMessage>,
    /// The components that it passes; at least one.
    pub hops: Vec<PlannedHop>,
}

/// What is done if a chain is late.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LateAction {
    /// A warning.
    #[default]
    Warn,
    /// An event that is no warning.
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
    /// The message that comes in.
    pub input: PlannedMessage,
    /// The message that it sends. `None`: the chain ends here.
    pub output: Option<PlannedMessage>,
    /// Where it sends it.
    pub reacts_in: ReactsIn,
    /// The worst case: on the way, until `compute()`, and work. `None`: there is no bound.
    pub worst: Option<[Duration; 3]>,
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

impl PlannedChain {
    /// The chains of a network.
    pub(crate) fn all(network: &Network) -> Vec<Self> {
        let chains = network.chains.iter();
        chains.map(|chain| Self::of(network, chain)).collect()
    }

    fn of(network: &Network, checked: &CheckedChain) -> Self {
        let chain = &network.deployment.chains[checked.declared];
        let path = &checked.path;
        let hops = path.links.iter().enumerate().map(|(at, link)| {
            let next = path.links.get(at + 1);
            let output = next.map_or(path.sent, |next| next.from);
            let cost = checked.costs.as_ref().and_then(|costs| costs.get(at));
            let project = network.projects[link.to.instance].as_deref();
            let says = project.is_some_and(|project| project.component.reactions.is_some());
            PlannedHop {
                input: PlannedMessage::of(network, link.to),
                output: output.map(|port| PlannedMessage::of(network, port)),
                reacts_in: match link.way {
                    Way::Compute if !says => ReactsIn::Unknown,
                    Way::Compute => ReactsIn::Compute,
                    Way::Handler => ReactsIn::Handler,
                },
                worst: cost
                    .map(|cost| [cost.transport, cost.period, cost.work].map(Duration::from_nanos)),
            }
        });
        let first = path.links.first();
        let source = first.and_then(|link| link.from);
        let begins = source.or(first.map(|link| link.to));
        let ends = path.sent.or(path.links.last().map(|link| link.to));
        let name =
            |port: Option<Port>| port.map_or_else(String::new, |port| network.port_name(port));
        let component = |at: usize| network.deployment.instances[at].path.clone();
        Self {
            name: chain.path.clone(),
            from: name(begins),
            to: name(ends),
            within: chain.within,
            age: chain.age,
            late: match &chain.late {
                Late::Warn => LateAction::Warn,
                Late::Event => LateAction::Event,
                Late::Stop(at) => LateAction::Stop(component(*at)),
                Late::Emergency(at) => LateAction::Emergency(component(*at)),
                Late::Fire(at, event) => LateAction::Fire {
                    component: component(*at),
                    event: event.text.clone(),
                },
            },
            source: source.map(|port| PlannedMessage::of(network, port)),
            hops: hops.collect(),
        }
    }
}

impl PlannedMessage {
    fn of(network: &Network, port: Port) -> Self {
        let component = network.deployment.instances[port.instance].path.clone();
        let (slot, operation) = network.port_words(port).unwrap_or_default();
        Self {
            component,
            slot: slot.to_owned(),
            operation: operation.to_owned(),
        }
    }
}
