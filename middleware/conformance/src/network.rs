//! A network for one test, its components, and functions that wait for events in it.

use crate::Subject;
use crate::envelope::Enveloping;
use rc_middleware::{
    Address, Backend, Client, Endpoint, Environment, ExternalType, Header, Qos, Reply,
    RunDirectory, Server, Settings, Subscriber, TypeIdentity, WakeEvent, wait,
};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// Longest wait for an event. Only a fault lets it pass, on a loaded machine, too.
pub const LIMIT: Duration = Duration::from_mins(2);
/// Longest wait for a descriptor before a test looks into the queue, as the runtime does.
pub(crate) const CYCLE: Duration = Duration::from_millis(50);

/// The handler of a server under test: header, request, reply.
pub type Handler<'a> = dyn Fn(Header, &[u8], &mut Vec<u8>) + 'a;

static NETWORKS: AtomicU32 = AtomicU32::new(0);

/// Lets this process open as many files as the system allows: tests with tens of clients in one
/// process need more than the usual soft limit of 1024.
pub fn raise_descriptor_limit() {
    let maximum = getrlimit(Resource::Nofile).maximum;
    let current = maximum;
    // A test that needs more than is allowed fails by itself.
    let _ = setrlimit(Resource::Nofile, Rlimit { current, maximum });
}

/// A separate network. Dropping it fails the test if anything is left of it.
pub struct Network<'a> {
    subject: &'a dyn Subject,
    name: String,
    directory: RunDirectory,
}

impl<'a> Network<'a> {
    /// A new network.
    pub fn new(subject: &'a dyn Subject) -> Self {
        raise_descriptor_limit();
        let number = NETWORKS.fetch_add(1, Ordering::Relaxed);
        let name = format!("t{number}-{}", std::process::id());
        let directory = RunDirectory::open(&name).expect("a run directory");
        Self {
            subject,
            name,
            directory,
        }
    }

    /// Waits until ends know each other, where they do not as soon as they are open.
    pub(crate) fn meet(&self, known: impl FnMut() -> bool) {
        if !self.subject.meets_at_once() {
            until("the ends know each other", known);
        }
    }

    /// Opens a client of a server that is there, and lets both meet.
    pub(crate) fn client(&self, backend: &dyn Backend, address: &Endpoint) -> Box<dyn Client> {
        let client = backend.client(address).expect("a client");
        self.meet(|| client.peers() == 1);
        client
    }

    /// The environment of a component called `instance`.
    pub fn environment(&self, instance: &str) -> Environment {
        Environment {
            network: self.name.clone(),
            instance: instance.to_owned(),
            directory: self.directory.clone(),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings: Settings::default(),
        }
    }

    /// Connects a component called `instance` for the calling thread. Requests and replies may be
    /// any bytes.
    pub fn join(&self, instance: &str) -> Box<dyn Backend> {
        self.join_as(&self.environment(instance))
    }

    /// Connects the component of `environment` for the calling thread.
    pub fn join_as(&self, environment: &Environment) -> Box<dyn Backend> {
        let backend = self.subject.connect(environment).expect("the network");
        Box::new(Enveloping(backend))
    }

    /// [`Network::join`], with requests and replies in envelopes.
    pub fn join_bare(&self, instance: &str) -> Box<dyn Backend> {
        let environment = self.environment(instance);
        self.subject.connect(&environment).expect("the network")
    }

    /// Runs `body` while a component called `server` serves `endpoint` with `handler`. Messages may
    /// be any bytes.
    pub fn serving<R>(
        &self,
        endpoint: &Endpoint,
        handler: impl Fn(Header, &[u8], &mut Vec<u8>) + Sync,
        body: impl FnOnce() -> R,
    ) -> R {
        let handler = |header: Header, request: &[u8], reply: &mut dyn Reply| {
            handler(header, request, reply.body());
        };
        serving_on(&|| self.join("server"), endpoint, handler, body)
    }

    /// [`Network::serving`], with requests and replies in envelopes.
    pub fn serving_bare<R>(
        &self,
        endpoint: &Endpoint,
        handler: impl Fn(Header, &[u8], &mut dyn Reply) + Sync,
        body: impl FnOnce() -> R,
    ) -> R {
        serving_on(&|| self.join_bare("server"), endpoint, handler, body)
    }
}

fn serving_on<R>(
    join: &(dyn Fn() -> Box<dyn Backend> + Sync),
    endpoint: &Endpoint,
    handler: impl Fn(Header, &[u8], &mut dyn Reply) + Sync,
    body: impl FnOnce() -> R,
) -> R {
    let stop = WakeEvent::new().expect("a wake event");
    std::thread::scope(|scope| {
        let (ready, is_ready) = channel();
        let (stop, handler) = (&stop, &handler);
        scope.spawn(move || {
            let backend = join();
            let mut server = backend.server(endpoint).expect("a server");
            ready.send(()).expect("a test that waits");
            serve_replies_until(&mut *server, stop, handler);
            backend.linger(LIMIT);
        });
        let _stop = StopOnDrop(stop);
        is_ready.recv_timeout(LIMIT).expect("a server");
        body()
    })
}

