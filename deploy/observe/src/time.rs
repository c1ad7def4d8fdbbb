//! The time of a network, which tools receive and publish: ticks, or `/clock` of ROS 2.

use crate::error::Error;
use crate::network::{Component, End, Network, Topic};
use crate::observer::Observed;
use crate::sender::Sender;
use rc_management::component::ClockKind;
use rc_management::observation::OperationDescription;
use rc_middleware::Qos;
use rc_middleware::{Reader, Writer, network_time};
use rc_values::Catalog;
use rc_values::description::Module;
use serde_json::json;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How often the present time is repeated: a follower considers a silent source lost.
const REPEAT: Duration = Duration::from_millis(400);
/// Nanoseconds of a second.
const SECOND: u64 = 1_000_000_000;

/// A topic on which time travels.
#[derive(Clone, Debug)]
pub struct TimeTopic {
    topic: Topic,
    is_ros: bool,
}

impl Network {
    /// Topics with the time of this network, if it is not that of the system.
    pub fn time(&self) -> Option<TimeTopic> {
        let of = |kind| {
            let mut all = self.components.iter();
            all.find(move |c| c.status.clock.kind == kind)
        };
        let source = of(ClockKind::Source).and_then(|c| self.ticks(c));
        source.or_else(|| of(ClockKind::Nodes).and_then(|c| self.ros_clock(c)))
    }

    /// Topics from which following components receive their time, one for each middleware.
    fn followed(&self) -> Vec<TimeTopic> {
        let mut topics: BTreeMap<(String, bool), TimeTopic> = BTreeMap::new();
        for component in &self.components {
            let topic = match component.status.clock.kind {
                ClockKind::Simulated => self.ticks(component),
                ClockKind::Nodes => self.ros_clock(component),
                ClockKind::System | ClockKind::Source => None,
            };
            if let Some(topic) = topic {
                let key = (topic.topic.middleware.clone(), topic.is_ros);
                topics.entry(key).or_insert(topic);
            }
        }
        topics.into_values().collect()
    }

    fn ticks(&self, component: &Component) -> Option<TimeTopic> {
        let module = json!({
            "module": "RcTime",
            "interfaces": [{"name": "Time", "operations": [{
                "name": "tick", "id": 0, "pattern": "publish",
                "hash": format!("{:016x}", network_time::TYPE_HASH),
                "inputs": [
                    {"name": "epoch", "type": "uint64"}, {"name": "number", "type": "uint64"},
                    {"name": "time", "type": "uint64"}, {"name": "turn", "type": "uint64"},
                    {"name": "lockstep", "type": "bool"}
                ]
            }]}]
        });
        let middleware = component.status.middleware.clone();
        self.time_topic(
            component,
            module,
            &middleware,
            "RcTime::Time",
            "rc_time/msg/Tick",
        )
    }

    fn ros_clock(&self, component: &Component) -> Option<TimeTopic> {
        let module = json!({
            "module": "rosgraph_msgs",
            "interfaces": [{"name": "Clock", "operations": [{
                "name": "clock", "id": 0, "pattern": "publish",
                "hash": format!("{:016x}", network_time::TYPE_HASH),
                "inputs": [{"name": "sec", "type": "int32"}, {"name": "nanosec", "type": "uint32"}]
            }]}]
        });
        let mut clock = self.time_topic(
            component,
            module,
            rc_vocabulary::Middleware::Ros2.word(),
            "rosgraph_msgs::Clock",
            "rosgraph_msgs/msg/Clock",
        )?;
        let rules = clock.topic.settings.entry("remap".to_owned()).or_default();
        if !rules.is_empty() {
            rules.push_str(", ");
        }
        rules.push_str("rc_time/clock:=/clock");
        clock.is_ros = true;
        clock.topic.description.qos = Qos {
            depth: 1,
            ..Qos::SUBSCRIBER
        };
        Some(clock)
    }

