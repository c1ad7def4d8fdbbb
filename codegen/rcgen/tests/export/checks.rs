//! Compares the bytes of a generated component with those of a Python program; run by
//! `tests/export.rs`. The file `EXPORTED_SAMPLES` contains the bytes of the program. The test
//! writes those of the component to `EXPORTED_OURS`.

use exported_generated::{
    AskError, Balance, Busy, Context, Desk, Gone, Heard, Mode, Nothing, Point, Reading, Worker,
    WorkerError,
};
use rc_runtime::middleware::{
    Address, Endpoint, Environment, Header, Qos, Reply, RunDirectory, Settings, TypeIdentity,
    WakeEvent, wait,
};
use std::collections::BTreeMap;
use std::io::Write;
use std::sync::OnceLock;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(20);

/// The events in the component.
static EVENTS: OnceLock<Sender<&'static str>> = OnceLock::new();

fn happened(event: &'static str) {
    let events = EVENTS.get().expect("a test");
    events.send(event).expect("a test that listens");
}

fn reading() -> Reading {
    let point = |x, y| Point { x, y };
    Reading {
        valid: true,
        raw: 200,
        s: -2,
        i: -70_000,
        l: -(1 << 40),
        f: 0.5,
        d: -0.1,
        i8: -128,
        u16: 65_535,
        u32: 4_000_000_000,
        u64: u64::MAX,
        frame: "base/lidar".to_owned(),
        text: "größer als 5 €".to_owned(),
        ranges: vec![1.0, 2.5, -3.25],
        mode: Mode::Fast,
        balance: Balance::Minus,
        origin: point(1.5, -2.5),
        path: vec![point(0.25, 1.0), point(0.5, 2.0)],
        places: BTreeMap::from([
            ("dock".to_owned(), point(1.0, 2.0)),
            ("door".to_owned(), point(3.0, 4.0)),
        ]),
        counts: BTreeMap::from([(Mode::Idle, 1), (Mode::Slow, -1)]),
        count: Some(7),
        goal: None,
        matrix: [1.0, 2.0, 3.0],
        tags: ["ab".to_owned(), String::new()],
        corners: [point(0.0, 0.0), point(8.0, 9.0)],
        rows: vec![vec![1, 2, 3], vec![], vec![-1]],
        flags: vec![true, false, true],
        modes: vec![Mode::Slow, Mode::Idle],
        nothing: Nothing {},
        last: 255,
    }
}

fn busy() -> AskError {
    AskError::Busy(Busy {
        level: 3,
        who: "me".to_owned(),
        seconds: 1.5,
    })
}

/// Sends every message once, and expects the messages of the program.
struct Talker {
    said: bool,
}

impl Worker<Context> for Talker {
    fn initialize(_: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self { said: false })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if self.said {
            return Ok(());
        }
        self.said = true;
        let answer = ctx.asked.ask(&reading(), "stranger", &Some(Mode::Slow));
        assert_eq!(answer, Ok((reading(), vec![1, 2, 3])));
        assert_eq!(ctx.asked.ask(&reading(), "busy", &None), Err(busy()));
        let gone = ctx.asked.ask(&reading(), "gone", &None);
        assert_eq!(gone, Err(AskError::Gone(Gone {})));
        ctx.asked.turn(-0.5).expect("a server");
        ctx.asked.rest().expect("an answer");
        ctx.said.told(&reading(), 77).expect("a topic");
        ctx.said.nothing().expect("a topic");
        happened("said");
        Ok(())
    }
}

impl Desk<Context> for Talker {
    fn ask(
        &mut self,
        _: &mut Context,
        asked: Reading,
        who: String,
        mode: Option<Mode>,
    ) -> Result<(Reading, Vec<u8>), AskError> {
        assert_eq!(asked, reading());
        match (who.as_str(), mode) {
            ("stranger", Some(Mode::Slow)) => Ok((reading(), vec![1, 2, 3])),
            ("busy", None) => Err(busy()),
            ("gone", None) => Err(AskError::Gone(Gone {})),
            other => panic!("{other:?}"),
        }
    }

    fn turn(&mut self, _: &mut Context, speed: f64) {
        assert_eq!(speed, -0.5);
        happened("turned");
    }

    fn rest(&mut self, _: &mut Context) {}
}

impl Heard<Context> for Talker {
    fn told(&mut self, _: &mut Context, told: Reading, tail: u8) {
        assert_eq!((told, tail), (reading(), 77));
        happened("told");
    }

    fn nothing(&mut self, _: &mut Context) {
        happened("nothing");
    }
}

/// The first type hash after `place` in generated code.
fn hash(text: &str, place: &str) -> u64 {
    let behind = text.split_once(place).expect(place).1;
    let behind = behind.split_once("0x").expect("a hash").1;
    u64::from_str_radix(&behind[..16], 16).expect("sixteen digits")
}

fn endpoint(address: String, name: &str, hash: u64) -> Endpoint {
    Endpoint {
        address: Address::parse(&address).expect("an address"),
        types: TypeIdentity {
            name: name.to_owned(),
            hash,
        },
        qos: Qos::CALL,
        external_types: Vec::new(),
    }
}

/// The bytes of the program, by name.
fn samples() -> BTreeMap<String, Vec<u8>> {
    let file = std::env::var("EXPORTED_SAMPLES").expect("a file of samples");
    let text = std::fs::read_to_string(file).expect("samples");
    let line = |line: &str| {
        let (name, hex) = line.split_once(' ').expect("a name and bytes");
        let byte = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).expect("bytes");
        let bytes = (0..hex.len()).step_by(2).map(byte).collect();
        (name.to_owned(), bytes)
    };
    text.lines().map(line).collect()
}

