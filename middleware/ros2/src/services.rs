//! Services of a node itself, such as those of its parameters, on a thread of their own.

use crate::calls::Request;
use crate::graph::Listed;
use crate::names;
use crate::node::Node;
use crate::server::{is_reachable, lend, send_reply};
use rc_ddsc::{Sample, Writer};
use rc_middleware::{OpenError, QueueGauge, TypeIdentity};
use rc_network::{
    Backlog, EndpointSpec, Guid, GuidPrefix, Inbox, Opening, RateLimit, ReaderPort, ReaderState,
    Role, WriterPort, WriterState, body, signal,
};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Weak};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Most requests that wait; further ones are lost, as with a slow node of ROS.
const MOST: usize = 64;
/// Largest request; they hold names and values.
const LARGEST: usize = 1 << 20;
/// Most bytes of the requests that wait.
const MOST_BYTES: u64 = 4 << 20;
/// How long a request waits until its client can be reached.
const HOLD: Duration = Duration::from_millis(200);
/// Pause between two looks for the client.
const LOOK: Duration = Duration::from_millis(10);

/// Hands requests from threads of the library to the thread of the services.
struct OfService {
    place: usize,
    gauge: QueueGauge,
    requests: SyncSender<Waiting>,
}

/// A request that waits for the thread of the services.
struct Waiting {
    place: usize,
    received: Instant,
    sample: Sample,
}

impl Backlog for OfService {}

impl Inbox for OfService {
    fn put(&self, sample: Sample, _from: Option<GuidPrefix>) {
        let size = sample.len();
        if size > LARGEST || !self.gauge.add(size) {
            tracing::debug!("a request of {size} bytes to a service of this node found no room");
            return;
        }
        let waiting = Waiting {
            place: self.place,
            received: Instant::now(),
            sample,
        };
        if self.requests.try_send(waiting).is_err() {
            self.gauge.remove(size);
            tracing::debug!("a request of {size} bytes to a service of this node found no place");
        }
    }
}

/// A service of a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeService {
    /// Name below the node.
    pub(crate) name: &'static str,
    /// Type: `rcl_interfaces/srv/GetParameters`.
    pub(crate) type_name: &'static str,
}

/// A request to a service of a node.
pub(crate) struct NodeRequest<'a> {
    /// The place of the service among those that were opened together.
    pub(crate) place: usize,
    /// The request.
    pub(crate) body: &'a [u8],
    /// When it was received.
    pub(crate) received: Instant,
    /// Whether its client has left.
    pub(crate) is_orphan: bool,
}

/// Returns the body of the reply to a request. After an error, there is no reply.
pub(crate) type Answer = Box<dyn Fn(&NodeRequest<'_>) -> Result<Vec<u8>, String> + Send>;

/// The services of a node. Dropping it closes them.
pub(crate) struct Services {
    ports: Vec<(ReaderPort, WriterPort)>,
    _listed: Listed,
    thread: Option<JoinHandle<()>>,
}

/// A service, as the thread sees it. Its reader holds the other end of the channel, so the thread
/// does not hold the reader.
struct Served {
    requests: Weak<ReaderState>,
    replies: Arc<WriterState>,
    writer: Arc<Writer>,
}

impl Services {
    /// Opens the services, for which `thread` is the name of their thread.
    pub(crate) fn open(
        node: &Node,
        thread: &str,
        services: &[NodeService],
        answer: Answer,
    ) -> Result<Self, OpenError> {
        let address = node.name.full();
        let signal = signal(&address)?;
        let (sender, requests) = sync_channel(MOST);
        let gauge = QueueGauge::new(MOST_BYTES);
        let opening = Opening::begin(&node.session, &address)?;
        let mut ports = Vec::new();
        for (place, NodeService { name, type_name }) in services.iter().enumerate() {
            let service = format!("{address}/{name}");
            let types = TypeIdentity {
                name: (*type_name).to_owned(),
                hash: 0,
            };
            let (package, own) = type_name.split_once("/srv/").unwrap_or_default();
            let [request, reply] = names::service_topics(&service, package, own);
            let spec = |names| EndpointSpec {
                names,
                role: Role::Server,
                types: &types,
                qos: None,
                signal: signal.clone(),
                labels: node.types.labels(&types.name),
            };
            let inbox = OfService {
                place,
                gauge: gauge.clone(),
                requests: sender.clone(),
            };
            let replies = opening.writer(spec(reply), Arc::new(()))?;
            let requests = opening.reader(spec(request), Arc::new(inbox))?;
            ports.push((requests, replies));
        }
        let states: Vec<_> = ports
            .iter()
            .flat_map(|(requests, replies)| [requests.state(), replies.state()])
            .collect();
        opening.meet(&states);
        let readers: Vec<Guid> = ports.iter().map(|(requests, _)| requests.guid).collect();
        let writers: Vec<Guid> = ports.iter().map(|(_, replies)| replies.guid).collect();
        let served = ports.iter();
        let served: Vec<Served> = served
            .map(|(requests, replies)| Served {
                requests: Arc::downgrade(&requests.shared),
                replies: Arc::clone(&replies.shared),
                writer: Arc::clone(&replies.writer),
            })
            .collect();
        let thread = std::thread::Builder::new()
            .name(thread.to_owned())
            .spawn(move || run(&requests, &gauge, &served, &answer))
            .map_err(|error| OpenError::Backend {
                address,
                reason: format!("a thread cannot be started: {error}"),
            })?;
        Ok(Self {
            _listed: node.graph.list(&readers, &writers),
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

fn run(requests: &Receiver<Waiting>, gauge: &QueueGauge, served: &[Served], answer: &Answer) {
    let (rate_limit, mut sent) = (RateLimit::default(), 0);
    for waiting in requests {
        gauge.remove(waiting.sample.len());
        let to = &served[waiting.place];
        let Some(requests) = to.requests.upgrade() else {
            return;
        };
        sent += 1;
        if let Err(reason) = to.reply(sent, &waiting, &requests, answer)
            && let Some(suppressed) = rate_limit.allow()
        {
            let (count, topic) = (suppressed + 1, to.replies.state.topic());
            tracing::warn!("a request has no reply on `{topic}` ({count} times): {reason}");
        }
    }
}

impl Served {
    fn reply(
        &self,
        sequence: u64,
        waiting: &Waiting,
        requests: &ReaderState,
        answer: &Answer,
    ) -> Result<(), String> {
        let sample = &waiting.sample;
        let request = Request::read(sample, requests)?;
        // A request may come before its client is discovered.
        let is_known = requests.participant(sample.writer()).is_some();
        let answer = answer(&NodeRequest {
            place: waiting.place,
            body: body(sample)?.get(request.skipped()..).unwrap_or_default(),
            received: waiting.received,
            is_orphan: !is_known && waiting.received.elapsed() >= HOLD,
        })?;
        let begin = Instant::now();
        while !is_reachable(sample, requests, &self.replies) && begin.elapsed() < HOLD {
            self.replies.state.wait_for_change(LOOK);
        }
        let reply = lend(&self.writer, &answer)?;
        send_reply(&self.writer, sequence, request, reply)
    }
}
