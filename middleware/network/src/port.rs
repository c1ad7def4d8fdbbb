//! Writers and readers of this component. Each leaves the domain when it is dropped.

use crate::entities::{Inbox, ReaderState, WatchedEndpoint, WriterState};
use crate::shared_entity::SharedEntity;
use crate::watcher::Forward;
use crate::{
    Backlog, EndpointInfo, EndpointKind, EndpointState, Guid, Identity, Role, Session, opener,
};
use rc_ddsc::{Qos, Reader, Topic, Writer};
use rc_middleware::qos::Contract;
use rc_middleware::{OpenError, TypeIdentity, WakeEvent};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The sending side of a topic of DDS.
pub struct WriterPort {
    /// The endpoint in the library.
    pub writer: Arc<Writer>,
    /// State shared with the threads of the library.
    pub shared: Arc<WriterState>,
    /// GUID of the endpoint.
    pub guid: Guid,
    /// The session that it belongs to.
    pub session: Rc<Session>,
}

/// The receiving side of a topic of DDS.
pub struct ReaderPort {
    reader: Arc<Reader>,
    /// State shared with the threads of the library.
    pub shared: Arc<ReaderState>,
    /// GUID of the endpoint.
    pub guid: Guid,
    session: Rc<Session>,
}

/// Names, role and quality of service of an endpoint to open.
pub struct EndpointSpec<'a> {
    /// The names of the topic and of its type in DDS.
    pub names: (String, String),
    /// Role of the endpoint in its component.
    pub role: Role,
    /// The types of the connection.
    pub types: &'a TypeIdentity,
    /// Quality of service of a topic. `None` for calls, which lose nothing: clients and servers
    /// limit how many requests wait.
    pub qos: Option<rc_middleware::Qos>,
    /// Wakes its owner.
    pub signal: WakeEvent,
    /// Labels of the middleware in its user data, see [`EndpointInfo::user_data`].
    pub labels: String,
}

/// The signal of the endpoints of `address`.
pub fn signal(address: &str) -> Result<WakeEvent, OpenError> {
    WakeEvent::new().map_err(|error| OpenError::Backend {
        address: address.to_owned(),
        reason: error.to_string(),
    })
}

/// Endpoints of one address that are being opened.
pub struct Opening<'a> {
    session: &'a Rc<Session>,
    opening: opener::Opening<'a>,
}

/// An endpoint before the library makes it.
struct Prepared {
    topic: Topic,
    type_name: String,
    identity: Identity,
    user_data: String,
    qos: Qos<'static>,
    signal: WakeEvent,
}

impl<'a> Opening<'a> {
    /// Begins to open the endpoints of `address`. Other components of this machine wait until
    /// [`Opening::meet`].
    pub fn begin(session: &'a Rc<Session>, address: &str) -> Result<Self, OpenError> {
        let opening = session.opener.begin(address)?;
        Ok(Self { session, opening })
    }

    /// Opens a writer. `backlog` may wait for its peers.
    pub fn writer(
        &self,
        spec: EndpointSpec<'_>,
        backlog: Arc<dyn Backlog>,
    ) -> Result<WriterPort, OpenError> {
        let prepared = self.prepare(spec, EndpointKind::Writer)?;
        let shared = Arc::new(WriterState {
            state: EndpointState::new(prepared.identity, prepared.signal, backlog),
            writer: SharedEntity::default(),
        });
        let qos = Qos {
            user_data: prepared.user_data.as_bytes(),
            ..prepared.qos
        };
        let listener = Forward::of_writer(&shared, self.session.messages.clone());
        let participant = &self.session.participant;
        let opened = participant.writer(&prepared.topic, &qos, Box::new(listener));
        let opened = opened.and_then(|writer| Ok((writer.guid()?, Arc::new(writer))));
        let (guid, writer) = opened.map_err(|error| {
            shared.writer.close(Duration::ZERO);
            self.opening.failed(&error)
        })?;
        shared.writer.open(&writer);
        self.session.add_writer(&shared);
        let watched: Arc<dyn WatchedEndpoint> = Arc::clone(&shared) as _;
        self.session.watch(&watched, &prepared.type_name);
        let port = WriterPort {
            writer,
            shared,
            guid,
            session: Rc::clone(self.session),
        };
        self.opening.register(&port.shared.state, &guid)?;
        Ok(port)
    }