/// The length of the request identity at the start of requests and replies.
const IDENTITY: usize = 24;

/// Replies to the request of the component with the program's bytes. Returns the request.
fn answer(
    samples: &BTreeMap<String, Vec<u8>>,
    request: &[u8],
    reply: &mut Vec<u8>,
) -> (String, Vec<u8>) {
    let asked = samples.iter().find(|(_, sample)| {
        sample.len() == request.len() && sample[IDENTITY..] == request[IDENTITY..]
    });
    let name = asked.expect("a request of the stranger, too").0;
    if let Some(sample) = samples.get(&name.replace("request", "reply"))
        && name != "command"
    {
        reply.extend_from_slice(&request[..IDENTITY]);
        reply.extend_from_slice(&sample[IDENTITY..]);
    }
    (name.clone(), request.to_vec())
}

#[test]
fn both_sides_write_the_same_bytes() {
    let samples = samples();
    let network = format!("exported_{}", std::process::id());
    let directory = RunDirectory::open(&network).expect("a run directory");
    let environment = Environment {
        network: network.clone(),
        instance: "stranger".to_owned(),
        directory: directory.clone(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings: Settings::default(),
    };
    let backend = rc_local::connect(&environment).expect("a backend");
    let desk = hash(include_str!("../generated/src/description.rs"), "SLOT_DESK");
    let news = include_str!("../../../interfaces/generated/src/exported.rs");
    let topic = |operation: &str, constant: &str| {
        let address = format!("{network}/News/{operation}");
        let name = format!("Exported::News/{operation}");
        endpoint(address, &name, hash(news, constant))
    };
    let (told, nothing) = (topic("told", "on_told "), topic("nothing", "on_nothing "));
    let mut hears = [&told, &nothing].map(|topic| backend.subscriber(topic).expect("a topic"));
    let other = endpoint(format!("{network}/Other"), "Exported::Desk", desk);
    let mut server = backend.server(&other).expect("a server");

    let (send, events) = channel();
    EVENTS.set(send).expect("one test");
    let component = exported_generated::embed::<Talker>(&[
        "--network",
        &network,
        "--bind",
        &format!("asked={network}/Other"),
    ]);
    let component = component.expect("a component");
    let mut ours = Vec::new();
    let end = Instant::now() + LIMIT;
    while ours.len() < 5 {
        let alive = !component.has_ended() && Instant::now() < end;
        assert!(alive, "five calls were to come: {ours:?}");
        wait(&[server.descriptor()], Duration::from_millis(50));
        server.acknowledge(true);
        let mut serve = |_: Header, request: &[u8], reply: &mut dyn Reply| {
            ours.push(answer(&samples, request, reply.body()));
        };
        while server.serve(&mut serve).expect("requests") {}
    }
    let expected = [
        "request",
        "refused-request",
        "gone-request",
        "command",
        "rest-request",
    ];
    let names: Vec<&str> = ours.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, expected);

    let until_all = |mut wanted: Vec<&str>| {
        while !wanted.is_empty() {
            let event = events.recv_timeout(LIMIT).expect("what is to happen");
            let at = wanted.iter().position(|w| *w == event);
            wanted.remove(at.unwrap_or_else(|| panic!("{event} once too often")));
        }
    };
    until_all(vec!["said", "told", "nothing"]);
    for (hears, name) in hears.iter_mut().zip(["topic", "empty-topic"]) {
        let mut take = |_: Header, body: &[u8]| ours.push((name.to_owned(), body.to_vec()));
        assert!(hears.receive(&mut take).expect("a value"));
        let (_, body) = ours.last().expect("what was taken");
        assert_eq!(*body, samples[name], "{name}");
    }

    // The other way round: the stranger asks and tells.
    let mut client = backend
        .client(&endpoint(format!("{network}/Desk"), "Exported::Desk", desk))
        .expect("a client");
    for name in ["", "refused-", "gone-", "rest-", "unknown-"] {
        let (request, reply) = (format!("{name}request"), format!("{name}reply"));
        let mut answered = Vec::new();
        client
            .call(
                Header::default(),
                &samples[&request],
                LIMIT,
                &mut |_, body| {
                    answered = body.to_vec();
                },
            )
            .expect("an answer");
        // Why something is refused is ours to say.
        if name != "unknown-" {
            assert_eq!(answered, samples[&reply], "{reply}");
        }
        ours.push((reply, answered));
    }
    let command = client.send(Header::default(), &samples["command"]);
    command.expect("a server");
    for (topic, name) in [(&told, "topic"), (&nothing, "empty-topic")] {
        let mut publisher = backend.publisher(topic).expect("a topic");
        let sent = publisher.publish(Header::default(), &samples[name]);
        sent.expect("a subscriber");
    }
    until_all(vec!["turned", "told", "nothing"]);
    component.stop();
    component.join().expect("an orderly end");
    drop((hears, server, client, backend));
    directory.remove().expect("to remove the run directory");

    let file = std::env::var("EXPORTED_OURS").expect("a file to write");
    let mut file = std::fs::File::create(file).expect("a file");
    for (name, bytes) in ours {
        let hex: String = bytes.iter().map(|b| format!("{b:02x}")).collect();
        writeln!(file, "{name} {hex}").expect("to write");
    }
}
