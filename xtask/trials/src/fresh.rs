//! `cargo xtask bench fresh`: what kept values save over shared memory, and what chains cost: a message,
//! the supervisor, and a check.
//!
//! A client and a server are components of this process, each with a thread of its own. Blocks of a
//! query, of one that is answered from its last reply, of one that a handler answers, and of one that
//! the last value answers, take turns.

mod followed;

use crate::bench::machine;
use crate::figure::{Figure, table};
use crate::programs::{Failure, cargo, output, target};
use rc_middleware::qos::Qos;
use rc_middleware::typed::{self, HandlerError, Operation, Request, TypedClient};
use rc_middleware::{CallError, Member};
use rc_runtime::{
    Component, Core, Description, LatestSlot, Ports, Role, Slot, StartError, Values, WorkerError,
    embed,
};
use std::fmt::Write as _;
use std::process::Command;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// Queries of a block, and the values of a reply: 64 bytes.
const QUERIES: usize = 200;
const LEVELS: usize = 16;
/// Components and chains of the networks that are checked.
const COMPONENTS: usize = 100;
const CHAINS: usize = 50;
const LIMIT: Duration = Duration::from_mins(10);

const OF_CELL: Operation = Operation::query("ofCell", 4, 14, &[]);
const LEVEL: Operation = Operation::query("level", 5, 15, &[]);

/// What a block measures: the client, and the operation.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Query,
    Cached,
    Handled,
    Latest,
}

const KINDS: [Kind; 4] = [Kind::Query, Kind::Cached, Kind::Handled, Kind::Latest];

const fn slot(name: &'static str, role: Role, interface: &'static str, qos: Qos) -> Slot {
    Slot {
        name,
        role,
        interface,
        type_name: interface,
        type_hash: 7,
        backend: "iceoryx2",
        qos,
        is_array: false,
        operations: &[OF_CELL, LEVEL],
        external_types: &[],
    }
}

const fn description(name: &'static str, slots: &'static [Slot]) -> Description {
    Description {
        name,
        model_hash: 1,
        middleware: "iceoryx2",
        period: Duration::from_millis(1),
        parameters: None,
        folder: "/nowhere",
        slots,
        backends: &[rc_iceoryx2::LINKED],
        types: &[],
        simulates_time: false,
        managed: false,
        converter: None,
        note: b"",
    }
}

const CACHED: Qos = Qos {
    cache: Some(Duration::from_hours(1)),
    ..Qos::CALL
};
const LATEST: Qos = Qos {
    latest: Some(Duration::from_hours(1)),
    ..Qos::CALL
};

static SERVER: Description = description(
    "server",
    &[
        slot("Plain", Role::Implements, "Plain", Qos::CALL),
        slot("Latest", Role::Implements, "Latest", LATEST),
    ],
);

static CLIENT: Description = description(
    "client",
    &[
        slot("Plain", Role::Requires, "Plain", Qos::CALL),
        slot("Cached", Role::Requires, "Plain", CACHED),
        slot("Latest", Role::Requires, "Latest", Qos::CALL),
    ],
);

struct Server(Core, Vec<f32>);

impl Component for Server {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        Ok(())
    }

    fn serve(
        &mut self,
        _: usize,
        _: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        if request.operation == OF_CELL.id {
            return request.answer(&OF_CELL, typed::read::<(i32,)>, typed::reply, |_| {
                self.1.clone()
            });
        }
        request.answer(&LEVEL, typed::read::<()>, typed::reply, |()| self.1.clone())
    }
}

/// Measures one block in each period.
struct Client {
    core: Core,
    plain: TypedClient,
    cached: TypedClient,
    latest: TypedClient,
    blocks: usize,
    done: usize,
    sender: Sender<(Kind, Vec<f64>)>,
}

impl Client {
    fn ask(&mut self, kind: Kind) -> Result<Vec<f32>, CallError> {
        match kind {
            Kind::Query => self.plain.call(&OF_CELL, (&1_i32,)),
            Kind::Cached => self.cached.call(&OF_CELL, (&1_i32,)),
            Kind::Handled => self.plain.call(&LEVEL, ()),
            Kind::Latest => self.latest.call(&LEVEL, ()),
        }
    }
}

