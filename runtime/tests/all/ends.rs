//! The ends of calls that a component has started: in lockstep, in an order that their replies do
//! not decide; and in the window of a worker.

use super::time::{VALUE, end, network, note, script, slot as topic, source, until, until_status};
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{self, HandlerError, Operation, Request, TypedClient, TypedPublisher};
use rc_middleware::{
    Address, Backend, CallError, Endpoint, Environment, Qos, RunDirectory, Server, Settings,
    TypeIdentity, WakeEvent, wait,
};
use rc_runtime::{
    CallEnd, Component, Core, Description, Member, Ports, Role, Sample, Slot, StartError, Values,
    WorkerError, embed,
};
use serde_json::Value;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(20);
/// A turn of the loop asks a client less often for what it awaits.
const LOOKS_A_TURN: usize = 12;
const ROUNDS: usize = 3;
const CHAIN: i32 = 100;
/// One more than the handlers of a round, and some.
const SAMPLES: i32 = 70;
const BRIEF: Duration = Duration::from_millis(1);
const COMPUTES: usize = 20;

static ASK: [Operation; 1] = [Operation::query("ask", 1, 7, &[])];
const NAMES: [&str; 2] = ["First", "Second"];

const fn slot(name: &'static str, timeout: Duration) -> Slot {
    Slot {
        name,
        role: Role::Requires,
        interface: name,
        type_name: "Test::Asked",
        type_hash: 7,
        backend: "local",
        qos: Qos {
            timeout,
            ..Qos::CALL
        },
        operations: &ASK,
        is_array: false,
        external_types: &[],
    }
}

const fn asker(slots: &'static [Slot]) -> Description {
    Description {
        name: "asker",
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

static ASKER: Description = asker(&[slot(NAMES[0], LIMIT), slot(NAMES[1], LIMIT)]);
static HASTY: Description = asker(&[slot(NAMES[0], LIMIT), slot(NAMES[1], BRIEF)]);
static LISTENER: Description = asker(&[
    slot(NAMES[0], LIMIT),
    slot(NAMES[1], LIMIT),
    topic(
        "In",
        Role::SubscribesTo,
        Qos {
            depth: 100,
            ..Qos::SUBSCRIBER
        },
    ),
]);

/// Does what its name says.
struct Asker {
    core: Core,
    clients: [TypedClient; 2],
    /// They would be forgotten otherwise.
    calls: Vec<typed::Call<i32, CallError>>,
    rounds: usize,
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

    fn ask(&mut self, slot: usize, number: i32) -> Result<(), CallError> {
        let call = self.clients[slot].start(&ASK[0], (&number,))?;
        self.calls.push(call);
        Ok(())
    }

    /// Asks, and waits until the reply is there.
    fn ask_and_wait(&mut self, slot: usize, number: i32) -> Result<(), CallError> {
        let before = script(self.core.network(), |script| script.replies[slot]);
        self.ask(slot, number)?;
        until(self.core.network(), |script| script.replies[slot] > before);
        Ok(())
    }
}

impl Component for Asker {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.rounds += 1;
        let numbers: &[(usize, i32)] = match (self.core.name(), self.rounds) {
            // The second slot first: neither this order nor that of the replies decides.
            ("rounds", 1..=ROUNDS) => &[(1, 1), (0, 2), (1, 3), (0, 4)],
            ("chain", 1) => &[(0, 1)],
            ("samples", 1) => &[(0, 0)],
            ("deadline", 1) => &[(0, 1), (1, 2)],
            ("deadline", 2) => {
                note(&self.core, "compute".to_owned());
                until(self.core.network(), |script| script.goes_on);
                &[(1, 3)]
            }
            _ => &[],
        };
        if self.core.name() == "samples" {
            note(&self.core, "compute".to_owned());
        }
        for (slot, number) in numbers {
            self.ask(*slot, *number)?;
        }
        Ok(())
    }

    fn receive(
        &mut self,
        _: usize,
        _: Option<&Member>,
        _: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        let number: i32 = sample.reader().get()?;
        let asked = match number {
            1 => self.ask_and_wait(1, 1),
            65 => self.ask_and_wait(0, 65),
            _ => return Ok(()),
        };
        note(&self.core, format!("sample {number}"));
        asked.map_err(|error| HandlerError(error.to_string()))
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        for (peers, client) in peers.iter_mut().zip(&self.clients) {
            *peers = client.peers();
        }
    }

    fn starts_calls(&self, _: usize) -> bool {
        true
    }

    fn end_call(&mut self, slot: usize, _: Option<&Member>) -> Option<CallEnd> {
        let (end, result) = self.clients[slot]
            .poll_with(|ended| (CallEnd::of(&ended), ended.result::<i32, CallError>()))?;
        note(&self.core, format!("{slot} {result:?}"));
        if self.core.name() == "chain"
            && let Ok(number @ 1..CHAIN) = result
        {
            // The reply to 10 comes when the loop has turned.
            let asked = if number == 9 {
                self.ask(0, number + 1)
            } else {
                self.ask_and_wait(0, number + 1)
            };
            asked.expect("room for a call");
        }
        Some(end)
    }

    fn end_in_order(&mut self, slot: usize, _: Option<&Member>, keeps: bool) {
        self.clients[slot].end_in_order(keeps);
    }

    fn awaiting(&mut self, slot: usize, _: Option<&Member>) -> Option<Awaiting<'_>> {
        script(self.core.network(), |script| script.looks += 1);
        self.clients[slot].awaiting()
    }
}

