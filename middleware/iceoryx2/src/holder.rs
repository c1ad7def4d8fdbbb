//! Keeps the services of a network open. A process that is killed while it starts can leave a
//! service incomplete, but only if no other process has that service open. A deployer that holds
//! all services prevents this.

use crate::ports::{CallService, EventService, TopicService};
use crate::service::{EventPorts, calls, event, topic, transient_local_topic};
use crate::session::Session;
use crate::{names, opening, service_files};
use iceoryx2::service::port_factory::PortFactory;
use rc_middleware::{Durability, Endpoint, Environment, OpenError, qos};
use std::path::PathBuf;
use std::sync::Arc;

/// Keeps services open until it is dropped.
pub struct Holder {
    held: Vec<OpenService>,
    /// The files that describe them, which stay as long as one process has the service open.
    files: Vec<PathBuf>,
    session: Arc<Session>,
}

/// The open services of one address.
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
            files: Vec::new(),
            session: Session::open(environment)?,
        })
    }

    /// Keeps the services of a topic open. Give `endpoint` the greatest depth of all endpoints of
    /// the topic, and the durability of its publishers.
    pub fn hold_topic(&mut self, endpoint: &Endpoint) -> Result<(), OpenError> {
        let held = opening::open(&self.session, endpoint, |session, endpoint| {
            let (address, types) = (&endpoint.address, &endpoint.types);
            let depth = (endpoint.qos.depth as usize).max(1);
            let publishers = qos::publishers(depth);
            let name = names::topic(address);
            let notifier = event(session, &name, EventPorts::Topic(publishers), Some(types))?;
            let mut held = vec![OpenService::Topic(
                topic(session, &name, types, depth)?,
                notifier,
            )];
            if endpoint.qos.durability == Durability::TransientLocal {
                let late = event(
                    session,
                    &names::late_joiners(address),
                    EventPorts::LateJoiners(publishers),
                    None,
                )?;
                let kept =
                    transient_local_topic(session, &names::transient_local(address), types, depth)?;
                held.push(OpenService::TransientLocal(kept, late));
            }
            Ok(held)
        })?;
        held.iter().for_each(|held| self.note_files(held));
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
        self.note_files(&held);
        self.held.push(held);
        Ok(())
    }

    fn note_files(&mut self, held: &OpenService) {
        let hashes = match held {
            OpenService::Topic(topic, event) | OpenService::TransientLocal(topic, event) => {
                [topic.service_hash(), event.service_hash()]
            }
            OpenService::Calls(calls, event) => [calls.service_hash(), event.service_hash()],
        };
        let place = &self.session.place;
        for hash in hashes {
            let name = format!("{}{}.service", place.prefix, hash.as_str());
            let path = place.root.join("services").join(name);
            if path.exists() {
                self.files.push(path);
            }
        }
    }

    /// The files and the shared memory of the held services that somebody has removed: the system
    /// at a logout (`RemoveIPC=` of logind.conf), a cleaner of temporary files, a person. Processes
    /// that have them open go on, those that start do not find them. A clean-up may have files open
    /// for a moment that it has removed itself, so a name counts that is missing at two looks.
    pub fn missing(&self) -> Vec<PathBuf> {
        let mut missing = service_files::unlinked(&self.session.place.prefix);
        let files = self.files.iter().filter(|path| !path.exists());
        missing.extend(files.cloned());
        missing
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
