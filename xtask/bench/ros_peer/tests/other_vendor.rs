//! Clients over ros2-client, whose vendor is `RustDDS`, call a component in each mapping of
//! services.

use rc_conformance::network::{StopOnDrop, endpoint, header, serve_replies_until, until};
use rc_middleware::rpc::{self, RequestId};
use rc_middleware::typed::{HandlerError, Operation, Request};
use rc_middleware::{
    CallError, Environment, Header, Profile, Reader, Reply, RunDirectory, Settings, WakeEvent,
    Writer,
};
use rc_vocabulary::Value;
use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use ros2_client::{
    Client, Context, Message, Name, Node, NodeName, NodeOptions, QosProfile, Server,
    ServiceMapping, ServiceTypeName,
};
use rustdds::DomainParticipantBuilder;
use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const DOMAIN: u16 = 17;
const ADDRESS: &str = "default/Motor";
const ECHO: Operation = operation("any", 5, true);
const NOTE: Operation = operation("note", 12, false);
/// The largest number that a request may have.
const LARGEST: f64 = 100.0;

const fn operation(name: &'static str, id: i32, two_way: bool) -> Operation {
    Operation {
        name,
        id,
        type_hash: 0,
        two_way,
        replies: &[],
    }
}

/// A structure of one number. That of a command is empty, and its octet is read as nothing.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Number {
    value: i32,
}

#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Empty {
    structure_needs_at_least_one_member: u8,
}

impl Message for Number {}
impl Message for Empty {}

/// Replies to `any` with its number. Numbers out of range are refused.
fn handle(header: Header, body: &[u8], reply: &mut dyn Reply) {
    let read = |reader: &mut Reader<'_>| {
        let value: i32 = reader.get()?;
        reader.range("value", value.into(), (0.0, LARGEST), "0 to 100")?;
        Ok(value)
    };
    let mut request = Request::open(header, body, reply).expect("an envelope");
    let operation = if request.operation == ECHO.id {
        ECHO
    } else {
        NOTE
    };
    let handled: Result<(), HandlerError> = request
        .arguments(&operation, read)
        .and_then(|value| request.reply_with(0, |writer| writer.put(&value)));
    drop(handled);
    request.close();
}

/// The environment of a component.
fn environment(name: &str) -> Environment {
    let network = format!("vendors-{name}-{}", std::process::id());
    let directory = RunDirectory::open(&network).expect("a run directory");
    let mut environment = Environment {
        network,
        instance: name.to_owned(),
        directory,
        wake_event: WakeEvent::new().expect("a wake event"),
        settings: Settings::default(),
    };
    let domain = Value::Int(DOMAIN.into());
    environment.settings.set("ros2", "domain", domain);
    let interfaces = Value::Texts(vec!["lo".to_owned()]);
    environment.settings.set("ros2", "interfaces", interfaces);
    environment
}

/// Runs the component while `body` runs.
fn serving(body: impl FnOnce()) {
    let environment = environment("motor");
    let stop = WakeEvent::new().expect("a wake event");
    std::thread::scope(|scope| {
        let (ready, is_ready) = channel();
        let (stop, environment) = (&stop, &environment);
        scope.spawn(move || {
            let backend = rc_ros2::connect(environment, &[]).expect("the domain");
            let mut server = backend.server(&endpoint(ADDRESS)).expect("a server");
            ready.send(()).expect("a test that waits");
            serve_replies_until(&mut *server, stop, &handle);
        });
        let _stop = StopOnDrop(stop);
        is_ready
            .recv_timeout(Duration::from_secs(20))
            .expect("a server");
        body();
    });
    environment.directory.remove().expect("a run directory");
}

/// The errors of two calls to a server that is found and never replies.
fn call_silent_server() {
    let environment = environment("arm");
    let backend = rc_ros2::connect(&environment, &[]).expect("the domain");
    let mut client = backend.client(&endpoint("default/Arm")).expect("a client");
    until("the server is found", || client.peers() == 1);
    for sequence in 1..=2 {
        let id = RequestId {
            writer: client.guid(),
            sequence,
        };
        let mut request = Writer::default();
        rpc::begin_request(&mut request, id, ECHO.id);
        rpc::begin_body(&mut request, Profile::Bare);
        request.put(&7_i32);
        let limit = Duration::from_millis(100);
        let called = client.call(
            header(sequence),
            &request.into_bytes(),
            limit,
            &mut |_, _| {},
        );
        assert!(
            matches!(called, Err(CallError::Deadline { .. })),
            "{called:?}"
        );
    }
    drop((client, backend));
    environment.directory.remove().expect("a run directory");
}