/// Waits until the loop has turned.
fn turn(network: &str) {
    let before = script(network, |script| script.looks);
    until(network, |script| script.looks >= before + LOOKS_A_TURN);
}

/// Answers with the number it gets, until `stop`. `before` runs before each reply.
fn serve(server: &mut dyn Server, stop: &WakeEvent, mut before: impl FnMut(i32), after: impl Fn()) {
    let mut woken = true;
    while !stop.is_stopping() {
        server.acknowledge(woken);
        let mut next = || {
            server.serve_message(&mut |header, message, reply| {
                let request = Request::open_message(header, &message, reply);
                let mut request = request.expect("an envelope");
                let same = |(number,): (i32,)| {
                    before(number);
                    number
                };
                let answered = request.answer(&ASK[0], typed::read, typed::reply, same);
                answered.expect("a number");
                request.close();
            })
        };
        while next().expect("requests") {
            after();
        }
        woken = wait(&[server.descriptor(), stop.as_fd()], LIMIT) & 1 != 0;
    }
}

fn connect(network: &str, instance: &str) -> Box<dyn Backend> {
    rc_local::connect(&Environment {
        network: network.to_owned(),
        instance: instance.to_owned(),
        directory: RunDirectory::of(network),
        wake_event: WakeEvent::new().expect("an event"),
        settings: Settings::default(),
    })
    .expect("the network")
}

fn endpoint(address: &str, name: &str, qos: Qos) -> Endpoint {
    Endpoint {
        address: Address::parse(address).expect("an address"),
        types: TypeIdentity {
            name: name.to_owned(),
            hash: 7,
        },
        qos,
        external_types: Vec::new(),
    }
}

/// Stops the servers, also when a test fails.
struct StopOnDrop<'a>(&'a WakeEvent);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.stop();
    }
}

