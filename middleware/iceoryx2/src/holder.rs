//! Keeps the services of a network open. A process that is killed while it starts can leave a
//! service incomplete, but only if no other process has that service open. A deployer that holds
//! all services prevents this.

use crate::ports::{CallService, EventService, TopicService};
use crate::service::{EventPorts, calls, event, topic, transient_local_topic};
use crate::session::Session;
use crate::{names, opening};
use rc_middleware::{Durability, Endpoint, Environment, OpenError};
use std::sync::Arc;

/// Keeps services open until it is dropped.
pub struct Holder {
    held: Vec<OpenService>,
    session: Arc<Session>,
}

/// The open services of one address.
#[expect(dead_code, reason = "held, never used")]
enum OpenService {
    Topic(TopicService, EventService),
    TransientLocal(TopicService, EventService),
    Calls(CallService, EventService),
}

impl Holder {
    /// Joins the network of `environment`.
    pub fn new(environment: &Environment) -> Result<Self, OpenError> {
        Ok(Self {
            held: Vec::new(),
            session: Session::open(environment)?,
        })
    }

    /// Keeps the services of a topic open. Give `endpoint` the greatest depth of all endpoints of
    /// the topic, and the durability of its publishers.
    pub fn hold_topic(&mut self, endpoint: &Endpoint) -> Result<(), OpenError> {
        let held = opening::open(&self.session, endpoint, |session, endpoint| {
            let (address, types) = (&endpoint.address, &endpoint.types);
            let depth = (endpoint.qos.depth as usize).max(1);
            let name = names::topic(address);
            let notifier = event(session, &name, EventPorts::Topic, Some(types))?;
            let mut held = vec![OpenService::Topic(
                topic(session, &name, types, depth)?,
                notifier,
            )];
            if endpoint.qos.durability == Durability::TransientLocal {
                let late = event(
                    session,
                    &names::late_joiners(address),
                    EventPorts::LateJoiners,
                    None,
                )?;
                let kept =
                    transient_local_topic(session, &names::transient_local(address), types, depth)?;
                held.push(OpenService::TransientLocal(kept, late));
            }
            Ok(held)
        })?;
        self.held.extend(held);
        Ok(())
    }

    /// Keeps the services of a server open.
    pub fn hold_call(&mut self, endpoint: &Endpoint) -> Result<(), OpenError> {
        let held = opening::open(&self.session, endpoint, |session, endpoint| {
            let (address, types) = (&endpoint.address, &endpoint.types);
            let notifier = event(session, &names::server(address), EventPorts::Server, None)?;
            Ok(OpenService::Calls(
                calls(session, &names::calls(address), types)?,
                notifier,
            ))
        })?;
        self.held.push(held);
        Ok(())
    }

    /// Cleans up after dead processes, at most for two seconds. Returns their number.
    pub fn clean(&self) -> usize {
        self.session.clean()
    }

    /// Cleans up after all processes that are dead now, while `goes_on` returns true. It is called
    /// between two of them with the name of the one that was removed, and without one while another
    /// process cleans up.
    pub fn clean_while(&self, goes_on: &mut dyn FnMut(Option<&str>) -> bool) {
        self.session.clean_while(goes_on);
    }
}
