//! The connections of a component, opened in the order of its description.

use crate::component::{Description, Role, Slot};
use rc_middleware::typed::{Caller, Topic};
use rc_middleware::{
    Address, Backend, Endpoint, Environment, Foreign, OpenError, Server, Subscriber, TypeIdentity,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// The receiving ends, which the loop serves.
pub(crate) enum Receiver {
    Server(Box<dyn Server>),
    Subscriber {
        port: Box<dyn Subscriber>,
        operation: usize,
    },
}

/// Opens connections; generated code takes its sending ends from here.
pub struct Ports {
    description: &'static Description,
    backends: Vec<(&'static str, Box<dyn Backend>)>,
    addresses: Vec<Address>,
}

impl Ports {
    /// Connects to the middlewares of `description`. A slot's address is what `bindings` says, else
    /// `NETWORK/Interface`.
    pub(crate) fn new(
        description: &'static Description,
        environment: &Environment,
        bindings: &BTreeMap<String, Address>,
    ) -> Result<Self, OpenError> {
        let mut addresses = Vec::new();
        for slot in description.slots {
            let address = match bindings.get(slot.name) {
                Some(bound) => bound.clone(),
                None => default_address(&environment.network, slot)?,
            };
            addresses.push(address);
        }
        let mut backends = Vec::new();
        for (name, connect) in description.backends {
            backends.push((*name, connect(environment)?));
        }
        Ok(Self {
            description,
            backends,
            addresses,
        })
    }

    /// The sending end of one operation of a published slot.
    pub fn topic(&self, slot: usize, operation: usize) -> Result<Topic, OpenError> {
        let port = self
            .backend(slot)?
            .publisher(&self.topic_endpoint(slot, operation))?;
        Ok(Topic::new(
            port,
            self.description.slots[slot].operations[operation],
        ))
    }

    /// The calling end of a required slot.
    pub fn caller(&self, slot: usize) -> Result<Caller, OpenError> {
        let port = self.backend(slot)?.client(&self.call_endpoint(slot))?;
        Ok(Caller::new(port, self.description.slots[slot].qos.timeout))
    }

    /// The receiving ends of all slots, each with the number of its slot.
    pub(crate) fn receivers(&self) -> Result<Vec<(usize, Receiver)>, OpenError> {
        let mut receivers = Vec::new();
        for (at, slot) in self.description.slots.iter().enumerate() {
            match slot.role {
                Role::Implements => {
                    let port = self.backend(at)?.server(&self.call_endpoint(at))?;
                    receivers.push((at, Receiver::Server(port)));
                }
                Role::SubscribesTo => {
                    for operation in 0..slot.operations.len() {
                        let port = self
                            .backend(at)?
                            .subscriber(&self.topic_endpoint(at, operation))?;
                        receivers.push((at, Receiver::Subscriber { port, operation }));
                    }
                }
                Role::Requires | Role::Publishes => {}
            }
        }
        Ok(receivers)
    }

    /// The address of every slot.
    pub(crate) fn addresses(&self) -> &[Address] {
        &self.addresses
    }

    /// What was found since the last look and does not fit to these connections.
    pub(crate) fn mismatches(&self) -> Vec<String> {
        let all = self.backends.iter().map(|(_, backend)| backend);
        all.flat_map(|backend| backend.mismatches()).collect()
    }

    /// Lets what was sent arrive.
    pub(crate) fn linger(&self, limit: Duration) {
        for (_, backend) in &self.backends {
            backend.linger(limit);
        }
    }

    fn backend(&self, slot: usize) -> Result<&dyn Backend, OpenError> {
        let wanted = self.description.slots[slot].backend;
        let found = self.backends.iter().find(|(name, _)| *name == wanted);
        found
            .map(|(_, backend)| backend.as_ref())
            .ok_or_else(|| OpenError::Backend {
                address: self.addresses[slot].to_string(),
                reason: format!("this component was generated without {wanted}; generate it anew"),
            })
    }

    fn call_endpoint(&self, slot: usize) -> Endpoint {
        let Slot {
            type_name,
            type_hash,
            qos,
            ..
        } = &self.description.slots[slot];
        let types = TypeIdentity {
            name: (*type_name).to_owned(),
            hash: *type_hash,
        };
        Endpoint {
            address: self.addresses[slot].clone(),
            types,
            qos: *qos,
            foreign: self.description.slots[slot].foreign().collect(),
        }
    }

    fn topic_endpoint(&self, slot: usize, operation: usize) -> Endpoint {
        let Slot {
            type_name,
            operations,
            qos,
            ..
        } = &self.description.slots[slot];
        let foreign = self.description.slots[slot].foreign().nth(operation);
        let operation = &operations[operation];
        let types = TypeIdentity {
            name: format!("{type_name}/{}", operation.name),
            hash: operation.type_hash,
        };
        Endpoint {
            address: self.addresses[slot].join(operation.name),
            types,
            qos: *qos,
            foreign: foreign.into_iter().collect(),
        }
    }
}

impl Slot {
    /// Its operations as a middleware with types of its own knows them.
    fn foreign(&self) -> impl Iterator<Item = Foreign> {
        let operations = self.operations.iter().zip(self.foreign);
        operations.map(|(operation, type_name)| Foreign {
            slot: self.name.to_owned(),
            operation: operation.name.to_owned(),
            id: operation.id,
            type_name: (*type_name).to_owned(),
        })
    }
}

/// Where a slot meets its other end when nobody binds it.
pub(crate) fn default_address(network: &str, slot: &Slot) -> Result<Address, OpenError> {
    let text = format!("{network}/{}", slot.interface);
    Address::parse(&text).map_err(|reason| OpenError::Backend {
        address: text,
        reason,
    })
}

impl Receiver {
    /// Takes the wake-ups back; `woken`: whether the descriptor was readable.
    pub(crate) fn acknowledge(&mut self, woken: bool) {
        match self {
            Self::Server(port) => port.acknowledge(woken),
            Self::Subscriber { port, .. } => port.acknowledge(woken),
        }
    }
}
