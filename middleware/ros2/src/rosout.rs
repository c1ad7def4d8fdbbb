//! Publishes the log of a node on `/rosout`, on a thread of its own.

use crate::graph::Listed;
use crate::node::Node;
use crate::rcl::{put_time, text};
use rc_ddsc::Writer as Sender;
use rc_middleware::{
    Durability, LogLevel, LogLine, LogQueue, OpenError, Qos, TypeIdentity, Writer,
};
use rc_network::{EndpointSpec, Role, TopicPublisher, signal};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

/// The topic of all nodes.
const TOPIC: &str = "/rosout";
/// The quality of service of `rcl`: late joiners get the last lines of ten seconds.
const DEPTH: u32 = 1000;
const LIFESPAN: Duration = Duration::from_secs(10);

/// Publishes lines until it is dropped.
pub(crate) struct LogPublisher {
    queue: Arc<LogQueue>,
    thread: Option<JoinHandle<()>>,
    /// Dropped after the thread has ended.
    _publisher: TopicPublisher,
    _listed: Listed,
}

impl LogPublisher {
    pub(crate) fn open(node: &Node, queue: &Arc<LogQueue>) -> Result<Self, OpenError> {
        let types = TypeIdentity {
            name: "rcl_interfaces/msg/Log".to_owned(),
            hash: 0,
        };
        let spec = EndpointSpec {
            names: (
                format!("rt{TOPIC}"),
                "rcl_interfaces::msg::dds_::Log_".to_owned(),
            ),
            role: Role::Publisher,
            types: &types,
            qos: Some(Qos {
                depth: DEPTH,
                durability: Durability::TransientLocal,
                lifespan: Some(LIFESPAN),
                ..Qos::PUBLISHER
            }),
            signal: signal(TOPIC)?,
            labels: node.types.labels(&types.name),
        };
        let publisher = TopicPublisher::open(&node.session, TOPIC, spec)?;
        let thread = {
            let sender = Arc::clone(&publisher.port().writer);
            let logger = logger(&node.name.full());
            let queue = Arc::clone(queue);
            let thread = std::thread::Builder::new().name("rc-ros2-log".to_owned());
            let thread = thread.spawn(move || run(&queue, &logger, &sender));
            thread.map_err(|error| OpenError::Backend {
                address: TOPIC.to_owned(),
                reason: format!("a thread cannot be started: {error}"),
            })?
        };
        Ok(Self {
            queue: Arc::clone(queue),
            thread: Some(thread),
            _listed: node.graph.list(&[], &[publisher.port().guid]),
            _publisher: publisher,
        })
    }
}

impl Drop for LogPublisher {
    fn drop(&mut self) {
        self.queue.close(true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The name of a node's logger: `robot.lidar` of the node `/robot/lidar`.
fn logger(node: &str) -> String {
    node.trim_start_matches('/').replace('/', ".")
}

fn run(queue: &LogQueue, logger: &str, sender: &Sender) {
    let mut sent = 0;
    while let Some((line, lost)) = queue.next() {
        let lost = (lost > 0).then(|| LogLine {
            level: LogLevel::Warn,
            text: format!("{lost} lines of the log are not on {TOPIC}: too many at once"),
            file: "",
            module: "",
            line: 0,
            ..line.clone()
        });
        for line in lost.iter().chain([&line]) {
            sent += 1;
            // A line that cannot be sent is in the log of the component only.
            let result = sender.write(sent, nanoseconds(line.time), &body(logger, line));
            if result.is_err() && queue.is_closed() {
                // A subscriber that confirms nothing delays the end by one blocked write.
                return;
            }
        }
    }
}

/// Nanoseconds since 1970.
fn nanoseconds(time: SystemTime) -> i64 {
    let since = time.duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos() as i64)
}

/// `rcl_interfaces/msg/Log`
fn body(logger: &str, line: &LogLine) -> Vec<u8> {
    let mut writer = Writer::default();
    put_time(nanoseconds(line.time), &mut writer);
    let level: u8 = match line.level {
        LogLevel::Debug => 10,
        LogLevel::Info => 20,
        LogLevel::Warn => 30,
        LogLevel::Error => 40,
    };
    writer.put(&level);
    text(logger, &mut writer);
    text(&line.text, &mut writer);
    text(line.file, &mut writer);
    // The field is for the name of a function. A component knows its module.
    text(line.module, &mut writer);
    writer.put(&line.line);
    writer.into_bytes()
}