fn node() -> Node {
    let local = vec![IpAddr::V4(Ipv4Addr::LOCALHOST)];
    let participant = DomainParticipantBuilder::new(DOMAIN).with_only_networks(local);
    let context = Context::from_domain_participant(participant.build().expect("a participant"));
    let name = NodeName::new("/default", "client").expect("a name");
    let node = context
        .expect("a context")
        .new_node(name, NodeOptions::new());
    node.expect("a node")
}

fn qos() -> QosProfile {
    QosProfile {
        reliability: Reliability::Reliable {
            when_full: WhenFull::DEFAULT,
        },
        history: History::KeepAll,
        durability: Durability::Volatile,
        ..QosProfile::publisher_default()
    }
}

fn client<R: Message + 'static>(
    node: &mut Node,
    mapping: ServiceMapping,
    operation: &str,
) -> Client<Number, R> {
    let name = Name::new("/default/Motor", operation).expect("a name");
    let kind = ServiceTypeName::new("conformance_msgs", operation);
    let client = node.create_client(mapping, &name, &kind, qos(), qos());
    client.expect("a client")
}

/// Whether a call gets its reply within `limit`. A request may be sent before the server is found.
fn call<R: Message + 'static>(
    client: &Client<Number, R>,
    value: i32,
    limit: Duration,
) -> Option<R> {
    let id = client.send_request(Number { value }).expect("to be sent");
    let end = Instant::now() + limit;
    while Instant::now() < end {
        match client.receive_response() {
            Ok(Some((answered, reply))) if answered == id => return Some(reply),
            // Replies to clients of the other mapping are errors here.
            _ => std::thread::sleep(Duration::from_millis(2)),
        }
    }
    None
}

/// Log of the component.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Log {
    /// Number of lines with `text`.
    fn count(&self, text: &str) -> usize {
        let log = self.0.lock().expect("the log");
        let log = String::from_utf8_lossy(&log).into_owned();
        log.lines().filter(|line| line.contains(text)).count()
    }
}

impl io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("the log").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn clients_of_each_mapping_get_a_reply_or_are_named_once() {
    let log = Log::default();
    let writer = log.clone();
    tracing_subscriber::fmt()
        .with_writer(move || writer.clone())
        .with_max_level(tracing::Level::WARN)
        .init();
    let short = Duration::from_millis(300);
    serving(|| {
        let mut node = node();
        let cyclone = client(&mut node, ServiceMapping::Cyclone, "any");
        let enhanced = client(&mut node, ServiceMapping::Enhanced, "any");
        for client in [&cyclone, &enhanced] {
            until("the component replies", || {
                let reply: Option<Number> = call(client, 7, short);
                reply.is_some_and(|reply| reply.value == 7)
            });
        }
        let basic = client::<Number>(&mut node, ServiceMapping::Basic, "any");
        let named = "a client on RustDDS uses the basic service mapping of DDS-RPC";
        until("the client is named", || {
            basic.send_request(Number { value: 7 }).expect("to be sent");
            std::thread::sleep(Duration::from_millis(20));
            log.count(named) > 0
        });
        // A refused command gets no reply, since an empty one would say that it was executed.
        let commands: Client<Number, Empty> = client(&mut node, ServiceMapping::Enhanced, "note");
        until("a command is executed", || {
            call(&commands, 100, short).is_some()
        });
        assert!(call(&commands, 101, short).is_none());
        assert_eq!(log.count("stays without a reply"), 2);
        assert_eq!(log.count("outside its range 0 to 100"), 1);
        assert!(call(&commands, 100, Duration::from_secs(20)).is_some());
        assert!(call(&enhanced, 8, Duration::from_secs(20)).is_some());
        assert_eq!(log.count(named), 1);
        // A server whose mapping is unknown is named at the first deadline.
        let name = Name::new("/default/Arm", "any").expect("a name");
        let kind = ServiceTypeName::new("conformance_msgs", "any");
        let mapping = ServiceMapping::Cyclone;
        let _server: Server<Number, Number> = node
            .create_server(mapping, &name, &kind, qos(), qos())
            .expect("a server");
        call_silent_server();
        assert_eq!(log.count("the server is on RustDDS"), 1);
    });
}