impl Component for Client {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        if self.plain.peers() + self.latest.peers() < 2 {
            return Ok(());
        }
        let kind = KINDS[self.done % KINDS.len()];
        let failed = |error: CallError| WorkerError::Fatal(error.to_string());
        self.ask(kind).map_err(failed)?;
        let mut times = Vec::with_capacity(QUERIES);
        for _ in 0..QUERIES {
            let begin = Instant::now();
            let levels = self.ask(kind).map_err(failed)?;
            times.push(begin.elapsed().as_secs_f64() * 1e6);
            if levels.len() != LEVELS {
                return Err(WorkerError::Fatal("another reply".to_owned()));
            }
        }
        let _ = self.sender.send((kind, times));
        self.done += 1;
        if self.done == KINDS.len() * self.blocks {
            self.core.stop("done");
        }
        Ok(())
    }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The medians of all kinds in microseconds.
fn queries(blocks: usize) -> Result<[f64; 4], Failure> {
    let network = format!("fresh_{}", std::process::id());
    let server = |core: Core, _: &Ports, _: &Values| {
        let levels = vec![0.5_f32; LEVELS];
        let set = LatestSlot::new(&core, 1).set(1, levels.clone(), typed::reply);
        set.map_err(|error| StartError::Configuration(error.to_string()))?;
        Ok(Server(core, levels))
    };
    let started = |error: StartError| Failure::from(error.to_string());
    let server = embed(&SERVER, server, &["--network", &network]).map_err(started)?;
    let (sender, times) = channel();
    let client = move |core: Core, ports: &Ports, _: &Values| {
        Ok(Client {
            core,
            plain: ports.client(0)?,
            cached: ports.client(1)?,
            latest: ports.client(2)?,
            blocks,
            done: 0,
            sender,
        })
    };
    let client = embed(&CLIENT, client, &["--network", &network]).map_err(started)?;
    let mut all: [Vec<f64>; 4] = Default::default();
    for (kind, times) in times {
        let place = KINDS.iter().position(|known| *known == kind);
        all[place.unwrap_or(0)].extend(times);
    }
    let ended = client.join();
    drop(server);
    ended.map_err(|error| Failure::from(error.to_string()))?;
    Ok(all.map(|mut times| median(&mut times)))
}

/// The text of a network of relays in lines of two, with so many chains over them.
fn network(chains: usize) -> String {
    let mut text = String::from("Deployment long\n{\n");
    for number in 0..COMPONENTS {
        let _ = writeln!(text, "    Component c{number} {{ cdsl \"relay.cdsl\"; }};");
        if number % 2 == 1 {
            let before = number - 1;
            let _ = writeln!(text, "    bind c{number}.heard -> c{before}.said;");
        } else {
            let _ = writeln!(text, "    bind c{number}.heard -> c{}.said;", number + 1);
        }
    }
    for number in 0..chains {
        let (first, second) = (2 * number, 2 * number + 1);
        let _ = writeln!(
            text,
            "    Chain k{number} {{ from c{first}.said.tick; to c{second}.said.tick; within 1s; }};"
        );
    }
    text + "};\n"
}

/// How much longer the check of a network with chains takes than of one without.
fn check(runs: usize, smoke: bool) -> Result<f64, Failure> {
    let profile = if smoke { "debug" } else { "release" };
    let rcdeploy = target()?.join(profile).join("rcdeploy");
    let folder = tempfile::tempdir()?;
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text);
    write(
        "Ticks.idsl",
        "module Ticks { interface Tick { void tick(int number); }; };\n",
    )?;
    write(
        "relay.cdsl",
        "import \"Ticks.idsl\";\nComponent relay\n{\n    Communications { subscribesTo Tick as heard; publishes Tick as said; };\n    \
         language rust;\n    reactions { heard.tick -> compute budget 1ms; compute -> said.tick budget 1ms; };\n};\n",
    )?;
    let names = ["without.ddsl", "with.ddsl"];
    write(names[0], &network(0))?;
    write(names[1], &network(CHAINS))?;
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..runs {
        for (name, times) in names.iter().zip(&mut times) {
            let mut command = Command::new(&rcdeploy);
            command.arg("check").arg(folder.path().join(name));
            let begin = Instant::now();
            let ran = command.output()?;
            times.push(begin.elapsed().as_secs_f64());
            // The components have no code and no programs, which the check reports; only the time
            // counts.
            let text = String::from_utf8_lossy(&ran.stderr).into_owned();
            let expected = ["error[missing-generated]", "error[missing-executable]"];
            let mut errors = text.lines().filter(|line| line.starts_with("error"));
            if !errors.all(|line| expected.iter().any(|known| line.starts_with(known))) {
                return Err(Failure::from(text));
            }
        }
    }
    let [without, with] = times.map(|mut times| median(&mut times));
    Ok(with / without)
}

