//! Generated clients, publishers and servers in Rust, with a component in Python at the other end:
//! every pattern, every kind of type and every error, over each middleware.

#[allow(dead_code, reason = "the other program of tests uses more of it")]
#[path = "../../deploy/tests/all/python.rs"]
mod python;

use interfaces::rc_interop::echoes;
use interfaces::rc_interop::interop::{InteropClient, ShiftError};
use interfaces::rc_interop::oracle::{self, AskError};
use interfaces::rc_interop::reports::{self, ReportsPublisher};
use interfaces::rc_interop::{Kind, Mark, Nonsense, Point, Report};
use rc_middleware::typed::{Operation, Request, TypedClient, TypedPublisher};
use rc_middleware::{
    Address, Backend, CallError, Endpoint, Environment, ExternalType, Header, Qos, Reader, Reply,
    RunDirectory, Server, Settings, TypeIdentity, WakeEvent, wait,
};
use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// What the package needs beside Python.
const NUMPY: &str = "numpy==2.3.4";
/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(30);
/// The pause between two looks.
const LOOK: Duration = Duration::from_millis(5);
/// The generated description, for the hashes of interfaces.
const DESCRIPTION: &str = include_str!("../../middleware/interop/generated/src/description.rs");

/// A middleware with a domain.
struct Over {
    name: &'static str,
    domain: i64,
    connect: fn(&Environment) -> Box<dyn Backend>,
}

/// The process at the other end, in a network of its own.
struct OtherEnd {
    process: Child,
    /// What it says, which is shown if a test fails.
    said: File,
    network: String,
    over: &'static Over,
}

impl Drop for OtherEnd {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        if std::thread::panicking() {
            let mut said = String::new();
            let _ = self.said.rewind();
            let _ = self.said.read_to_string(&mut said);
            eprintln!("{said}");
        }
        let directory = RunDirectory::open(&self.network).expect("the run directory");
        let _ = rc_iceoryx2::wipe(&directory);
        let _ = directory.remove();
    }
}

fn native() -> PathBuf {
    let own = std::env::current_exe().expect("this program");
    own.with_file_name("librobocomp_python.so")
}

impl OtherEnd {
    fn start(over: &'static Over) -> Option<Self> {
        let test = format!("conformance over {}", over.name);
        let python = python::packages("python-numpy", NUMPY, &test)?;
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let network = format!("py-other-{}-{}", over.name, std::process::id());
        let mut command = Command::new(python);
        command
            .current_dir(package.join("tests/python"))
            .env("PYTHONPATH", package)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env("ROBOCOMP_NATIVE", native())
            .env("TEST_MIDDLEWARE", over.name)
            .args(["other_end.py", "--network", &network, "--log", "error"]);
        if over.domain > 0 {
            for setting in [
                format!("domain={}", over.domain),
                "interfaces=lo".to_owned(),
            ] {
                command.args(["--set-middleware", &format!("{}.{setting}", over.name)]);
            }
        }
        let said = tempfile::tempfile().expect("a file");
        command.stderr(said.try_clone().expect("a descriptor"));
        Some(Self {
            said,
            process: command.spawn().expect("the interpreter"),
            network,
            over,
        })
    }

    /// Joins its network.
    fn join(&self, instance: &str) -> Box<dyn Backend> {
        let mut settings = Settings::default();
        if self.over.domain > 0 {
            let domain = rc_settings::Value::Int(self.over.domain);
            settings.set(self.over.name, "domain", domain);
            let interfaces = rc_settings::Value::Texts(vec!["lo".to_owned()]);
            settings.set(self.over.name, "interfaces", interfaces);
        }
        (self.over.connect)(&Environment {
            network: self.network.clone(),
            instance: instance.to_owned(),
            directory: RunDirectory::open(&self.network).expect("a run directory"),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings,
        })
    }

    /// The endpoint of an interface, or of one of its topics.
    fn endpoint(&self, slot: &str, operations: &[Operation], topic: bool, qos: Qos) -> Endpoint {
        let address = Address::parse(&format!("{}/{slot}", self.network)).expect("an address");
        let kind = if topic { "msg" } else { "srv" };
        let external_types = operations.iter().map(|operation| ExternalType {
            slot: slot.to_owned(),
            operation: operation.name.to_owned(),
            id: operation.id,
            type_name: format!("rcinterop_msgs/{kind}/{slot}{}", capital(operation.name)),
        });
        let (address, types) = if topic {
            let operation = &operations[0];
            let name = format!("RcInterop::{slot}/{}", operation.name);
            let hash = operation.type_hash;
            (address.join(operation.name), TypeIdentity { name, hash })
        } else {
            let name = format!("RcInterop::{slot}");
            (
                address,
                TypeIdentity {
                    hash: hash(&name),
                    name,
                },
            )
        };
        Endpoint {
            address,
            types,
            qos,
            external_types: external_types.collect(),
        }
    }

