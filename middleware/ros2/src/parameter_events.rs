//! Publishes changes of parameters on `/parameter_events`, on a thread of its own.

use crate::endpoint_state::STRANGER;
use crate::qos;
use crate::rcl;
use crate::session::{self, EndpointSpec, Port, Session, Unsent, signal};
use crate::wire::{Body, Writer};
use rc_middleware::parameters::{ParameterEvent, ParameterService};
use rc_middleware::{OpenError, Qos, TypeIdentity};
use rc_network::{EndpointKind, RateLimit, Role, stamp};
use std::rc::Rc;
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
type Told = (i64, ParameterEvent);

/// Publishes events until it is dropped.
pub(crate) struct Events {
    /// The queue to the thread. The listener of the parameters holds it weakly: dropping it here
    /// ends the thread.
    queue: Option<Arc<SyncSender<Told>>>,
    thread: Option<JoinHandle<()>>,
    /// Dropped after the thread has ended.
    _port: Port,
}

impl Events {
    pub(crate) fn open(
        session: &Rc<Session>,
        parameters: &dyn ParameterService,
    ) -> Result<Self, OpenError> {
        let failed = |reason: String| OpenError::Backend {
            address: TOPIC.to_owned(),
            reason,
        };
        let port = session.end(EndpointSpec {
            address: TOPIC,
            topic: (
                format!("rt{TOPIC}"),
                "rcl_interfaces::msg::dds_::ParameterEvent_".to_owned(),
            ),
            role: Role::Publisher,
            types: &TypeIdentity {
                name: "rcl_interfaces/msg/ParameterEvent".to_owned(),
                hash: STRANGER,
            },
            kind: EndpointKind::Writer,
            qos: qos::topic(&Qos {
                depth: MOST,
                ..Qos::PUBLISHER
            }),
            signal: signal(TOPIC)?,
            is_watched: false,
            inbox: Arc::new(()),
            group: Default::default(),
        })?;
        let writer = port.writer().map(Arc::clone);
        let writer = writer.ok_or_else(|| failed("this end does not send".to_owned()))?;
        let sender = Sender {
            node: session.config.node.fully_qualified_name(),
            writer,
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
                untold(&rate_limit, "too many wait");
            }
        }));
        Ok(Self {
            queue: Some(queue),
            thread: Some(thread),
            _port: port,
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
fn untold(rate_limit: &RateLimit, reason: &str) {
    if let Some(passed) = rate_limit.allow() {
        let count = passed + 1;
        tracing::warn!("a change of parameters is not told on `{TOPIC}` ({count} times): {reason}");
    }
}

/// The thread.
struct Sender {
    node: String,
    writer: Arc<Writer>,
    rate_limit: RateLimit,
}

impl Sender {
    fn run(self, events: &Receiver<Told>) {
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
                untold(&self.rate_limit, &reason);
            }
        }
    }

    fn send(&self, stamp: i64, event: &ParameterEvent) -> Result<(), String> {
        let body = rcl::event(stamp, &self.node, event)?;
        match session::write(&self.writer, Body::of(&[&body]), stamp, None, None) {
            Ok(_) => Ok(()),
            Err(Unsent::Full) => Err("somebody confirms nothing".to_owned()),
            Err(Unsent::Failed(reason)) => Err(reason),
        }
    }
}