    /// Opens a reader, which puts samples into `inbox`.
    pub fn reader(
        &self,
        spec: EndpointSpec<'_>,
        inbox: Arc<dyn Inbox>,
    ) -> Result<ReaderPort, OpenError> {
        let prepared = self.prepare(spec, EndpointKind::Reader)?;
        let backlog = Arc::clone(&inbox) as _;
        let state = EndpointState::new(prepared.identity, prepared.signal, backlog);
        let shared = Arc::new(ReaderState::new(state, inbox));
        let qos = Qos {
            user_data: prepared.user_data.as_bytes(),
            ..prepared.qos
        };
        let listener = Forward::of_reader(&shared, self.session.messages.clone());
        let participant = &self.session.participant;
        let opened = participant.reader(&prepared.topic, &qos, Box::new(listener));
        let opened = opened.and_then(|reader| Ok((reader.guid()?, Arc::new(reader))));
        let (guid, reader) = opened.map_err(|error| {
            shared.reader.close(Duration::ZERO);
            self.opening.failed(&error)
        })?;
        shared.reader.open(&reader);
        shared.receive();
        let watched: Arc<dyn WatchedEndpoint> = Arc::clone(&shared) as _;
        self.session.watch(&watched, &prepared.type_name);
        let port = ReaderPort {
            reader,
            shared,
            guid,
            session: Rc::clone(self.session),
        };
        self.opening.register(&port.shared.state, &guid)?;
        Ok(port)
    }

    /// Checks an endpoint against those that are there.
    fn prepare(&self, spec: EndpointSpec<'_>, kind: EndpointKind) -> Result<Prepared, OpenError> {
        let EndpointSpec {
            names: (topic, type_name),
            role,
            types,
            qos,
            signal,
            labels,
        } = spec;
        let qos = qos.map_or(Qos::LOSSLESS, |qos| Qos::of(&qos));
        let session = self.session;
        let info: EndpointInfo = session.opener.info(role, types.clone());
        let remote = session.endpoints_at(&topic);
        self.opening.check(&topic, &info, remote)?;
        let entity = session.participant.topic(&topic, &type_name);
        let user_data = info.user_data(&labels);
        Ok(Prepared {
            topic: entity.map_err(|error| self.opening.failed(&error))?,
            type_name,
            identity: Identity {
                topic,
                kind,
                info,
                contract: Contract::from(&qos.policies),
            },
            user_data,
            qos,
            signal,
        })
    }

    /// Waits until these endpoints and their peers on this machine have found each other.
    pub fn meet(self, endpoints: &[&EndpointState]) {
        self.opening.meet(endpoints);
    }
}

impl WriterPort {
    /// Peers, errors and readiness of the endpoint.
    pub fn state(&self) -> &EndpointState {
        &self.shared.state
    }
}

impl ReaderPort {
    /// Peers, errors and readiness of the endpoint.
    pub fn state(&self) -> &EndpointState {
        &self.shared.state
    }
}

impl Drop for WriterPort {
    fn drop(&mut self) {
        self.state().unregister();
        let topic = self.state().topic();
        close(&self.session, &self.shared.writer, &self.writer, topic);
    }
}

impl Drop for ReaderPort {
    fn drop(&mut self) {
        self.state().unregister();
        let topic = self.state().topic();
        close(&self.session, &self.shared.reader, &self.reader, topic);
    }
}

/// Closes an endpoint. Where another thread does not let go of it, the endpoint and its domain stay
/// until the process ends: deleting them would wait for that thread without limit.
fn close<E>(session: &Session, shared: &SharedEntity<E>, entity: &Arc<E>, topic: &str) {
    let (limit, begin) = (session.patience.get(), Instant::now());
    let is_closed = shared.close(limit);
    session.patience.set(limit.saturating_sub(begin.elapsed()));
    if !is_closed {
        tracing::error!(
            "an endpoint of `{topic}` stays in the domain until this process ends: a thread of Cyclone DDS does not let go of it"
        );
        session.is_stuck.set(true);
        std::mem::forget(Arc::clone(entity));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::{Environment, RunDirectory, Settings};
    use std::sync::mpsc::channel;

    #[test]
    fn blocked_threads_do_not_delay_the_end_of_a_component() {
        let network = format!("stuck-{}", std::process::id());
        let environment = Environment {
            directory: RunDirectory::open(&network).expect("a run directory"),
            network,
            instance: "a".to_owned(),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings: Settings::default(),
        };
        let lease = Duration::from_secs(1);
        let configuration = crate::Configuration::new(16, lease).interface("lo");
        let configuration = configuration.expect("an interface").text();
        let joining = crate::Joining {
            middleware: "stuck",
            domain: 16,
            configuration,
            lease,
            user_data: String::new(),
            service: |topic| topic,
        };
        let session = Session::open(&environment, &joining).expect("the domain");
        let limit = session.patience.get();
        let (entity, shared) = (Arc::new(()), SharedEntity::<()>::default());
        shared.open(&entity);
        let (entered, has_entered) = channel();
        let (leave, may_leave) = channel::<()>();
        std::thread::scope(|scope| {
            let used = &shared;
            scope.spawn(move || {
                used.with(|()| {
                    entered.send(()).expect("a test");
                    may_leave.recv().expect("a test");
                })
            });
            has_entered.recv().expect("a user");
            let begin = Instant::now();
            for _ in 0..3 {
                close(&session, &shared, &entity, "a");
            }
            assert!(session.is_stuck.get());
            let participant = Rc::downgrade(&session.participant);
            drop(session);
            assert!(begin.elapsed() < 2 * limit);
            // It is left to the end of the process.
            assert!(participant.upgrade().is_some());
            leave.send(()).expect("a user");
        });
    }
}