impl Drop for Network<'_> {
    fn drop(&mut self) {
        let left = self.subject.leftovers(&self.directory);
        self.subject.wipe(&self.directory);
        let removed = self.directory.remove();
        if !std::thread::panicking() {
            assert!(left.is_empty(), "left behind: {left:?}");
            removed.expect("a run directory that can be removed");
        }
    }
}

/// A domain of DDS for a network of this suite, `tNUMBER-PID`: the networks of one test have different
/// ones. Other tests use 0 to 19, and another run on the same machine begins elsewhere.
pub fn domain(network: &str) -> i64 {
    let mut numbers = network.trim_start_matches('t').split('-');
    let mut number = || numbers.next().and_then(|n| n.parse::<i64>().ok());
    let (number, pid) = (number().unwrap_or_default(), number().unwrap_or_default());
    20 + (number + 37 * pid) % 80
}

/// Stops what waits for a wake event, also when a test fails.
pub struct StopOnDrop<'a>(pub &'a WakeEvent);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.stop();
    }
}

/// The operations of these tests, each with its discriminator.
const OPERATIONS: [(&str, i32); 4] = [("any", 5), ("divide", 11), ("note", 12), ("scan", 21)];

fn external((operation, id): (&str, i32)) -> ExternalType {
    ExternalType {
        slot: "Test".to_owned(),
        operation: operation.to_owned(),
        id,
        type_name: format!("conformance_msgs/srv/{operation}"),
    }
}

/// An endpoint with the defaults of publishers and calls.
pub fn endpoint(address: &str) -> Endpoint {
    Endpoint {
        address: Address::parse(address).expect("an address"),
        types: TypeIdentity {
            name: "Test::Types".to_owned(),
            hash: 7,
        },
        qos: Qos::PUBLISHER,
        external_types: OPERATIONS.map(external).to_vec(),
    }
}

/// `endpoint` with another depth.
pub fn keep_last(depth: u32, endpoint: &Endpoint) -> Endpoint {
    let mut endpoint = endpoint.clone();
    endpoint.qos.depth = depth;
    endpoint
}

/// The header of the message `sequence`.
pub fn header(sequence: u64) -> Header {
    Header {
        type_hash: 7,
        sequence,
        sent: rc_middleware::now(),
        ..Header::default()
    }
}

/// Serves until `stop` stops, and then the requests that are left.
pub fn serve_until(server: &mut dyn Server, stop: &WakeEvent, handler: &Handler<'_>) {
    serve_replies_until(server, stop, &|header, request, reply| {
        handler(header, request, reply.body());
    });
}

/// [`serve_until`] with a handler that may lend memory for its reply.
pub fn serve_replies_until(
    server: &mut dyn Server,
    stop: &WakeEvent,
    handler: &dyn Fn(Header, &[u8], &mut dyn Reply),
) {
    let mut woken = false;
    loop {
        let last = stop.is_stopping();
        server.acknowledge(woken);
        while server
            .serve(&mut |header, body, reply| handler(header, body, reply))
            .expect("requests")
        {}
        if last {
            return;
        }
        woken = wait(&[server.descriptor(), stop.as_fd()], CYCLE) & 1 != 0;
    }
}

/// Serves `count` requests; gives their bodies.
pub fn serve(server: &mut dyn Server, count: usize, handler: &Handler<'_>) -> Vec<Vec<u8>> {
    let mut bodies = Vec::new();
    let end = Instant::now() + LIMIT;
    while bodies.len() < count {
        assert!(
            Instant::now() < end,
            "{} of {count} requests came",
            bodies.len()
        );
        let woken = wait(&[server.descriptor()], CYCLE) != 0;
        server.acknowledge(woken);
        while bodies.len() < count
            && server
                .serve(&mut |header, body, reply| {
                    bodies.push(body.to_vec());
                    handler(header, body, reply.body());
                })
                .expect("requests")
        {}
    }
    bodies
}

/// Receives `count` samples.
pub fn receive(subscriber: &mut dyn Subscriber, count: usize) -> Vec<(Header, Vec<u8>)> {
    let mut values = Vec::new();
    let end = Instant::now() + LIMIT;
    while values.len() < count {
        assert!(
            Instant::now() < end,
            "{} of {count} values came: {:?}",
            values.len(),
            values.iter().map(|(header, _)| header).collect::<Vec<_>>()
        );
        let woken = wait(&[subscriber.descriptor()], CYCLE) != 0;
        subscriber.acknowledge(woken);
        while values.len() < count && take(subscriber, &mut values) {}
    }
    values
}

/// Receives the samples that are there.
pub fn receive_all(subscriber: &mut dyn Subscriber) -> Vec<(Header, Vec<u8>)> {
    let mut values = Vec::new();
    subscriber.acknowledge(false);
    while take(subscriber, &mut values) {}
    values
}

fn take(subscriber: &mut dyn Subscriber, values: &mut Vec<(Header, Vec<u8>)>) -> bool {
    subscriber
        .receive(&mut |header, body| values.push((header, body.to_vec())))
        .expect("values")
}

/// The sequence numbers of samples.
pub fn sequences(values: &[(Header, Vec<u8>)]) -> Vec<u64> {
    values.iter().map(|(header, _)| header.sequence).collect()
}

/// Waits until `condition` holds.
pub fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let end = Instant::now() + LIMIT;
    while !condition() {
        assert!(Instant::now() < end, "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}