    fn client(&self, backend: &dyn Backend) -> InteropClient {
        let operations = interfaces::rc_interop::interop::OPERATIONS;
        let endpoint = self.endpoint("Interop", operations, false, Qos::CALL);
        let port = backend.client(&endpoint).expect("a client");
        let mut client = InteropClient::new(TypedClient::new(port, LIMIT));
        // Over ROS 2, a server may be found first and be ready for this client some time later.
        until("the server is found", || {
            client.is_connected() && !matches!(client.add(0, 0), Err(CallError::NoServer(_)))
        });
        client
    }
}

fn capital(name: &str) -> String {
    let (first, rest) = name.split_at(1);
    first.to_uppercase() + rest
}

/// The hash of an interface, as the generated component has it.
fn hash(type_name: &str) -> u64 {
    let (_, after) = DESCRIPTION
        .split_once(&format!("type_name: \"{type_name}\""))
        .expect("the interface");
    let (_, hash) = after.split_once("type_hash: 0x").expect("its hash");
    u64::from_str_radix(&hash[..16], 16).expect("a hash")
}

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let end = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < end, "waited {LIMIT:?} until {what}");
        std::thread::sleep(LOOK);
    }
}

/// A value of every kind of type.
fn report(number: i64) -> Report {
    let point = |x, y| Point { x, y };
    Report {
        number,
        text: "Grüße, 世界".to_owned(),
        data: (0..=255).collect(),
        ranges: vec![0.5, -1e300, f64::INFINITY],
        kind: Kind::Door,
        origin: point(1.5, -2.5),
        marks: vec![
            Mark {
                name: "one".to_owned(),
                at: point(1.0, 2.0),
            },
            Mark {
                name: String::new(),
                at: point(-3.0, 4.0),
            },
        ],
        scores: [("a".to_owned(), 1.0), ("zwölf".to_owned(), -12.5)].into(),
    }
}

fn calls_are_answered(other: &OtherEnd) {
    let backend = other.join("caller");
    let mut client = other.client(&*backend);
    assert_eq!(client.add(40, 2), Ok(42));
    assert_eq!(client.add(i64::MAX, -1), Ok(i64::MAX - 1));
    let sent = report(1);
    let mut shifted = sent.clone();
    for mark in &mut shifted.marks {
        mark.at.x += 0.5;
        mark.at.y += 0.5;
    }
    assert_eq!(client.shift(&sent, 0.5), Ok((shifted, 2)));
    let large = Report {
        data: vec![7; 1 << 20],
        ..sent.clone()
    };
    let (back, _) = client.shift(&large, 0.0).expect("a large reply");
    assert_eq!(back, large);
    // An exception of the operation, an error of the handler, and a value that does not fit.
    let empty = Report::default();
    let nonsense = Nonsense {
        what: "`` has no marks".to_owned(),
        code: -7,
    };
    assert_eq!(
        client.shift(&empty, 0.0),
        Err(ShiftError::Nonsense(nonsense))
    );
    for (text, reason) in [("fails", "it fails"), ("wrong", "no report")] {
        let wrong = Report {
            text: text.to_owned(),
            ..sent.clone()
        };
        let answer = client.shift(&wrong, 0.0);
        let Err(ShiftError::Call(CallError::Refused(said))) = &answer else {
            panic!("{text}: {answer:?}");
        };
        assert!(said.contains(reason), "{said}");
    }
    // The component lives. Commands keep their order.
    let texts: Vec<String> = (0..10).map(|number| format!("note {number}")).collect();
    for text in &texts {
        client.note(text).expect("a command");
    }
    assert_eq!(client.noted(), Ok(texts));
}

fn samples_are_repeated(other: &OtherEnd) {
    let backend = other.join("publisher");
    let qos = Qos {
        reliability: rc_middleware::Reliability::Reliable,
        depth: 100,
        ..Qos::PUBLISHER
    };
    let echoes = other.endpoint("Echoes", &[echoes::ECHO], true, qos);
    let mut subscriber = backend.subscriber(&echoes).expect("a subscriber");
    let endpoint = other.endpoint("Reports", &[reports::REPORT], true, qos);
    let mut publisher = ReportsPublisher::new(|_| {
        let port = backend.publisher(&endpoint)?;
        Ok(TypedPublisher::new(port, reports::REPORT))
    })
    .expect("a publisher");
    until("both ends are met", || {
        publisher.subscribers() == 1 && subscriber.peers() == 1
    });
    let mut take = |limit: Duration| {
        let end = Instant::now() + limit;
        let mut found = None;
        while found.is_none() && Instant::now() < end {
            let woken = wait(&[subscriber.descriptor()], LOOK) != 0;
            subscriber.acknowledge(woken);
            let received = subscriber.receive(&mut |header: Header, body| {
                let mut reader = Reader::of(body, header.encoding);
                found = Some(reader.get::<Report>().expect("a report"));
            });
            received.expect("to receive");
        }
        found
    };
    // The component has to find the subscriber, too.
    let mut number = 0;
    until("a report comes back", || {
        number += 1;
        publisher.report(&report(-number)).expect("to be sent");
        take(Duration::from_millis(100)).is_some()
    });
    while take(Duration::from_millis(300)).is_some() {}
    for number in 1..=20 {
        publisher.report(&report(number)).expect("to be sent");
        assert_eq!(take(LIMIT), Some(report(number)));
    }
    let large = Report {
        data: vec![9; 1 << 20],
        ..report(21)
    };
    publisher.report(&large).expect("to be sent");
    assert_eq!(take(LIMIT), Some(large));
}

