//! Publishes changes of parameters on `/parameter_events`, on a thread of its own.

use crate::graph::Listed;
use crate::node::Node;
use crate::rcl;
use rc_ddsc::Writer;
use rc_middleware::parameters::{ParameterEvent, ParameterService};
use rc_middleware::{OpenError, Qos, TypeIdentity};
use rc_network::{EndpointSpec, RateLimit, Role, TopicPublisher, signal, stamp};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The topic of all nodes.
const TOPIC: &str = "/parameter_events";
/// Most events that wait to be sent, or are kept until all subscribers have confirmed them, as in
/// `rclcpp`.
const MOST: u32 = 1000;
/// Time after which other nodes have found a new node, also with Fast DDS. Nobody receives earlier
/// events.
const DISCOVERY: Duration = Duration::from_millis(1500);

/// An event and its time, in nanoseconds since 1970.
type TimedEvent = (i64, ParameterEvent);

/// Publishes events until it is dropped.
pub(crate) struct Events {
    /// The queue to the thread. The listener of the parameters holds it weakly: dropping it here
    /// ends the thread.
    queue: Option<Arc<SyncSender<TimedEvent>>>,
    thread: Option<JoinHandle<()>>,
    /// Dropped after the thread has ended.
    _publisher: TopicPublisher,
    _listed: Listed,
}

impl Events {
    pub(crate) fn open(node: &Node, parameters: &dyn ParameterService) -> Result<Self, OpenError> {
        let failed = |reason: String| OpenError::Backend {
            address: TOPIC.to_owned(),
            reason,
        };
        let types = TypeIdentity {
            name: "rcl_interfaces/msg/ParameterEvent".to_owned(),
            hash: 0,
        };
        let spec = EndpointSpec {
            names: (
                format!("rt{TOPIC}"),
                "rcl_interfaces::msg::dds_::ParameterEvent_".to_owned(),
            ),
            role: Role::Publisher,
            types: &types,
            qos: Some(Qos {
                depth: MOST,
                ..Qos::PUBLISHER
            }),
            signal: signal(TOPIC)?,
            labels: node.types.labels(&types.name),
        };
        let publisher = TopicPublisher::open(&node.session, TOPIC, spec)?;
        let sender = Sender {
            node: node.name.full(),
            writer: Arc::clone(&publisher.port().writer),
            sent: 0,
            rate_limit: RateLimit::default(),
        };
        let (queue, events) = sync_channel(MOST as usize);
        let thread = std::thread::Builder::new()
            .name("rc-ros2-event".to_owned())
            .spawn(move || sender.run(&events))
            .map_err(|error| failed(format!("a thread cannot be started: {error}")))?;
        let queue = Arc::new(queue);
        let listener = Arc::downgrade(&queue);
        let rate_limit = RateLimit::default();
        parameters.watch(Box::new(move |event| {
            let Some(queue) = listener.upgrade() else {
                return;
            };
            if queue.try_send((stamp(0), event)).is_err() {
                not_published(&rate_limit, "too many wait");
            }
        }));
        Ok(Self {
            queue: Some(queue),
            thread: Some(thread),
            _listed: node.graph.list(&[], &[publisher.port().guid]),
            _publisher: publisher,
        })
    }
}

impl Drop for Events {
    fn drop(&mut self) {
        self.queue = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Logs that a change was not published.
fn not_published(rate_limit: &RateLimit, reason: &str) {
    if let Some(passed) = rate_limit.allow() {
        let count = passed + 1;
        tracing::warn!(
            "a change of parameters is not published on `{TOPIC}` ({count} times): {reason}"
        );
    }
}

/// The thread.
struct Sender {
    node: String,
    writer: Arc<Writer>,
    /// Number of events that were sent.
    sent: u64,
    rate_limit: RateLimit,
}

impl Sender {
    fn run(mut self, events: &Receiver<TimedEvent>) {
        let begin = Instant::now();
        let mut held = Vec::new();
        while held.len() < MOST as usize
            && let left = DISCOVERY.saturating_sub(begin.elapsed())
            && let Ok(told) = events.recv_timeout(left)
        {
            held.push(told);
        }
        // A node that ends during this time publishes its events at once.
        for (stamp, event) in held.into_iter().chain(events) {
            if let Err(reason) = self.send(stamp, &event) {
                not_published(&self.rate_limit, &reason);
            }
        }
    }

    fn send(&mut self, stamp: i64, event: &ParameterEvent) -> Result<(), String> {
        let body = rcl::event(stamp, &self.node, event)?;
        self.sent += 1;
        let sent = self.writer.write(self.sent, stamp, &body);
        sent.map_err(|error| error.to_string())
    }
}
