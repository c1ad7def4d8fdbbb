//! `ping` and `pong`, written by hand on ros2-client: the reference for generated
//! components over ROS 2.
//!
//! `bench_ros_peer ping|pong DOMAIN`. The ends have the quality of service of our backend and the
//! messages those of generated code; octets are written and read in one piece. Each message wakes
//! the main thread by `mio`, which handles it. It lacks the additions of our backend: liveliness,
//! type hashes, counts of lost samples, a limit for each call, the loop of a component.

use bench_protocol::{Kind, LARGEST, next_command, now, pause, ready, report};
use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use ros2_client::{
    Client, Context, Message, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher,
    QosProfile, Server, ServiceMapping, ServiceTypeName, Subscription,
};
use rustdds::mio1::{Events, Interest, Poll, Token};
use rustdds::{DomainParticipantBuilder, Topic};
use serde::de::{Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};
use std::fmt;
use std::net::{IpAddr, Ipv4Addr};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Anything that goes wrong ends the program.
type Failure = Box<dyn std::error::Error>;

/// No wait is longer.
const LIMIT: Duration = Duration::from_secs(1);
/// How long the other program may take to come.
const START: Duration = Duration::from_secs(10);
/// How long it may take to find what has been found by it.
const FOUND: Duration = Duration::from_millis(300);
/// Between two looks whether it is there.
const LOOK: Duration = Duration::from_millis(10);
const FIRST: Token = Token(1);
const SECOND: Token = Token(2);

/// A sequence of octets.
#[derive(Clone, Debug, Default)]
struct Octets(Vec<u8>);

impl Serialize for Octets {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

impl<'de> Deserialize<'de> for Octets {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Taking;
        impl Visitor<'_> for Taking {
            type Value = Octets;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("octets")
            }

            fn visit_byte_buf<E>(self, bytes: Vec<u8>) -> Result<Octets, E> {
                Ok(Octets(bytes))
            }
        }
        deserializer.deserialize_byte_buf(Taking)
    }
}

#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Sample {
    sent: i64,
    data: Octets,
}

#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Echo {
    data: Octets,
}

impl Message for Sample {}
impl Message for Echo {}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ping", domain] => ping(domain),
        ["pong", domain] => pong(domain),
        _ => Err("usage: bench_ros_peer ping|pong DOMAIN".into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench_ros_peer: error: {error}");
            ExitCode::from(3)
        }
    }
}

/// Quality of service of the endpoints of our components.
fn qos(reliability: Reliability, history: History) -> QosProfile {
    QosProfile {
        reliability,
        history,
        durability: Durability::Volatile,
        ..QosProfile::publisher_default()
    }
}

const VALUES: History = History::KeepLast { depth: 10 };
const RELIABLE: Reliability = Reliability::Reliable {
    when_full: WhenFull::DEFAULT,
};

/// One program's node, which a thread of its own keeps going.
fn node(domain: &str, name: &str) -> Result<Node, Failure> {
    let local = vec![IpAddr::V4(Ipv4Addr::LOCALHOST)];
    let participant = DomainParticipantBuilder::new(domain.parse()?).with_only_networks(local);
    let context = Context::from_domain_participant(participant.build()?)?;
    let mut node = context.new_node(NodeName::new("/bench", name)?, NodeOptions::new())?;
    let spinner = node.spinner()?;
    std::thread::spawn(move || spin(spinner.spin()));
    Ok(node)
}

/// Polls a future to its end on this thread.
fn spin(future: impl Future) {
    struct Unpark(std::thread::Thread);
    impl std::task::Wake for Unpark {
        fn wake(self: std::sync::Arc<Self>) {
            self.0.unpark();
        }
    }
    let mut future = std::pin::pin!(future);
    let waker = std::sync::Arc::new(Unpark(std::thread::current())).into();
    let mut context = std::task::Context::from_waker(&waker);
    while future.as_mut().poll(&mut context).is_pending() {
        std::thread::park();
    }
}

fn topic(node: &Node) -> Result<Topic, Failure> {
    let (name, qos) = (Name::new("/", "samples")?, qos(RELIABLE, VALUES));
    let kind = MessageTypeName::new("robocomp_rc_bench_msgs", "SampleSample");
    Ok(node.create_topic(&name, kind, &qos)?)
}