/// Answers as the oracle of the component, until `ends`.
fn serve(server: &mut dyn Server, told: &Sender<String>, ends: &AtomicBool) {
    while !ends.load(Ordering::Relaxed) {
        let woken = wait(&[server.descriptor()], LOOK) != 0;
        server.acknowledge(woken);
        let mut handler = |header: Header, body: &[u8], reply: &mut dyn Reply| {
            let mut request = Request::open(header, body, reply).expect("an envelope");
            let outcome = if request.operation == oracle::TELL.id {
                let text = request.arguments(&oracle::TELL, oracle::read_tell);
                let _ = told.send(text.expect("a text"));
                Ok(())
            } else {
                let question = request.arguments(&oracle::ASK, oracle::read_ask);
                match question.expect("a question").as_str() {
                    "nonsense" => {
                        let (what, code) = ("why?".to_owned(), 5);
                        let error = AskError::Nonsense(Nonsense { what, code });
                        oracle::refuse_ask(&mut request, error)
                    }
                    "refuse" => request.fail(&"not today"),
                    // Longer than the limit of the call.
                    "sleep" => {
                        std::thread::sleep(Duration::from_millis(300));
                        oracle::reply_ask(&mut request, (0, Point::default()))
                    }
                    _ => oracle::reply_ask(&mut request, (42, Point { x: 1.5, y: -2.5 })),
                }
            };
            let _ = outcome;
            request.close();
        };
        while server.serve(&mut handler).expect("to serve") {}
    }
}

fn calls_are_made(other: &OtherEnd) {
    let backend = other.join("asker");
    let mut client = other.client(&*backend);
    assert_eq!(
        client.consult("anybody?", 10_000).as_deref(),
        Ok("NoServer")
    );
    let (told, heard) = channel();
    let ends = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let served = scope.spawn(|| {
            let backend = other.join("oracle");
            let endpoint = other.endpoint("Oracle", oracle::OPERATIONS, false, Qos::CALL);
            let mut server = backend.server(&endpoint).expect("a server");
            serve(&mut *server, &told, &ends);
        });
        let stop = Stop(&ends);
        until("the component finds the oracle", || {
            client.consult("life", 10_000).as_deref() == Ok("42 at 1.5 -2.5")
        });
        assert_eq!(heard.recv_timeout(LIMIT).as_deref(), Ok("life"));
        let mut consult = |question, limit| client.consult(question, limit);
        assert_eq!(
            consult("nonsense", 10_000).as_deref(),
            Ok("nonsense 5: why?")
        );
        let refused = consult("refuse", 10_000).expect("an answer");
        assert!(
            refused.starts_with("refused: ") && refused.contains("not today"),
            "{refused}"
        );
        assert_eq!(consult("sleep", 50).as_deref(), Ok("Deadline"));
        // A late reply is none to the next question.
        assert_eq!(consult("life", 10_000).as_deref(), Ok("42 at 1.5 -2.5"));
        drop(stop);
        served.join().expect("the oracle");
    });
}

/// Ends the oracle, also after a failed assertion.
struct Stop<'a>(&'a AtomicBool);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

fn conforms(over: &'static Over) {
    let Some(other) = OtherEnd::start(over) else {
        return;
    };
    calls_are_answered(&other);
    samples_are_repeated(&other);
    calls_are_made(&other);
}

#[test]
fn a_component_in_python_conforms_over_iceoryx2() {
    conforms(&Over {
        name: rc_iceoryx2::NAME,
        domain: 0,
        connect: |environment| rc_iceoryx2::connect(environment).expect("the network"),
    });
}

#[test]
fn a_component_in_python_conforms_over_dds() {
    conforms(&Over {
        name: rc_dds::NAME,
        domain: 146,
        connect: |environment| rc_dds::connect(environment).expect("the domain"),
    });
}

#[test]
fn a_component_in_python_conforms_over_ros2() {
    conforms(&Over {
        name: rc_ros2::NAME,
        domain: 147,
        connect: |environment| rc_ros2::connect(environment, &[]).expect("the domain"),
    });
}