/// The actions of a component of this name while `meanwhile` waits: times and steps. `before` runs
/// before the replies of each server, whose place it gets.
fn run(
    description: &'static Description,
    name: &str,
    before: impl Fn(&str, usize, i32, &mut TypedPublisher) + Sync,
    meanwhile: impl FnOnce(&str),
) -> Vec<(u64, String)> {
    let network = network(&format!("ends_{name}"));
    let stop = WakeEvent::new().expect("an event");
    thread::scope(|scope| {
        let _stop = StopOnDrop(&stop);
        let (open, opened) = mpsc::channel();
        for (at, server) in NAMES.into_iter().enumerate() {
            let (open, stop, network, before) = (open.clone(), &stop, &network, &before);
            scope.spawn(move || {
                let address = format!("{network}/{server}");
                let backend = connect(network, server);
                let server = backend.server(&endpoint(&address, "Test::Asked", Qos::CALL));
                let address = format!("{network}/Values/value");
                let topic = endpoint(&address, "Test::Values/value", Qos::PUBLISHER);
                let port = backend.publisher(&topic).expect("a publisher");
                let mut topic = TypedPublisher::new(port, VALUE[0]);
                open.send(()).expect("the test");
                let before = |number| before(network, at, number, &mut topic);
                let after = || script(network, |script| script.replies[at] += 1);
                serve(&mut *server.expect("a server"), stop, before, after);
            });
        }
        for _ in NAMES {
            opened.recv().expect("a server");
        }
        script(&network, |script| script.ticks = 20);
        let source = source(&network, "source", &["--followers", name]);
        let args = [
            "--network",
            &network,
            "--name",
            name,
            "--clock",
            "simulated",
        ];
        let asker = embed(description, Asker::start, &args).expect("a follower");
        meanwhile(&network);
        end([asker, source]);
    });
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    trace.into_iter().map(|(ms, _, what)| (ms, what)).collect()
}

#[test]
fn in_lockstep_started_calls_end_by_slots_and_in_the_order_of_their_start() {
    let before = |network: &str, at: usize, number: i32, _: &mut TypedPublisher| {
        if (at, number) == (0, 2) {
            // The replies of the second slot are there, and the loop could have ended them.
            let replies = script(network, |script| script.replies[0]) + 2;
            until(network, |script| script.replies[1] == replies);
            turn(network);
        }
    };
    let ended = |network: &str| until(network, |script| script.trace.len() == 4 * ROUNDS);
    let trace = run(&ASKER, "rounds", before, ended);
    let ends: Vec<&str> = trace.iter().map(|(_, what)| what.as_str()).collect();
    for round in ends.chunks(4) {
        assert_eq!(round, ["0 Ok(2)", "0 Ok(4)", "1 Ok(1)", "1 Ok(3)"]);
    }
}

#[test]
fn in_lockstep_calls_end_when_all_samples_of_a_turn_are_handled() {
    let before = |network: &str, _: usize, number: i32, topic: &mut TypedPublisher| {
        if number == 0 {
            for number in 1..=SAMPLES {
                let sent = topic.publish_with(|writer| writer.put(&number));
                sent.expect("a sample");
            }
            // The loop could have handled them in the turn that waits for this reply.
            turn(network);
        }
    };
    let trace = run(&LISTENER, "samples", before, |network| {
        let is_over = |what: &str| what == "1 Ok(1)";
        until(network, |script| {
            script.trace.iter().any(|(_, _, what)| is_over(what))
                && script
                    .trace
                    .last()
                    .is_some_and(|(_, _, what)| what == "compute")
        });
    });
    let first = trace[0].0;
    let steps = trace.iter().map(|(ms, what)| (ms - first, what.as_str()));
    let steps: Vec<(u64, &str)> = steps.take(7).collect();
    // All replies were there before the second `compute()`.
    let expected = [
        (0, "compute"),
        (0, "0 Ok(0)"),
        (10, "sample 1"),
        (10, "sample 65"),
        (10, "compute"),
        (10, "0 Ok(65)"),
        (10, "1 Ok(1)"),
    ];
    assert_eq!(steps, expected);
}

#[test]
fn in_lockstep_64_calls_end_in_a_turn() {
    let before = |network: &str, _: usize, number: i32, _: &mut TypedPublisher| {
        if number == 10 {
            turn(network);
        }
    };
    let ended = |network: &str| until(network, |script| script.trace.len() == CHAIN as usize);
    let trace = run(&ASKER, "chain", before, ended);
    let first = trace[0].0;
    let in_tick = |ms: u64| trace.iter().filter(|(of, _)| of - first == ms).count();
    assert_eq!((in_tick(0), in_tick(10)), (64, 36));
}

