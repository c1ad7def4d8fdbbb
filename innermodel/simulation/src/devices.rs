//! Devices of a scene.

use crate::error::Error;
use crate::world::World;
use innermodel::Kind;
use innermodel::kinds::Signal;
use innermodel::slots::owner;

/// A sensor, an actuator or another device of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The id of its node.
    pub id: String,
    /// The tag of its node.
    pub tag: &'static str,
}

impl World {
    /// The sensors, bases, joints, batteries and people of the scene, in the order of the tree.
    pub fn devices(&self) -> Vec<Device> {
        let tree = self.tree();
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

    /// The nodes of some kinds by what they belong to: see [`World::owner`]. In the order of the
    /// tree.
    pub fn groups(&self, tags: &[&str]) -> Vec<(String, Vec<String>)> {
        let tree = self.tree();
        let mut groups: Vec<(String, Vec<String>)> = Vec::new();
        for node in tree
            .nodes()
            .filter(|node| tags.contains(&node.kind().tag()))
        {
            let owner = owner(&tree, node);
            match groups.iter_mut().find(|(id, _)| id == owner) {
                Some((_, nodes)) => nodes.push(node.id().to_owned()),
                None => groups.push((owner.to_owned(), vec![node.id().to_owned()])),
            }
        }
        groups
    }

    /// The owner of a node: the robot above it, else the outermost node above it.
    pub fn owner(&self, id: &str) -> Result<String, Error> {
        let tree = self.tree();
        let node = tree.node(id)?;
        Ok(owner(&tree, node).to_owned())
    }

    /// How a sensor measures.
    pub fn signal(&self, id: &str) -> Result<Signal, Error> {
        let tree = self.tree();
        let node = tree.node(id)?;
        let signal = node.kind().signal().cloned();
        signal.ok_or_else(|| Error::other_kind(id, node.kind(), "sensor"))
    }

    /// How a sensor measures from its next frame on.
    ///
    /// # Errors
    /// There is no such sensor, or a number is not finite, is negative, or is a probability above
    /// 1.
    pub fn set_signal(&mut self, id: &str, signal: Signal) -> Result<(), Error> {
        let Signal {
            rate,
            noise,
            quantum,
            dropout,
            drift,
            latency,
        } = signal;
        let numbers = [rate, noise, quantum, dropout, drift, latency];
        if numbers.iter().any(|n| !n.is_finite()) {
            return Err(Error::not_finite("a number", id));
        }
        if numbers.iter().any(|n| *n < 0.0) || dropout > 1.0 {
            return Err(Error::Signal(rc_diagnostics::foreign::clean(id)));
        }
        self.signal(id)?;
        let mut kind = self.tree().node(id)?.kind().clone();
        if let Some(known) = kind.signal_mut() {
            *known = signal;
        }
        self.edit(|edit| edit.set_kind(id, kind))
    }
}
