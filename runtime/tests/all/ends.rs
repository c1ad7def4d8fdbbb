//! In lockstep, the calls that a component has started end in an order that their replies do not
//! decide.

use super::time::{end, network, note, script, source, until};
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{self, Operation, Request, TypedClient};
use rc_middleware::{
    Address, CallError, Endpoint, Environment, Qos, RunDirectory, Server, Settings, TypeIdentity,
    WakeEvent, wait,
};
use rc_runtime::{
    Component, Core, Description, Member, Ports, Role, Slot, StartError, Values, WorkerError, embed,
};
use std::os::fd::AsFd;
use std::thread;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(20);
/// How long the first server keeps its replies back, so that the others come before them.
const KEPT: Duration = Duration::from_millis(20);
const ROUNDS: i32 = 3;

static ASK: [Operation; 1] = [Operation::query("ask", 1, 7, &[])];
const NAMES: [&str; 2] = ["First", "Second"];

const fn slot(name: &'static str) -> Slot {
    Slot {
        name,
        role: Role::Requires,
        interface: name,
        type_name: "Test::Asked",
        type_hash: 7,
        backend: "local",
        qos: Qos::CALL,
        operations: &ASK,
        is_array: false,
        external_types: &[],
    }
}

static ASKER: Description = Description {
    name: "asker",
    model_hash: 3,
    middleware: "local",
    period: Duration::from_millis(10),
    parameters: None,
    folder: "/nowhere",
    slots: &[slot(NAMES[0]), slot(NAMES[1])],
    backends: &[rc_local::LINKED],
    types: &[],
    simulates_time: false,
    managed: false,
    note: b"",
};

struct Asker {
    core: Core,
    clients: [TypedClient; 2],
    /// They would be forgotten otherwise.
    calls: Vec<typed::Call<i32, CallError>>,
    rounds: i32,
}

impl Asker {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self {
            core,
            clients: [ports.client(0)?, ports.client(1)?],
            calls: Vec::new(),
            rounds: 0,
        })
    }
}

impl Component for Asker {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        if self.rounds == ROUNDS {
            return Ok(());
        }
        self.rounds += 1;
        // The second slot first: neither this order nor that of the replies decides.
        for (at, number) in [(1, 1), (0, 2), (1, 3), (0, 4)] {
            let call = self.clients[at].start(&ASK[0], (&number,));
            self.calls.push(call?);
        }
        Ok(())
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        for (peers, client) in peers.iter_mut().zip(&self.clients) {
            *peers = client.peers();
        }
    }

    fn starts_calls(&self, _: usize) -> bool {
        true
    }

    fn end_call(&mut self, slot: usize, _: Option<&Member>) -> bool {
        let (core, client) = (&self.core, &mut self.clients[slot]);
        let ended = client.poll_with(|ended| {
            let result = ended.result::<i32, CallError>();
            note(core, format!("{slot} {result:?}"));
        });
        ended.is_some()
    }

    fn end_in_order(&mut self, slot: usize, _: Option<&Member>, keeps: bool) {
        self.clients[slot].end_in_order(keeps);
    }

    fn awaiting(&mut self, slot: usize, _: Option<&Member>) -> Option<Awaiting<'_>> {
        self.clients[slot].awaiting()
    }
}

/// Answers with the number it gets, until `stop`.
fn serve(server: &mut dyn Server, stop: &WakeEvent, before: impl Fn()) {
    let mut woken = true;
    while !stop.is_stopping() {
        server.acknowledge(woken);
        let mut next = || {
            server.serve_message(&mut |header, message, reply| {
                let request = Request::open_message(header, &message, reply);
                let mut request = request.expect("an envelope");
                before();
                let same = |(number,): (i32,)| number;
                let answered = request.answer(&ASK[0], typed::read, typed::reply, same);
                answered.expect("a number");
                request.close();
            })
        };
        while next().expect("requests") {}
        woken = wait(&[server.descriptor(), stop.as_fd()], LIMIT) & 1 != 0;
    }
}

#[test]
fn in_lockstep_started_calls_end_by_slots_and_in_the_order_of_their_start() {
    let network = network("ends");
    let stop = WakeEvent::new().expect("an event");
    let backend = |instance: &str| {
        rc_local::connect(&Environment {
            network: network.clone(),
            instance: instance.to_owned(),
            directory: RunDirectory::of(&network),
            wake_event: WakeEvent::new().expect("an event"),
            settings: Settings::default(),
        })
        .expect("the network")
    };
    let seconds = |network: &str| {
        script(network, |script| {
            let trace = script.trace.iter();
            trace.filter(|(_, _, what)| what.starts_with('1')).count()
        })
    };
    thread::scope(|scope| {
        let (open, opened) = std::sync::mpsc::channel();
        for (at, name) in NAMES.into_iter().enumerate() {
            let (open, stop, network) = (open.clone(), &stop, &network);
            scope.spawn(move || {
                let backend = backend(name);
                let server = backend.server(&Endpoint {
                    address: Address::parse(&format!("{network}/{name}")).expect("an address"),
                    types: TypeIdentity {
                        name: "Test::Asked".to_owned(),
                        hash: 7,
                    },
                    qos: Qos::CALL,
                    external_types: Vec::new(),
                });
                open.send(()).expect("the test");
                serve(&mut *server.expect("a server"), stop, || {
                    let (begin, before) = (Instant::now(), seconds(network));
                    // An end of the second slot would end the wait at once.
                    while at == 0 && seconds(network) == before && begin.elapsed() < KEPT {
                        thread::yield_now();
                    }
                });
            });
        }
        for _ in NAMES {
            opened.recv().expect("a server");
        }
        script(&network, |script| script.ticks = 20);
        let source = source(&network, "source", &["--followers", "asker"]);
        let args = [
            "--network",
            &network,
            "--name",
            "asker",
            "--clock",
            "simulated",
        ];
        let asker = embed(&ASKER, Asker::start, &args).expect("a follower");
        until(&network, |script| script.trace.len() == 4 * ROUNDS as usize);
        end([asker, source]);
        stop.stop();
    });
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    let ends: Vec<&str> = trace.iter().map(|(_, _, what)| what.as_str()).collect();
    for round in ends.chunks(4) {
        assert_eq!(round, ["0 Ok(2)", "0 Ok(4)", "1 Ok(1)", "1 Ok(3)"]);
    }
}