/// The service, and the quality of service of both its topics.
fn service() -> Result<(Name, ServiceTypeName, QosProfile), Failure> {
    Ok((
        Name::new("/", "echo")?,
        ServiceTypeName::new("robocomp_rc_bench_msgs", "EchoEcho"),
        qos(RELIABLE, History::KeepAll),
    ))
}

/// Waits until the other program is there.
fn meet(is_there: impl Fn() -> bool) -> Result<(), Failure> {
    let end = Instant::now() + START;
    while !is_there() {
        if Instant::now() > end {
            return Err("the other program does not come".into());
        }
        std::thread::sleep(LOOK);
    }
    // It may find this one a little later.
    std::thread::sleep(FOUND);
    Ok(())
}

/// The sending and asking side: does what is ordered until there are no more orders.
fn ping(domain: &str) -> Result<(), Failure> {
    let mut node = node(domain, "ping")?;
    let samples: Publisher<Sample> =
        node.create_publisher(&topic(&node)?, Some(qos(RELIABLE, VALUES)))?;
    let (name, kind, calls) = service()?;
    let mapping = ServiceMapping::Enhanced;
    let mut client: Client<Echo, Echo> =
        node.create_client(mapping, &name, &kind, calls.clone(), calls)?;
    let mut poll = Poll::new()?;
    let registry = poll.registry();
    registry.register(&mut client, FIRST, Interest::READABLE)?;
    let mut events = Events::with_capacity(8);
    meet(|| samples.get_subscription_count(&node) > 0)?;
    let message = vec![7; LARGEST];
    let mut times = Vec::new();
    ready()?;
    while let Some(command) = next_command()? {
        times.clear();
        for _ in 0..command.count {
            let data = &message[..command.size];
            if command.kind == Kind::Publish {
                pause(command.size);
                let sent = now();
                let data = Octets(data.to_vec());
                samples
                    .publish(Sample { sent, data })
                    .map_err(|e| e.to_string())?;
                continue;
            }
            let start = now();
            let data = Octets(data.to_vec());
            let id = client
                .send_request(Echo { data })
                .map_err(|e| e.to_string())?;
            let end = Instant::now() + START;
            let answer = loop {
                match client.receive_response()? {
                    Some((answered, response)) if answered == id => break response.data.0,
                    Some(_) => {}
                    None if Instant::now() > end => return Err("no answer".into()),
                    None => poll.poll(&mut events, Some(LIMIT))?,
                }
            };
            times.push(now() - start);
            if answer.len() != command.size {
                return Err("another echo".into());
            }
        }
        if command.kind == Kind::Publish {
            pause(command.size);
            let end = Sample {
                sent: 0,
                data: Octets::default(),
            };
            samples.publish(end).map_err(|e| e.to_string())?;
        }
        report(&times)?;
    }
    Ok(())
}

/// The receiving and answering side: answers and notes until it is ended.
fn pong(domain: &str) -> Result<(), Failure> {
    let mut node = node(domain, "pong")?;
    let careless = qos(Reliability::BestEffort, VALUES);
    let mut samples: Subscription<Sample> =
        node.create_subscription(&topic(&node)?, Some(careless))?;
    let (name, kind, calls) = service()?;
    let mapping = ServiceMapping::Enhanced;
    let mut server: Server<Echo, Echo> =
        node.create_server(mapping, &name, &kind, calls.clone(), calls)?;
    let mut poll = Poll::new()?;
    let registry = poll.registry();
    registry.register(&mut samples, FIRST, Interest::READABLE)?;
    registry.register(&mut server, SECOND, Interest::READABLE)?;
    let mut events = Events::with_capacity(8);
    let mut times = Vec::new();
    ready()?;
    loop {
        poll.poll(&mut events, Some(LIMIT))?;
        while let Some((sample, _)) = samples.take()? {
            if sample.data.0.is_empty() {
                report(&times)?;
                times.clear();
            } else {
                times.push(now() - sample.sent);
            }
        }
        while let Some((id, request)) = server.receive_request()? {
            server
                .send_response(id, request)
                .map_err(|e| e.to_string())?;
        }
    }
}
