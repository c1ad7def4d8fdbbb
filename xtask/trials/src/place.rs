//! `cargo xtask bench place`: the same two components, of the same program, as threads of one process
//! and as two processes; and the copies of a message.

mod proxy;

use crate::bench::machine;
use crate::compare::{Ratio, met};
use crate::figure::mark;
use crate::pair::{Network, Pair, Row, Times, quantile, times};
use crate::programs::{Failure, Program};
use crate::usage::processor_time;
use crate::variant;
use rc_deploy_network::Profile;
use rc_middleware::typed::{self, Operation, TypedPublisher};
use rc_middleware::{
    Address, Backend, Endpoint, Environment, OpenError, Qos, Settings, TypeIdentity, WakeEvent,
};
use std::borrow::Cow;
use std::path::Path;
use std::time::Duration;

/// Blocks of each row, for each placement.
const BLOCKS: usize = 40;
/// The goal for a thread, divided by a process.
const GOAL: f64 = 0.7;
/// The goal for the greatest time of a value in place of any size, divided by the smallest.
const SIZE_GOAL: f64 = 1.2;
/// The limit for the start.
const START: Duration = Duration::from_secs(10);
/// The limit for one block.
const BLOCK: Duration = Duration::from_secs(10);
/// The slots of both components.
const SLOTS: [&str; 4] = ["Echo", "awake", "Sample", "Pictures"];

const fn row(name: &'static str, kind: &'static str, size: usize, count: usize) -> Row {
    Row {
        name: Cow::Borrowed(name),
        kind,
        size,
        count,
    }
}

/// The measured rows. The last ones are those of one value in three sizes.
const ROWS: [Row; 8] = [
    row("publish 64 B, one way", "publish", 64, 500),
    row("publish 64 KiB copied, one way", "publish", 64 << 10, 50),
    row("publish 1 MiB copied, one way", "publish", 1 << 20, 50),
    row(
        "publish 1 MiB in place, with the writing",
        "place",
        1 << 20,
        50,
    ),
    row("query 64 B, round trip", "query", 64, 1000),
    row("64 KiB in place, without the writing", "lent", 64 << 10, 50),
    row(
        "256 KiB in place, without the writing",
        "lent",
        256 << 10,
        50,
    ),
    row("1 MiB in place, without the writing", "lent", 1 << 20, 50),
];

