//! Devices of a scene.

use crate::error::Error;
use innermodel::kinds::Signal;
use innermodel::slots::owner;
use innermodel::{Kind, Snapshot};

/// A sensor, an actuator or another device of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The id of its node.
    pub id: String,
    /// The tag of its node.
    pub tag: &'static str,
}

/// The sensors, bases, joints, batteries and people of a tree, in its order.
pub(crate) fn all(tree: &Snapshot) -> Vec<Device> {
    let served = tree.nodes().filter(|node| {
        let kind = node.kind();
        kind.signal().is_some()
            || matches!(
                kind,
                Kind::Robot(_)
                    | Kind::Joint(_)
                    | Kind::Prismatic(_)
                    | Kind::Battery(_)
                    | Kind::Human(_)
            )
    });
    served
        .map(|node| Device {
            id: node.id().to_owned(),
            tag: node.kind().tag(),
        })
        .collect()
}

/// The nodes of some kinds by their owners, in the order of the tree.
pub(crate) fn groups(tree: &Snapshot, tags: &[&str]) -> Vec<(String, Vec<String>)> {
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    for node in tree
        .nodes()
        .filter(|node| tags.contains(&node.kind().tag()))
    {
        let owner = owner(tree, node);
        match groups.iter_mut().find(|(id, _)| id == owner) {
            Some((_, nodes)) => nodes.push(node.id().to_owned()),
            None => groups.push((owner.to_owned(), vec![node.id().to_owned()])),
        }
    }
    groups
}

/// How a sensor measures.
pub(crate) fn signal(tree: &Snapshot, id: &str) -> Result<Signal, Error> {
    let node = tree.node(id)?;
    let signal = node.kind().signal().cloned();
    signal.ok_or_else(|| Error::other_kind(id, node.kind(), "sensor"))
}

/// Refuses a signal with numbers that are not finite or negative, or a probability above 1.
pub(crate) fn check_signal(id: &str, signal: &Signal) -> Result<(), Error> {
    let Signal {
        rate,
        noise,
        quantum,
        dropout,
        drift,
        latency,
    } = *signal;
    let numbers = [rate, noise, quantum, dropout, drift, latency];
    if numbers.iter().any(|n| !n.is_finite()) {
        return Err(Error::not_finite("a number", id));
    }
    if numbers.iter().any(|n| *n < 0.0) || dropout > 1.0 {
        return Err(Error::Signal(rc_diagnostics::foreign::clean(id)));
    }
    Ok(())
}
