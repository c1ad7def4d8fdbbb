//! Holds the services of a network open. A process that is killed while it starts can leave a service half made,
//! but only one that nobody else has open; a deployer that holds them all prevents it.

use crate::service::{Audience, Calls, Event, Topic, calls, event, kept_topic, topic};
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
    Topic(Topic, Event),
    Kept(Topic, Event),
    Calls(Calls, Event),
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
            let bell = event(session, &name, Audience::Topic, Some(types))?;
            let mut held = vec![Held::Topic(topic(session, &name, types, depth)?, bell)];
            if endpoint.qos.durability == Durability::TransientLocal {
                let late = event(session, &names::late(address), Audience::Keepers, None)?;
                let kept = kept_topic(session, &names::kept(address), types, depth)?;
                held.push(Held::Kept(kept, late));
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
            let bell = event(session, &names::server(address), Audience::Server, None)?;
            Ok(Held::Calls(
                calls(session, &names::calls(address), types)?,
                bell,
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