/// `cargo xtask soak chains`: a chain over five components, over each middleware, with another host
/// whose clock is ahead: nothing is reported for so many seconds, then each fault is. Then the bounds
/// beside 10^6 simulated schedules, and 1,000 changes of two components of which one is killed. With
/// `over`, the chain over this middleware alone.
pub(crate) fn soak(seconds: &str, over: Option<&str>) -> Result<(), Failure> {
    let length: u64 = seconds.parse()?;
    let tests: [(&str, &[(&str, &str)]); 3] = [
        (
            "test -p rc-deploy --test dds chains::ten -- --ignored --nocapture",
            &[
                ("RC_CHAIN_SECONDS", seconds),
                ("RC_CHAIN_OVER", over.unwrap_or_default()),
            ],
        ),
        (
            "test -p rc-deploy --test all network::bounds -- --nocapture",
            &[("RC_SCHEDULES", "1000000")],
        ),
        (
            "test -p rc-deploy --test all killed_in_a_change -- --nocapture",
            &[("RC_PROPOSAL_NETWORKS", "125")],
        ),
    ];
    let count = if over.is_some() { 1 } else { tests.len() };
    for (words, variables) in &tests[..count] {
        let mut command = cargo(&words.split(' ').collect::<Vec<_>>())?;
        command.envs(variables.iter().copied());
        let limit = Duration::from_hours(2) + Duration::from_secs(4 * length);
        print!("{}", output(command, limit)?);
    }
    Ok(())
}

/// Measures and prints the table; with `smoke`, a little of programs that are not optimised.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    if !smoke && cfg!(debug_assertions) {
        // The messages are those of this process.
        let words = "run --quiet --release --bin trials -- bench fresh";
        let command = cargo(&words.split(' ').collect::<Vec<_>>())?;
        print!("{}", output(command, 4 * LIMIT)?);
        return Ok(());
    }
    let (blocks, runs) = if smoke { (2, 1) } else { (50, 21) };
    let programs = ["rcdeploy", "soak_source", "soak_sink"];
    let mut words = vec!["build", "--quiet"];
    words.extend(programs.iter().flat_map(|program| ["--bin", program]));
    words.extend((!smoke).then_some("--release"));
    output(cargo(&words)?, LIMIT)?;
    println!("{}\n", machine());
    let followed = followed::messages(blocks)?;
    let supervisor = followed::supervisor(smoke)?;
    let [query, cached, handled, latest] = queries(blocks)?;
    let chains = check(runs, smoke)?;
    let ratio = |part: f64, whole: f64| format!("{:.3}: {part:.2} and {whole:.2} µs", part / whole);
    let [alone, on_chain] = followed.times;
    let calls = followed.calls.map_or_else(
        || "not measured: `strace` is not installed".to_owned(),
        |[without, with]| format!("{without:.2} and {with:.2}"),
    );
    let equal = |[without, with]: [f64; 2]| (with - without).abs() < 0.1;
    let met = table([
        Figure {
            what: "a sample of 64 bytes on a chain, of one that is not",
            goal: "≤ 1.02",
            measured: ratio(on_chain, alone),
            met: on_chain / alone <= 1.02,
        },
        Figure {
            what: "kernel calls of a sample without a chain, and on one",
            goal: "≤ 0.1 apart",
            measured: calls,
            met: followed.calls.is_none_or(equal),
        },
        Figure {
            what: "the supervisor with 2,000 joined messages a second, of a core, less that without chains",
            goal: "≤ 0.01",
            measured: format!("{supervisor:.4}"),
            met: supervisor <= 0.01,
        },
        Figure {
            what: "a query that is answered from its last reply, of one that is not",
            goal: "≤ 0.05",
            measured: ratio(cached, query),
            met: cached / query <= 0.05,
        },
        Figure {
            what: "a query that `serve latest` answers, of one that a handler answers",
            goal: "≤ 0.8",
            measured: ratio(latest, handled),
            met: latest / handled <= 0.8,
        },
        Figure {
            what: "`rcdeploy check` of 100 components with 50 chains, of one without",
            goal: "≤ 1.2",
            measured: format!("{chains:.3}"),
            met: chains <= 1.2,
        },
    ]);
    println!();
    if !met {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}