/// Measures all; with `smoke`, a few blocks of programs that are not optimised.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let (profile, blocks, share) = if smoke {
        (Profile::Dev, 5, 0.2)
    } else {
        (Profile::Release, BLOCKS, 1.0)
    };
    let program = variant::program("place", profile)?;
    println!("{}\n", machine());
    let mut sides = [Placed::in_one(&program)?, Placed::in_two(&program)?];
    println!(
        "| µs | one process p50 | p99 | two processes p50 | p99 | ratio at p50 (goal ≤ {GOAL:.1}) | ratio of processor time | n |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut ratios = Vec::new();
    let mut of_sizes = Vec::new();
    for row in &ROWS {
        let (ratio, of_thread) = measured(row, &mut sides, (blocks, share))?;
        ratios.push(ratio);
        if row.kind == "lent" {
            of_sizes.push(of_thread);
        }
    }
    let most = quantile(&mut of_sizes, 1.0) / quantile(&mut of_sizes, 0.0);
    println!(
        "\nIn one process, the longest of the last three, divided by the shortest: {most:.2} (goal ≤ {SIZE_GOAL:.1}), {}.\n",
        mark(most <= SIZE_GOAL)
    );
    ratios.push(Ratio {
        what: "sizes in place".to_owned(),
        value: most,
        goal: SIZE_GOAL,
    });
    drop(sides);
    copies()?;
    ratios.extend(proxy::run(&program, profile, share)?);
    if !met(&ratios) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures a row in both placements in turns, and prints it. Returns their ratio, and the median in
/// one process.
fn measured(
    row: &Row,
    sides: &mut [Placed; 2],
    (blocks, share): (usize, f64),
) -> Result<(Ratio, f64), Failure> {
    let mut found = [Measured::default(), Measured::default()];
    for block in 0..=blocks {
        // The first block warms up.
        if block == 1 {
            found = [Measured::default(), Measured::default()];
        }
        for at in [block % 2, (block + 1) % 2] {
            let before = sides[at].processor_time()?;
            found[at].times.add(sides[at].block(row, share)?);
            let used = sides[at].processor_time()?.saturating_sub(before);
            found[at].processor += used;
        }
    }
    let [thread, process] = &mut found;
    let medians = [thread, process].map(|one| one.times.quantile(0.5));
    let [thread, process] = &mut found;
    let value = medians[0] / medians[1];
    println!(
        "| {} | {:.1} | {:.1} | {:.1} | {:.1} | {value:.2} {} | {:.2} | {} |",
        row.name,
        medians[0],
        thread.times.quantile(0.99),
        medians[1],
        process.times.quantile(0.99),
        mark(value <= GOAL),
        thread.processor.as_secs_f64() / process.processor.as_secs_f64(),
        thread.times.len(),
    );
    let ratio = Ratio {
        what: row.name.to_string(),
        value,
        goal: GOAL,
    };
    Ok((ratio, medians[0]))
}

/// The measurements of one placement.
#[derive(Default)]
struct Measured {
    times: Times,
    processor: Duration,
}

/// Both components in one placement.
enum Placed {
    One {
        program: Program,
        /// Removed after the end of the program.
        _network: Network,
    },
    Two(Pair),
}

impl Placed {
    fn in_one(program: &Path) -> Result<Self, Failure> {
        let network = Network::new("one")?;
        let own = arguments(&network.name, "local");
        let pong = ["--member".to_owned(), "pong".to_owned()];
        let ping = ["--member", "ping", "--after", "pong"].map(str::to_owned);
        let all = [&pong[..], &own, &ping, &own].concat();
        let all: Vec<&str> = all.iter().map(String::as_str).collect();
        let program = Program::start(program, &all)?;
        for _ in 0..2 {
            let line = program.read_line(START)?;
            if line != "ready" {
                return Err(format!("`{line}` instead of `ready`").into());
            }
        }
        Ok(Self::One {
            program,
            _network: network,
        })
    }

    fn in_two(program: &Path) -> Result<Self, Failure> {
        let pair = Pair::members_in(Network::new("two")?, program, &[])?;
        Ok(Self::Two(pair))
    }

    fn processor_time(&self) -> Result<Duration, Failure> {
        match self {
            Self::One { program, .. } => processor_time(program.pid()),
            Self::Two(pair) => pair.processor_time(),
        }
    }

    fn block(&mut self, row: &Row, share: f64) -> Result<Vec<i64>, Failure> {
        let program = match self {
            Self::One { program, .. } => program,
            Self::Two(pair) => return pair.block(row, share),
        };
        let count = (row.count as f64 * share) as usize;
        program.write_line(&format!("{} {} {count}", row.kind, row.size))?;
        let first = times(&program.read_line(BLOCK)?)?;
        if row.is_query() {
            return Ok(first);
        }
        // The line of the sender is empty. Either may come first.
        let second = times(&program.read_line(BLOCK)?)?;
        Ok(if first.is_empty() { second } else { first })
    }
}

/// The arguments of a component whose connections all go over one middleware.
fn arguments(network: &str, middleware: &str) -> Vec<String> {
    let awake = format!("awake={network}/Awake");
    let own = ["--network", network, "--log", "error", "--bind", &awake];
    let mut all: Vec<String> = own.iter().map(|word| (*word).to_owned()).collect();
    for slot in SLOTS {
        all.extend(["--transport".to_owned(), format!("{slot}={middleware}")]);
    }
    all
}

/// What a sample costs the typed layer and a middleware.
const SAMPLE: Operation = Operation::one_way("sample", 1, 7);
type Connect = fn(&Environment) -> Result<Box<dyn Backend>, OpenError>;

/// Counts the allocations of a sample from its sender to the value of its receiver, and prints them.
fn copies() -> Result<(), Failure> {
    println!("| a sample and its value at the receiver | allocations | allocated bytes |");
    println!("|---|---|---|");
    let middlewares: [(_, Connect); 2] = [
        ("one process", rc_local::connect),
        ("shared memory", rc_iceoryx2::connect),
    ];
    for (name, connect) in middlewares {
        let network = Network::new("copies")?;
        let environment = Environment {
            network: network.name.clone(),
            instance: "both".to_owned(),
            directory: network.directory.clone(),
            wake_event: WakeEvent::new()?,
            settings: Settings::default(),
        };
        let backend = connect(&environment)?;
        let endpoint = |qos: Qos| -> Result<Endpoint, Failure> {
            Ok(Endpoint {
                address: Address::parse(&format!("{}/Sample", network.name))?,
                types: TypeIdentity {
                    name: "RcBench::Sample".to_owned(),
                    hash: SAMPLE.type_hash,
                },
                external_types: Vec::new(),
                qos,
            })
        };
        let mut subscriber = backend.subscriber(&endpoint(Qos::SUBSCRIBER)?)?;
        let port = backend.publisher(&endpoint(Qos::PUBLISHER)?)?;
        let mut topic = TypedPublisher::new(port, SAMPLE);
        for (what, size) in [("64 B", 64), ("1 MiB", 1 << 20)] {
            let data = vec![7_u8; size];
            let mut exchange = || -> Result<(), Failure> {
                topic.publish_parts((&1_i64, &data[..]))?;
                let mut read = None;
                let received = subscriber.receive_message(&mut |header, message| {
                    let value = typed::read::<(i64, Vec<u8>)>(&mut message.reader(header.encoding));
                    read = value.ok();
                })?;
                let whole = read.is_some_and(|(_, value)| value.len() == size);
                if received && whole {
                    Ok(())
                } else {
                    Err("the sample did not come".into())
                }
            };
            // Buffers and pools have their sizes after some samples.
            for _ in 0..20 {
                exchange()?;
            }
            let mut outcome = Ok(());
            let used = allocation_counter::measure(|| outcome = exchange());
            outcome?;
            println!(
                "| {what}, {name} | {} | {} |",
                used.count_total, used.bytes_total
            );
        }
    }
    println!();
    Ok(())
}
