//! Holds the services of a network open. A process that is killed while it starts can leave a service half made,
//! but only one that nobody else has open; a deployer that holds them all prevents it.

use crate::service::{
    CallService, EventPorts, EventService, TopicService, calls, event, topic, transient_local_topic,
};
use crate::session::Session;
use crate::{bounded, names};
use rc_middleware::{Durability, Endpoint, Environment, OpenError};
use std::sync::Arc;

/// Holds services open for as long as it lives.
pub struct Holder {
    held: Vec<Held>,
    session: Arc<Session>,
}

/// What is held of one address.
#[expect(dead_code, reason = "held, never used")]
enum Held {
    Topic(TopicService, EventService),
    TransientLocal(TopicService, EventService),
    Calls(CallService, EventService),
}

impl Holder {
    /// A holder in the network of `environment`.
    pub fn new(environment: &Environment) -> Result<Self, OpenError> {
        Ok(Self {
            held: Vec::new(),
            session: Session::open(environment)?,
        })
    }

    /// Holds a topic. Its quality of service is to have the greatest depth of all its ends, and the durability of
    /// its publishers.
    pub fn hold_topic(&mut self, endpoint: &Endpoint) -> Result<(), OpenError> {
        let held = bounded::open(&self.session, endpoint, |session, endpoint| {
            let (address, types) = (&endpoint.address, &endpoint.types);
            let depth = (endpoint.qos.depth as usize).max(1);
            let name = names::topic(address);
            let notifier = event(session, &name, EventPorts::Topic, Some(types))?;
            let mut held = vec![Held::Topic(topic(session, &name, types, depth)?, notifier)];
            if endpoint.qos.durability == Durability::TransientLocal {
                let late = event(
                    session,
                    &names::late_joiners(address),
                    EventPorts::LateJoiners,
                    None,
                )?;
                let kept =
                    transient_local_topic(session, &names::transient_local(address), types, depth)?;
                held.push(Held::TransientLocal(kept, late));
            }
            Ok(held)
        })?;
        self.held.extend(held);
        Ok(())
    }

    /// Holds the address of a server.
    pub fn hold_call(&mut self, endpoint: &Endpoint) -> Result<(), OpenError> {
        let held = bounded::open(&self.session, endpoint, |session, endpoint| {
            let (address, types) = (&endpoint.address, &endpoint.types);
            let notifier = event(session, &names::server(address), EventPorts::Server, None)?;
            Ok(Held::Calls(
                calls(session, &names::calls(address), types)?,
                notifier,
            ))
        })?;
        self.held.push(held);
        Ok(())
    }

    /// Removes what processes that died left behind; says how many there were.
    pub fn clean(&self) -> usize {
        self.session.clean()
    }
}
