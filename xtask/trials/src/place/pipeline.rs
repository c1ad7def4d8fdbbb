//! A chain of ten components as threads of one process, and as ten processes.

use super::Measured;
use super::placed::{SLOTS, SLOTS_OF_PONG, arguments};
use crate::compare::Ratio;
use crate::figure::mark;
use crate::pair::{Network, Row, times};
use crate::programs::{Failure, Program};
use crate::usage::{memory, processor_time};
use std::path::Path;
use std::time::Duration;

/// The components between the first and the last one.
const RELAYS: usize = 8;
/// The goal for the memory of one process, divided by that of ten.
const MEMORY_GOAL: f64 = 0.4;
/// The goal for its processor time.
const TIME_GOAL: f64 = 0.7;
/// The limit for the start, and for one block.
const LIMIT: Duration = Duration::from_secs(20);

/// The measured rows: from publishing by the first component until the last one has the sample.
fn rows() -> [Row; 2] {
    [
        Row {
            name: "64 B through ten components".into(),
            kind: "publish",
            size: 64,
            count: 500,
        },
        Row {
            name: "64 KiB through ten components".into(),
            kind: "publish",
            size: 64 << 10,
            count: 50,
        },
    ]
}

/// The memory of both placements, in MB.
pub(super) struct Memory {
    pub(super) one: f64,
    pub(super) ten: f64,
    pub(super) ratio: Ratio,
}

/// Measures both placements in turns, and prints a table. Returns the ratios of processor times, and
/// the memory after it.
pub(super) fn run(
    program: &Path,
    (blocks, share): (usize, f64),
) -> Result<(Vec<Ratio>, Memory), Failure> {
    let mut sides = [Chain::start(program, true)?, Chain::start(program, false)?];
    println!(
        "| a chain of ten | one process p50 µs | ten processes p50 µs | processor time of a value, µs: one process | ten | ratio (goal ≤ {TIME_GOAL:.1}) | n |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut ratios = Vec::new();
    for row in &rows() {
        let mut found = [Measured::default(), Measured::default()];
        for block in 0..=blocks {
            // The first block warms up.
            if block == 1 {
                found = [Measured::default(), Measured::default()];
            }
            for at in [block % 2, (block + 1) % 2] {
                let before = sides[at].processor_time()?;
                found[at].times.add(sides[at].block(row, share)?);
                found[at].processor += sides[at].processor_time()?.saturating_sub(before);
            }
        }
        let [one, ten] = found.each_ref().map(|found| {
            let values = found.times.len().max(1) as f64;
            found.processor.as_secs_f64() * 1e6 / values
        });
        let value = one / ten;
        println!(
            "| {} | {:.1} | {:.1} | {one:.1} | {ten:.1} | {value:.2} {} | {} |",
            row.name,
            found[0].times.quantile(0.5),
            found[1].times.quantile(0.5),
            mark(value <= TIME_GOAL),
            found[0].times.len(),
        );
        ratios.push(Ratio {
            what: format!("processor time, {}", row.name),
            value,
            goal: TIME_GOAL,
        });
    }
    let [one, ten] = [sides[0].memory()?, sides[1].memory()?];
    println!();
    let ratio = Ratio {
        what: "memory of the chain".to_owned(),
        value: one / ten,
        goal: MEMORY_GOAL,
    };
    Ok((ratios, Memory { one, ten, ratio }))
}

/// The chain in one placement.
struct Chain {
    /// `ping` is the first one, or in the only one. It ends first.
    programs: Vec<Program>,
    /// Removed after the end of the programs.
    _network: Network,
    /// Whether all are threads of one process.
    together: bool,
}

impl Chain {
    fn start(program: &Path, together: bool) -> Result<Self, Failure> {
        let network = Network::new(if together { "chain" } else { "links" })?;
        let middleware = if together { "local" } else { "iceoryx2" };
        let of = |name: &str, slots: &[&str], binds: &[(&str, String)], more: &[&str]| {
            let component = if name == "ping" { "ping" } else { "pong" };
            let begin = ["--member", component].map(str::to_owned);
            let options = more.iter().map(|word| (*word).to_owned());
            let name = ["--name", name].map(str::to_owned);
            let mut all = begin
                .into_iter()
                .chain(options)
                .chain(name)
                .collect::<Vec<_>>();
            all.extend(arguments(&network.name, middleware, slots, binds));
            all
        };
        let link = |number: usize| format!("link{number}");
        let mut members = vec![of("pong", &SLOTS_OF_PONG, &[("Sample", link(RELAYS))], &[])];
        for number in 0..RELAYS {
            let binds = [
                ("Echo", format!("echo{number}")),
                ("awake", format!("awake{number}")),
                ("Pictures", format!("pictures{number}")),
                ("Sample", link(number)),
                ("onward", link(number + 1)),
            ];
            let mut relay = of(&format!("relay{number}"), &SLOTS_OF_PONG, &binds, &[]);
            relay.extend(["--set", "relays=true"].map(str::to_owned));
            members.push(relay);
        }
        let after: &[&str] = if together { &["--after", "pong"] } else { &[] };
        members.push(of("ping", &SLOTS, &[("Sample", link(0))], after));
        let mut programs = Vec::new();
        let mut of_each = 1;
        if together {
            of_each = members.len();
            members = vec![members.concat()];
        }
        for arguments in &members {
            let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
            let program = Program::start(program, &words)?;
            for _ in 0..of_each {
                let line = program.read_line(LIMIT)?;
                if line != "ready" {
                    return Err(format!("`{line}` instead of `ready`").into());
                }
            }
            programs.push(program);
        }
        programs.reverse();
        let mut chain = Self {
            programs,
            _network: network,
            together,
        };
        chain.await_relays()?;
        Ok(chain)
    }

    /// Waits until a value comes through: `ping` and `pong` do not wait for the components between
    /// them.
    fn await_relays(&mut self) -> Result<(), Failure> {
        let mut row = rows()[0].clone();
        row.count = 1;
        for _ in 0..100 {
            self.programs[0].write_line("publish 64 1")?;
            let (pong, limit) = (self.programs.len() - 1, Duration::from_millis(100));
            let lines = if self.together { 2 } else { 1 };
            if !self.together {
                self.programs[0].read_line(LIMIT)?;
            }
            // The line of ping is empty.
            let came = (0..lines).filter_map(|_| self.programs[pong].read_line(limit).ok());
            let mut came = came.filter_map(|line| times(&line).ok());
            if came.any(|times| !times.is_empty()) {
                // Those that came late.
                while self.programs[pong].read_line(limit).is_ok() {}
                return Ok(());
            }
        }
        Err("nothing comes through the chain".into())
    }

    fn block(&mut self, row: &Row, share: f64) -> Result<Vec<i64>, Failure> {
        let count = (row.count as f64 * share) as usize;
        let order = format!("{} {} {count}", row.kind, row.size);
        self.programs[0].write_line(&order)?;
        let first = times(&self.programs[0].read_line(LIMIT)?)?;
        let pong = self.programs.len() - 1;
        // In one process, the line of the sender is empty. Either may come first.
        let second = times(&self.programs[pong].read_line(LIMIT)?)?;
        Ok(if first.is_empty() { second } else { first })
    }

    fn processor_time(&self) -> Result<Duration, Failure> {
        let all = self.programs.iter();
        all.map(|program| processor_time(program.pid())).sum()
    }

    /// The proportional memory of all processes, which includes shared memory, in MB.
    fn memory(&self) -> Result<f64, Failure> {
        let all = self.programs.iter();
        all.map(|program| memory(program.pid()).map(|(proportional, _)| proportional))
            .sum()
    }
}
