//! Writers and readers of this component. Each leaves the domain when it is dropped.

use crate::endpoint_state::{EndpointState, Inbox, ReaderState, Watched, WriterState};
use crate::qos;
use crate::session::Session;
use crate::shared_entity::SharedEntity;
use crate::watcher::Forward;
use rc_ddsc::{Guid, Qos, Reader, Topic, Writer};
use rc_middleware::{OpenError, TypeIdentity, WakeEvent};
use rc_network::{EndpointInfo, EndpointKind, Identity, Role};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The sending side of a topic of DDS.
pub(crate) struct WriterPort {
    pub(crate) writer: Arc<Writer>,
    shared: Arc<WriterState>,
    pub(crate) guid: Guid,
    pub(crate) session: Rc<Session>,
}

/// The receiving side of a topic of DDS.
pub(crate) struct ReaderPort {
    reader: Arc<Reader>,
    pub(crate) shared: Arc<ReaderState>,
    session: Rc<Session>,
}

/// What an endpoint is to be.
pub(crate) struct EndpointSpec<'a> {
    /// The names of the topic and of its type in DDS.
    pub(crate) names: (String, String),
    pub(crate) role: Role,
    pub(crate) types: &'a TypeIdentity,
    pub(crate) qos: Qos<'static>,
    pub(crate) signal: WakeEvent,
}

/// The signal of the endpoints of `address`.
pub(crate) fn signal(address: &str) -> Result<WakeEvent, OpenError> {
    WakeEvent::new().map_err(|error| OpenError::Backend {
        address: address.to_owned(),
        reason: error.to_string(),
    })
}

/// Endpoints of one address that are being opened.
pub(crate) struct Opening<'a> {
    session: &'a Rc<Session>,
    opening: rc_network::Opening<'a>,
}

/// An endpoint before the library makes it.
struct Prepared {
    topic: Topic,
    identity: Identity,
    user_data: String,
    qos: Qos<'static>,
    signal: WakeEvent,
}

impl<'a> Opening<'a> {
    pub(crate) fn begin(session: &'a Rc<Session>, address: &str) -> Result<Self, OpenError> {
        let opening = session.opener.begin(address)?;
        Ok(Self { session, opening })
    }

    /// Opens a writer.
    pub(crate) fn writer(&self, spec: EndpointSpec<'_>) -> Result<WriterPort, OpenError> {
        let prepared = self.prepare(spec, EndpointKind::Writer)?;
        let shared = Arc::new(WriterState {
            state: EndpointState::new(prepared.identity, prepared.signal, Arc::new(())),
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
        self.session.add_writer(&writer);
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
    pub(crate) fn reader(
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
        if shared.state.identity.info.role == Role::Server {
            let watched: Arc<dyn Watched> = Arc::clone(&shared) as _;
            self.session.add_server(&watched);
        }
        let port = ReaderPort {
            reader,
            shared,
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
        } = spec;
        let session = self.session;
        let info: EndpointInfo = session.opener.info(role, types.clone());
        let remote = session.endpoints_at(&topic);
        self.opening.check(&topic, &info, remote)?;
        let entity = session.participant.topic(&topic, &type_name);
        let user_data = info.to_string();
        Ok(Prepared {
            topic: entity.map_err(|error| self.opening.failed(&error))?,
            identity: Identity {
                topic,
                kind,
                info,
                contract: qos::contract(&qos),
            },
            user_data,
            qos,
            signal,
        })
    }

    /// Waits until these endpoints and their peers on this machine have found each other.
    pub(crate) fn meet(self, endpoints: &[&EndpointState]) {
        self.opening.meet(endpoints, |_| ());
    }
}

impl WriterPort {
    pub(crate) fn state(&self) -> &EndpointState {
        &self.shared.state
    }
}

impl ReaderPort {
    pub(crate) fn state(&self) -> &EndpointState {
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
    use rc_settings::Value;
    use std::sync::mpsc::channel;

    #[test]
    fn blocked_threads_do_not_delay_the_end_of_a_component() {
        let network = format!("stuck-{}", std::process::id());
        let mut settings = Settings::default();
        settings.set("dds", "domain", Value::Int(16));
        settings.set("dds", "interfaces", Value::Texts(vec!["lo".to_owned()]));
        let environment = Environment {
            directory: RunDirectory::open(&network).expect("a run directory"),
            network,
            instance: "a".to_owned(),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings,
        };
        let session = Session::open(&environment).expect("the domain");
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