    /// The topic of the only operation of `interface`.
    fn time_topic(
        &self,
        component: &Component,
        module: serde_json::Value,
        middleware: &str,
        interface: &str,
        ros_type: &str,
    ) -> Option<TimeTopic> {
        let module: Module = serde_json::from_value(module).ok()?;
        let catalog = Catalog::new(&[module]).ok()?;
        let interface = catalog.interface(interface)?.clone();
        let operation = interface.operations.first()?.clone();
        let settings = component.described.middlewares.get(middleware)?;
        let end = End {
            component: component.name.clone(),
            slot: "rc_time".to_owned(),
            host: component.host.clone(),
            middlewares: Vec::new(),
        };
        let address = network_time::address(&self.name).ok()?;
        Some(TimeTopic {
            topic: Topic {
                address: format!("{address}/{}", operation.name),
                middleware: middleware.to_owned(),
                settings: settings.clone(),
                description: OperationDescription {
                    name: operation.name.clone(),
                    hash: format!("{:016x}", operation.hash),
                    qos: Qos::PUBLISHER,
                    external_type: Some(ros_type.to_owned()),
                },
                interface,
                operation,
                publishers: vec![end.clone()],
                subscribers: vec![end],
            },
            is_ros: false,
        })
    }
}

impl TimeTopic {
    /// The topic, to observe it.
    pub fn topic(&self) -> &Topic {
        &self.topic
    }

    /// The time of a message, in nanoseconds.
    pub fn read(&self, observed: &Observed<'_>) -> Option<u64> {
        let mut reader = Reader::new(observed.body);
        if self.is_ros {
            let seconds = u64::try_from(reader.get::<i32>().ok()?).ok()?;
            let rest: u32 = reader.get().ok()?;
            return Some(seconds * SECOND + u64::from(rest));
        }
        let [_epoch, _number, time] = [(); 3].map(|()| reader.get::<u64>().ok());
        time
    }
}

/// Publishes the time of a network in place of its source.
pub struct TimeSource {
    senders: Vec<(TimeTopic, Sender)>,
    epoch: u64,
    number: u64,
    time: u64,
    said: Instant,
}

impl TimeSource {
    /// Opens the topics of all components that follow a time. Fails if none does, or if the network
    /// has a source of its own.
    pub fn open(network: &Network, epoch: u64) -> Result<Self, Error> {
        let mut all = network.components.iter();
        if let Some(source) = all.find(|c| c.status.clock.kind == ClockKind::Source) {
            return Err(Error::Component {
                component: source.name.clone(),
                reason: "it is the source of the network's time; stop it first".to_owned(),
            });
        }
        let topics = network.followed();
        if topics.is_empty() {
            let reason = "no component follows the time of the network; start components with \
                          `--clock simulated`, or write `time simulated by …;`";
            return Err(Error::system("publish time", &reason));
        }
        let senders = topics.into_iter().map(|topic| {
            let sender = Sender::open(network, &topic.topic)?;
            Ok((topic, sender))
        });
        Ok(Self {
            senders: senders.collect::<Result<_, Error>>()?,
            epoch: epoch.max(1),
            number: 0,
            time: 0,
            said: Instant::now(),
        })
    }

    /// Sets the time, in nanoseconds.
    pub fn set(&mut self, time: u64) -> Result<(), Error> {
        if time == self.time && self.number > 0 {
            return Ok(());
        }
        (self.time, self.number) = (time, self.number + 1);
        self.say()
    }

    /// Says the present time again if that is due. Call it several times a second.
    pub fn repeat(&mut self) -> Result<(), Error> {
        if self.number > 0 && self.said.elapsed() >= REPEAT {
            self.say()?;
        }
        Ok(())
    }

    fn say(&mut self) -> Result<(), Error> {
        self.said = Instant::now();
        for (topic, sender) in &mut self.senders {
            let mut writer = Writer::default();
            if topic.is_ros {
                writer.put(&i32::try_from(self.time / SECOND).unwrap_or(i32::MAX));
                writer.put(&((self.time % SECOND) as u32));
            } else {
                for number in [self.epoch, self.number, self.time, 0] {
                    writer.put(&number);
                }
                writer.put(&false);
            }
            sender.send_body(&writer.into_bytes())?;
        }
        Ok(())
    }
}
