//! The parameter services of a node, on a thread of their own.

use crate::calls::{self, Id};
use crate::config::Mapping;
use crate::endpoint_state::{EndpointState, Group, Inbox, Peer, STRANGER, is_ready};
use crate::qos;
use crate::rcl::{self, Service};
use crate::session::{self, EndpointSpec, Port, Session, signal};
use crate::wire::{Body, Sample, Writer};
use rc_middleware::parameters::ParameterService;
use rc_middleware::{OpenError, TypeIdentity};
use rc_network::{Backlog, EndpointKind, RateLimit, Role, stamp};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Most requests that wait; further ones are lost, as with a slow node of ROS.
const MOST: usize = 64;
/// How long a request waits until its client can be reached.
const HOLD: Duration = Duration::from_millis(200);
/// Pause between two looks for the client.
const LOOK: Duration = Duration::from_millis(10);

/// A request with its identity.
struct Asked {
    sample: Sample,
    id: Id,
    /// Number of bytes before the body of the sample.
    skipped: usize,
}

/// Hands requests from the thread that listens to the thread of the services.
struct Incoming {
    mapping: Mapping,
    asked: SyncSender<Asked>,
}

impl Backlog for Incoming {}

impl Inbox for Incoming {
    fn put(&self, samples: Vec<Sample>) {
        for sample in samples {
            match calls::read(self.mapping, &sample, None) {
                Ok((id, skipped)) => {
                    let asked = Asked {
                        sample,
                        id,
                        skipped,
                    };
                    if self.asked.try_send(asked).is_err() {
                        tracing::debug!("a request for parameters found no place");
                    }
                }
                Err(reason) => self.unreadable(reason),
            }
        }
    }

    fn unreadable(&self, reason: String) {
        tracing::debug!("a request for parameters cannot be read: {reason}");
    }
}

/// The services of a node. Dropping it closes them.
pub(crate) struct Services {
    ports: Vec<Port>,
    thread: Option<JoinHandle<()>>,
}

/// The writer of the replies of a service.
struct Replies {
    service: Service,
    state: Arc<EndpointState>,
    writer: Arc<Writer>,
}

impl Services {
    pub(crate) fn open(
        session: &Rc<Session>,
        parameters: Arc<dyn ParameterService>,
    ) -> Result<Self, OpenError> {
        let mapping = session.config.mapping;
        let node = session.config.node.fully_qualified_name();
        let signal = signal(&node)?;
        let (asked, requests) = sync_channel(MOST);
        let incoming = Arc::new(Incoming { mapping, asked });
        let group = Group::default();
        let mut ports = Vec::new();
        for (place, (_, name, type_name)) in Service::ALL.iter().enumerate() {
            let address = format!("{node}/{name}");
            let types = TypeIdentity {
                name: format!("rcl_interfaces/srv/{type_name}"),
                hash: STRANGER,
            };
            let topic = |kind: &str, part: &str, ending: &str| {
                (
                    format!("{kind}{address}{ending}"),
                    format!("rcl_interfaces::srv::dds_::{type_name}_{part}_"),
                )
            };
            let spec = |topic, kind| EndpointSpec {
                address: &address,
                topic,
                role: Role::Server,
                types: &types,
                kind,
                qos: qos::call(),
                signal: signal.clone(),
                is_watched: true,
                inbox: Arc::clone(&incoming) as _,
                group: (Arc::clone(&group), place),
            };
            let replies = spec(topic("rr", "Response", "Reply"), EndpointKind::Writer);
            let replies = EndpointSpec {
                inbox: Arc::new(()),
                ..replies
            };
            let requests = spec(topic("rq", "Request", "Request"), EndpointKind::Reader);
            ports.extend(session.ports(vec![replies, requests])?);
        }
        let writers = ports.iter().filter_map(|port| {
            let writer = port.writer()?;
            Some((Arc::clone(&port.state), Arc::clone(writer)))
        });
        let replies = Service::ALL.iter().zip(writers);
        let replies: Vec<Replies> = replies
            .map(|((service, ..), (state, writer))| Replies {
                service: *service,
                state,
                writer,
            })
            .collect();
        let thread = std::thread::Builder::new()
            .name("rc-ros2-param".to_owned())
            .spawn(move || run(&requests, &replies, mapping, &*parameters))
            .map_err(|error| OpenError::Backend {
                address: node,
                reason: format!("a thread cannot be started: {error}"),
            })?;
        Ok(Self {
            ports,
            thread: Some(thread),
        })
    }
}

impl Drop for Services {
    fn drop(&mut self) {
        // Without readers no request arrives, which ends the thread.
        self.ports.clear();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(
    requests: &Receiver<Asked>,
    replies: &[Replies],
    mapping: Mapping,
    parameters: &dyn ParameterService,
) {
    let rate_limit = RateLimit::default();
    for asked in requests {
        let Some(to) = replies.get(asked.sample.place) else {
            continue;
        };
        let body = asked.sample.taken.body().unwrap_or_default();
        let body = body.get(asked.skipped..).unwrap_or_default();
        let told = rcl::answer(to.service, body, parameters)
            .and_then(|answer| reply(to, mapping, &asked, &answer));
        if let Err(reason) = told
            && let Some(passed) = rate_limit.allow()
        {
            let (count, topic) = (passed + 1, &to.state.identity.topic);
            tracing::warn!(
                "a request about parameters has no answer on `{topic}` ({count} times): {reason}"
            );
        }
    }
}

fn reply(to: &Replies, mapping: Mapping, asked: &Asked, answer: &[u8]) -> Result<(), String> {
    if calls::is_too_large(mapping, answer.len()) {
        return Err(format!(
            "{} bytes are more than the Enhanced mapping can carry with rustdds; ask for fewer at once, or set `service_mapping = \"cyclone\"`, on both sides",
            answer.len()
        ));
    }
    let member = asked.sample.prefix();
    let ready = |peer: &Peer| peer.prefix() == member && is_ready(peer);
    let begin = Instant::now();
    while !to.state.has(ready) && begin.elapsed() < HOLD {
        to.state.search();
        to.state.wait_for_change(LOOK);
    }
    let mark = calls::mark(mapping, asked.id, true);
    let body = Body::of(&[&mark.header, answer]);
    match session::write(&to.writer, body, stamp(0), mark.related, None) {
        Ok(_) => Ok(()),
        Err(session::Unsent::Full) => Err("a client confirms nothing".to_owned()),
        Err(session::Unsent::Failed(reason)) => Err(reason),
    }
}
