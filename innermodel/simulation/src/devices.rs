//! What a scene has to serve.

use crate::base::BaseState;
use crate::battery::BatteryState;
use crate::error::Error;
use crate::imu::Track;
use crate::motor::MotorState;
use crate::planar::Planar;
use crate::schedule::Sensor;
use crate::world::World;
use innermodel::kinds::Signal;
use innermodel::slots::owner;
use innermodel::{Kind, NodeId, Vector};
use std::collections::BTreeSet;
use std::sync::Arc;

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

    /// What a node belongs to: the robot above it, else the outermost node above it.
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

    /// Makes the state of devices that are new, and drops that of devices that are gone.
    pub(crate) fn find_devices(&mut self) {
        let tree = self.tree();
        let mut there: BTreeSet<NodeId> = BTreeSet::new();
        let mut problems: Vec<String> = Vec::new();
        for node in tree.nodes() {
            let id = node.node_id();
            let kind = node.kind();
            if let Some(signal) = kind.signal() {
                let (time, tree) = (self.state.time, Arc::clone(&tree));
                // At the start, all stands.
                let speed = (self.state.steps == 0).then(Vector::zeros);
                let track = || Track::new(node.to_root(), speed);
                let track = matches!(kind, Kind::Imu(_)).then(track);
                let sensor = self.sensors.entry(id);
                let sensor = sensor.or_insert_with(|| Sensor::new(signal, time, tree, track));
                let found = sensor.check(signal, self.step);
                problems.extend(
                    found
                        .into_iter()
                        .map(|text| format!("`{}`: {text}", node.id())),
                );
                there.insert(id);
            }
            match kind {
                Kind::Robot(_) => {
                    let place = Planar::of(&node.to_root());
                    self.state.bases.entry(id).or_insert_with(|| BaseState {
                        odometer: place,
                        corrected: place,
                        ..BaseState::default()
                    });
                }
                Kind::Joint(_) | Kind::Prismatic(_) => {
                    self.state.motors.entry(id).or_insert_with(|| MotorState {
                        position: node.position().unwrap_or_default(),
                        ..MotorState::default()
                    });
                }
                Kind::Battery(battery) => {
                    let full = BatteryState {
                        level: battery.level,
                        is_connected: true,
                    };
                    self.state.batteries.entry(id).or_insert(full);
                }
                Kind::Human(_) => {
                    self.state.people.entry(id).or_default();
                }
                _ => continue,
            }
            there.insert(id);
        }
        problems.into_iter().for_each(|problem| self.tell(problem));
        self.sensors.retain(|node, _| there.contains(node));
        self.state.bases.retain(|node, _| there.contains(node));
        self.state.motors.retain(|node, _| there.contains(node));
        self.state.batteries.retain(|node, _| there.contains(node));
        self.state.people.retain(|node, _| there.contains(node));
    }
}
