//! A follower, and a source in lockstep, hold tick 0 until they have found the servers and publishers
//! that they need.

use super::time::{end, network, note, script, slot, source, until, until_status};
use rc_middleware::Qos;
use rc_middleware::typed::{TypedClient, TypedPublisher};
use rc_runtime::{
    Component, Core, Description, Embedded, Ports, Role, Slot, StartError, TimeSource, Values,
    WorkerError, embed,
};
use std::time::Duration;

const fn described(name: &'static str, slots: &'static [Slot]) -> Description {
    Description {
        name,
        model_hash: 3,
        middleware: "local",
        period: Duration::from_millis(10),
        parameters: None,
        folder: "/nowhere",
        slots,
        backends: &[rc_local::LINKED],
        types: &[],
        simulates_time: false,
        managed: false,
        converter: None,
        note: b"",
    }
}

static CALLER: Description = described("follower", &[VALUES_REQUIRED]);
static SERVER: Description = described("other", &[slot("Values", Role::Implements, Qos::CALL)]);
static LISTENER: Description = described("follower", &[VALUES_SUBSCRIBED]);
static PUBLISHER: Description = described("other", &[VALUES_PUBLISHED]);

static CALLING_SOURCE: Description = Description {
    simulates_time: true,
    ..described("source", &[VALUES_REQUIRED])
};

const VALUES_REQUIRED: Slot = slot("Values", Role::Requires, Qos::CALL);
const VALUES_SUBSCRIBED: Slot = slot("Values", Role::SubscribesTo, Qos::SUBSCRIBER);
const VALUES_PUBLISHED: Slot = slot("Values", Role::Publishes, Qos::PUBLISHER);

/// The sending end of a component, if it has one.
enum End {
    Client(TypedClient),
    Publisher(TypedPublisher),
    None,
}

impl End {
    fn peers(&self) -> usize {
        match self {
            Self::Client(client) => client.peers(),
            Self::Publisher(publisher) => publisher.peers(),
            Self::None => 0,
        }
    }
}

/// Notes in each `compute()` how many peers its sending end has.
struct Worker {
    core: Core,
    end: End,
}

impl Worker {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        let end = match core.name() {
            "caller" => End::Client(ports.client(0)?),
            "publisher" => End::Publisher(ports.publisher(0, 0)?),
            _ => End::None,
        };
        Ok(Self { core, end })
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        if matches!(self.core.name(), "caller" | "listener") {
            note(&self.core, format!("peers: {}", self.end.peers()));
        }
        Ok(())
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        if !matches!(self.end, End::None) {
            peers[0] = self.end.peers();
        }
    }
}

fn component(of: &'static Description, network: &str, name: &str, clock: &str) -> Embedded {
    let args = ["--network", network, "--name", name, "--clock", clock];
    embed(of, Worker::start, &args).expect("a component")
}

/// Runs three ticks, and returns what the follower noted in them. The other component, if there is
/// one, starts when the follower has been running for a while.
fn run(
    network: &str,
    follower: (&'static Description, &str),
    other: Option<(&'static Description, &str)>,
) -> Vec<String> {
    script(network, |script| script.ticks = 3);
    let source = source(network, "source", &["--followers", follower.1]);
    let mut components = vec![component(follower.0, network, follower.1, "simulated")];
    if let Some((description, name)) = other {
        until_status(network, follower.1, |status| {
            status["uptime_s"].as_f64() > Some(0.3)
        });
        assert_eq!(script(network, |script| script.last_tick), 0);
        components.push(component(description, network, name, "system"));
    }
    until(network, |script| script.last_tick == 3);
    end(components.into_iter().chain([source]));
    let trace = script(network, |script| std::mem::take(&mut script.trace));
    trace.into_iter().map(|(_, _, what)| what).collect()
}

#[test]
fn time_begins_when_the_servers_are_found() {
    let (caller, server) = ((&CALLER, "caller"), (&SERVER, "server"));
    let seen = run(&network("servers"), caller, Some(server));
    assert_eq!(seen, ["peers: 1"; 3]);
}

#[test]
fn time_begins_when_the_publishers_are_found() {
    let (listener, publisher) = ((&LISTENER, "listener"), (&PUBLISHER, "publisher"));
    let seen = run(&network("publishers"), listener, Some(publisher));
    assert_eq!(seen.len(), 3);
}

#[test]
fn time_begins_without_a_server_that_does_not_come() {
    let seen = run(&network("no_servers"), (&CALLER, "caller"), None);
    assert_eq!(seen, ["peers: 0"; 3]);
}

/// A source of time that is itself a client. Notes in each tick how many servers it has.
struct CallingSource {
    core: Core,
    time: TimeSource,
    client: TypedClient,
}

impl CallingSource {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        let mut time = ports.time_source();
        time.wait_for_all(Duration::from_secs(20));
        let client = ports.client(0)?;
        Ok(Self { core, time, client })
    }
}

impl Component for CallingSource {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        if self.time.tick() < 3 {
            note(&self.core, format!("peers: {}", self.client.peers()));
            self.time.advance(Duration::from_millis(10))?;
        }
        Ok(())
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        peers[0] = self.client.peers();
    }
}

#[test]
fn a_source_in_lockstep_waits_for_its_servers() {
    let network = network("calling");
    let args = ["--network", &network, "--name", "calling"];
    let source = embed(&CALLING_SOURCE, CallingSource::start, &args).expect("a source");
    until_status(&network, "calling", |status| {
        status["uptime_s"].as_f64() > Some(0.3)
    });
    assert_eq!(script(&network, |script| script.trace.len()), 0);
    let server = component(&SERVER, &network, "server", "system");
    until(&network, |script| script.trace.len() == 3);
    end([server, source]);
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    assert!(
        trace.iter().all(|(_, _, what)| what == "peers: 1"),
        "{trace:?}"
    );
}
