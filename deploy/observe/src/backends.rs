//! The middlewares that a tool has joined.

use crate::error::Error;
use crate::network::Topic;
use crate::reach::shares_memory;
use rc_deploy_client::place;
use rc_middleware::{
    Address, Backend, Durability, Endpoint, Environment, ExternalType, Qos, Reliability,
    RunDirectory, Settings, TypeIdentity, WakeEvent,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// The most samples that wait for a tool. Older ones give way to newer ones.
const DEPTH: u32 = 256;

/// Joins each middleware once for each set of settings.
pub(crate) struct Backends {
    network: String,
    /// Whether components count the opened ports as their peers.
    is_peer: bool,
    wake_event: WakeEvent,
    joined: Vec<(String, BTreeMap<String, String>, Box<dyn Backend>)>,
}

impl Backends {
    pub(crate) fn new(network: &str) -> Result<Self, Error> {
        let wake_event = WakeEvent::new().map_err(|error| Error::system("an event", &error))?;
        Ok(Self {
            network: network.to_owned(),
            is_peer: false,
            wake_event,
            joined: Vec::new(),
        })
    }

    /// For servers in place of components.
    pub(crate) fn of_peer(network: &str) -> Result<Self, Error> {
        Ok(Self {
            is_peer: true,
            ..Self::new(network)?
        })
    }

    /// The middleware of a topic.
    pub(crate) fn of(&mut self, topic: &Topic) -> Result<&dyn Backend, Error> {
        self.joined(&topic.middleware, &topic.settings)
    }

    /// A middleware with these settings.
    pub(crate) fn joined(
        &mut self,
        middleware: &str,
        settings: &BTreeMap<String, String>,
    ) -> Result<&dyn Backend, Error> {
        let mut wanted = settings.clone();
        // Names of the component's own node are not those of the tool.
        wanted.remove("node");
        let known = |(name, settings, _): &(String, BTreeMap<String, String>, _)| {
            *name == middleware && *settings == wanted
        };
        let at = if let Some(at) = self.joined.iter().position(known) {
            at
        } else {
            let backend = self.join(middleware, &wanted)?;
            self.joined.push((middleware.to_owned(), wanted, backend));
            self.joined.len() - 1
        };
        Ok(self.joined[at].2.as_ref())
    }

    fn join(
        &self,
        middleware: &str,
        wanted: &BTreeMap<String, String>,
    ) -> Result<Box<dyn Backend>, Error> {
        let mut settings = Settings::default();
        for (name, text) in wanted {
            let key = rc_vocabulary::key(middleware, name);
            if let Some(value) = key.and_then(|key| key.kind.parse(text).ok()) {
                settings.set(middleware, name, value);
            }
        }
        // A network without a supervisor may not have one yet.
        let directory = match place::directory(&self.network) {
            directory if directory.path().is_dir() => directory,
            _ => RunDirectory::open(&self.network)
                .map_err(|error| Error::system("the run directory", &error))?,
        };
        let environment = Environment {
            network: self.network.clone(),
            // ROS 2 hides nodes whose names begin so.
            instance: format!("_rcdeploy_{}", std::process::id()),
            directory,
            wake_event: self.wake_event.clone(),
            settings,
        };
        let linked = rc_backends::find(middleware);
        let Some((linked, observe)) = linked.and_then(|linked| Some((linked, linked.observe?)))
        else {
            let reason = format!("tools cannot join `{middleware}`");
            return Err(Error::system("join the middleware", &reason));
        };
        let join = if self.is_peer {
            linked.connect
        } else {
            observe
        };
        Ok(join(&environment)?)
    }

    /// Waits until all sent samples have arrived.
    pub(crate) fn linger(&self, limit: Duration) {
        for (.., backend) in &self.joined {
            backend.linger(limit);
        }
    }
}

/// The endpoint of a topic for a tool that receives.
pub(crate) fn receiving(topic: &Topic) -> Result<Endpoint, Error> {
    let keeps = topic.description.qos.durability == Durability::TransientLocal
        && shares_memory(&topic.middleware);
    let qos = Qos {
        reliability: Reliability::BestEffort,
        // Over a network, history would cost the publisher a repetition.
        durability: if keeps {
            Durability::TransientLocal
        } else {
            Durability::Volatile
        },
        depth: DEPTH,
        ..Qos::SUBSCRIBER
    };
    endpoint(topic, qos)
}

/// The endpoint of a topic for a tool that sends.
pub(crate) fn sending(topic: &Topic) -> Result<Endpoint, Error> {
    let described = topic.description.qos;
    let qos = Qos {
        reliability: Reliability::Reliable,
        depth: described.depth.clamp(1, DEPTH),
        lifespan: None,
        ..described
    };
    endpoint(topic, qos)
}

fn endpoint(topic: &Topic, qos: Qos) -> Result<Endpoint, Error> {
    let address = Address::parse(&topic.address);
    let address = address.map_err(|reason| Error::system("the address", &reason))?;
    let operation = &topic.operation;
    let end = topic.publishers.iter().chain(&topic.subscribers).next();
    let external = topic.description.external_type.iter();
    Ok(Endpoint {
        address,
        types: TypeIdentity {
            name: format!("{}/{}", topic.interface.name, operation.name),
            hash: operation.hash,
        },
        qos,
        external_types: external
            .map(|type_name| ExternalType {
                slot: end.map_or_else(String::new, |end| end.slot.clone()),
                operation: operation.name.clone(),
                id: operation.id,
                type_name: type_name.clone(),
            })
            .collect(),
    })
}