#[test]
fn in_lockstep_only_a_call_that_ends_at_its_deadline_warns() {
    let before = |network: &str, at: usize, number: i32, _: &mut TypedPublisher| match number {
        // The reply of the second slot is there, its handler waits, and its deadline is over.
        1 => {
            until(network, |script| script.replies[1] == 1);
            let begin = Instant::now();
            while begin.elapsed() < BRIEF {
                turn(network);
            }
        }
        3 => until(network, |script| script.trace.len() == 4),
        _ => assert_eq!((at, number), (1, 2)),
    };
    let trace = run(&HASTY, "deadline", before, |network| {
        let waits = |step: &(u64, String, String)| step.2 == "compute";
        until(network, |script| script.trace.last().is_some_and(waits));
        until_status(network, "deadline", |status| {
            assert_eq!(status["last_error"], Value::Null);
            true
        });
        script(network, |script| script.goes_on = true);
        until_status(network, "deadline", |status| {
            let error = status["last_error"].as_str().unwrap_or_default();
            error.starts_with("slot Second: a call ended at its deadline")
        });
    });
    let steps: Vec<&str> = trace.iter().map(|(_, what)| what.as_str()).collect();
    assert_eq!(steps[..3], ["0 Ok(1)", "1 Ok(2)", "compute"]);
    assert!(steps[3].starts_with("1 Err(Deadline"), "{steps:?}");
}

static WINDOW: Description = asker(&[slot(NAMES[0], LIMIT)]);

/// Starts a call, and drops it in its window when the reply is there.
struct Window {
    core: Core,
    client: TypedClient,
    call: Option<typed::Call<i32, CallError>>,
    computes: usize,
    waits: usize,
}

impl Window {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self {
            core,
            client: ports.client(0)?,
            call: None,
            computes: 0,
            waits: 0,
        })
    }
}

impl Component for Window {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.computes += 1;
        if self.computes == 1 {
            let call = self.client.start(&ASK[0], (&1,));
            self.call = Some(call.expect("room for a call"));
        }
        if self.computes == COMPUTES {
            note(&self.core, self.waits.to_string());
        }
        Ok(())
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        peers[0] = self.client.peers();
    }

    fn starts_calls(&self, _: usize) -> bool {
        true
    }

    fn end_call(&mut self, _: usize, _: Option<&Member>) -> Option<CallEnd> {
        // The window is quicker.
        None
    }

    fn awaiting(&mut self, _: usize, _: Option<&Member>) -> Option<Awaiting<'_>> {
        self.client.awaiting()
    }

    fn has_window(&self) -> bool {
        true
    }

    fn wait_in_window(
        &mut self,
        events: BorrowedFd<'_>,
        limit: Duration,
    ) -> Result<(), WorkerError> {
        if self.call.take().is_some() {
            until(self.core.network(), |script| script.replies[0] == 1);
            let ended = self.client.poll_with(|_| ());
            assert_eq!(ended, None, "the call was dropped");
            assert!(self.client.awaiting().is_none());
        }
        self.waits += 1;
        wait(&[events], limit);
        Ok(())
    }
}

#[test]
fn a_call_that_ends_in_the_window_leaves_nothing_that_wakes_the_loop() {
    let network = network("ends_window");
    let stop = WakeEvent::new().expect("an event");
    thread::scope(|scope| {
        let _stop = StopOnDrop(&stop);
        let (open, opened) = mpsc::channel();
        let (stop, served) = (&stop, &network);
        scope.spawn(move || {
            let backend = connect(served, NAMES[0]);
            let address = format!("{served}/{}", NAMES[0]);
            let server = backend.server(&endpoint(&address, "Test::Asked", Qos::CALL));
            open.send(()).expect("the test");
            let after = || script(served, |script| script.replies[0] += 1);
            serve(&mut *server.expect("a server"), stop, |_| (), after);
        });
        opened.recv().expect("a server");
        let args = ["--network", &network, "--name", "window"];
        let window = embed(&WINDOW, Window::start, &args).expect("a component");
        until(&network, |script| !script.trace.is_empty());
        end([window]);
    });
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    let waits: usize = trace[0].2.parse().expect("a number");
    assert!(waits <= 5 * COMPUTES, "{waits} waits");
}
