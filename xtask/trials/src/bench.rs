//! `cargo xtask bench`: the goal figures, as Markdown for BENCHMARKS.md.
//!
//! Latencies are those between two processes. Generated and hand-written programs run at the same
//! time and are measured in turns, block by block, so that a slow minute of the machine slows both.

use crate::compare::{Peer, Ratio, met};
use crate::figure::{BUILD, Figure, mark, table};
use crate::languages;
use crate::networks;
use crate::pair::{Network, Pair, ROWS, quantile};
use crate::parameters;
use crate::programs::{Failure, Program, cargo, finish, root, target};
use crate::slots;
use crate::usage::{memory, processor_time};
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// Blocks of each row, for each of both pairs.
pub(crate) const BLOCKS: usize = 40;
/// The goal for generated / by hand.
pub(crate) const GOAL: f64 = 1.05;
/// The goal for the time between two samples that arrive, at full speed.
const FULL_SPEED_GOAL: f64 = 1.15;
/// The limit for a rebuild after a small change.
const REBUILD: Duration = Duration::from_secs(30);
/// The number of rebuilds after a change.
const REBUILDS: usize = 5;
/// The duration of the measurement of an idle component.
const IDLE: Duration = Duration::from_secs(10);

/// Measures everything; with `smoke`, a few blocks of the latencies.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    build(smoke)?;
    println!("{}\n", machine());
    let blocks = if smoke { 5 } else { BLOCKS };
    let mut good = met(&latencies(blocks, if smoke { 0.4 } else { 1.0 })?);
    if !smoke {
        slots::table()?;
        let figures = [rebuild()?, regeneration()?]
            .into_iter()
            .chain(idle()?)
            .chain(languages::generator()?)
            .chain(languages::figures()?)
            .chain(networks::figures()?)
            .chain(parameters::figures()?);
        println!();
        good &= table(figures);
    }
    if !good {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures the latencies alone.
pub(crate) fn latencies_alone() -> Result<(), Failure> {
    build(true)?;
    println!("{}\n", machine());
    if !met(&latencies(BLOCKS, 1.0)?) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures the generator alone.
pub(crate) fn generator() -> Result<(), Failure> {
    let words = "build --release --workspace --bin rcgen";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    println!("{}\n", machine());
    if !table(languages::generator()?) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures the checker alone.
pub(crate) fn languages() -> Result<(), Failure> {
    build(true)?;
    println!("{}\n", machine());
    let figures = languages::figures()?.into_iter();
    if !table(figures.chain(networks::figures()?)) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures the parameters alone.
pub(crate) fn parameters() -> Result<(), Failure> {
    build(true)?;
    println!("{}\n", machine());
    if !table(parameters::figures()?) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Builds the programs. Without `smoke` it also warms the build that is measured.
fn build(smoke: bool) -> Result<(), Failure> {
    // The whole workspace is selected: otherwise cargo builds the same crates with other features.
    let words = "build --release --workspace --bin ping --bin pong --bin bench_peer --bin bench_slots --bin speech_server --bin rcgen --bin rcdeploy";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    if !smoke {
        finish(cargo(&["build", "--workspace", "--bin", "avoider"])?, BUILD)?;
    }
    Ok(())
}

/// The machine: processor, kernel, load.
pub(crate) fn machine() -> String {
    let cpus = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .map_or("an unknown processor", |line| {
            line.trim_start_matches([' ', '\t', ':'])
        });
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let count = std::thread::available_parallelism().map_or(0, usize::from);
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split(' ').next().unwrap_or_default().to_owned();
    format!(
        "{model}, {count} cores, Linux {}; load before: {load}",
        kernel.trim()
    )
}

/// Measures and prints the tables of latencies and throughput.
fn latencies(blocks: usize, share: f64) -> Result<Vec<Ratio>, Failure> {
    let peer = Peer {
        name: "by hand",
        goal: GOAL,
    };
    let (mut ours, mut theirs) = (Pair::generated()?, Pair::by_hand()?);
    let mut ratios = peer.table(&ROWS, &mut ours, &mut theirs, blocks, share)?;
    let peer = Peer {
        goal: FULL_SPEED_GOAL,
        ..peer
    };
    ratios.extend(peer.throughput(&mut ours, &mut theirs, blocks)?);
    Ok(ratios)
}

/// Measures the latencies several times and prints the spread of their ratios. One run begins every
/// `pause`, or at once if the run before it took longer.
pub(crate) fn repeated(runs: usize, pause: Duration) -> Result<(), Failure> {
    build(true)?;
    let mut rows: Vec<(Ratio, Vec<f64>)> = Vec::new();
    for run in 1..=runs {
        let next = Instant::now() + pause;
        println!("Run {run} of {runs}: {}\n", machine());
        for (at, row) in latencies(BLOCKS, 1.0)?.into_iter().enumerate() {
            let ratio = row.value;
            if at == rows.len() {
                rows.push((row, Vec::new()));
            }
            rows[at].1.push(ratio);
        }
        if run < runs {
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
        }
    }
    println!("| ratio at p50, {runs} runs | goal | each run | median | |\n|---|---|---|---|---|");
    for (row, mut ratios) in rows {
        let each: Vec<String> = ratios.iter().map(|ratio| format!("{ratio:.2}")).collect();
        let median = quantile(&mut ratios, 0.5);
        println!(
            "| {} | ≤ {:.2} | {} | {median:.2} | {} |",
            row.what,
            row.goal,
            each.join(", "),
            mark(median <= row.goal),
        );
    }
    Ok(())
}

/// A file that is restored on drop.
struct Altered {
    path: PathBuf,
    text: String,
}

impl Altered {
    fn new(path: PathBuf) -> Result<Self, Failure> {
        let text = fs::read_to_string(&path)?;
        Ok(Self { path, text })
    }

    /// Inserts a statement into a function.
    fn alter(&self, number: usize) -> Result<(), Failure> {
        let place = "fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {";
        if !self.text.contains(place) {
            return Err(format!("{} has no compute()", self.path.display()).into());
        }
        let statement = format!("{place}\n        std::hint::black_box({number}_usize);");
        fs::write(&self.path, self.text.replacen(place, &statement, 1))?;
        Ok(())
    }
}

impl Drop for Altered {
    fn drop(&mut self) {
        if let Err(error) = fs::write(&self.path, &self.text) {
            eprintln!(
                "{} was altered and cannot be restored: {error}",
                self.path.display()
            );
        }
    }
}

/// `cargo build` after a change of the worker.
fn rebuild() -> Result<Figure, Failure> {
    let worker = Altered::new(root().join("components/avoider/src/specific_worker.rs"))?;
    let mut times = Vec::new();
    // The first rebuild creates the incremental state and is not counted.
    for number in 0..=REBUILDS {
        worker.alter(number + std::process::id() as usize)?;
        times.push(
            finish(
                cargo(&["build", "--workspace", "--bin", "avoider"])?,
                REBUILD,
            )?
            .0,
        );
    }
    times.remove(0);
    drop(worker);
    finish(
        cargo(&["build", "--workspace", "--bin", "avoider"])?,
        REBUILD,
    )?;
    let median = quantile(&mut times, 0.5);
    Ok(Figure {
        what: "`cargo build` after a change in `specific_worker.rs` (debug), median of 5",
        goal: "< 2 s",
        measured: format!("{:.2} s", median.as_secs_f64()),
        met: median < Duration::from_secs(2),
    })
}

/// `cargo build` after a generation that changed nothing.
fn regeneration() -> Result<Figure, Failure> {
    let mut command = Command::new(target()?.join("release/rcgen"));
    command.arg(root().join("components/avoider/avoider.cdsl"));
    finish(command, REBUILD)?;
    let (took, stderr) = finish(
        cargo(&["build", "--workspace", "--bin", "avoider"])?,
        REBUILD,
    )?;
    let compiled = stderr.matches("Compiling").count();
    Ok(Figure {
        what: "`cargo build` after generating anew without a change",
        goal: "compiles nothing",
        measured: format!("{compiled} crates compiled, {:.2} s", took.as_secs_f64()),
        met: compiled == 0,
    })
}

/// Memory and processor time of an idle component.
fn idle() -> Result<[Figure; 2], Failure> {
    let network = Network::new("idle")?;
    let arguments = ["--network", network.name.as_str(), "--log", "error"];
    let component = Program::start(&target()?.join("release/speech_server"), &arguments)?;
    std::thread::sleep(Duration::from_secs(1));
    let before = processor_time(component.pid())?;
    let start = Instant::now();
    std::thread::sleep(IDLE);
    let used = processor_time(component.pid())?.saturating_sub(before);
    let share = 100.0 * used.as_secs_f64() / start.elapsed().as_secs_f64();
    let (pss, rss) = memory(component.pid())?;
    Ok([
        Figure {
            what: "memory of an idle `speech_server`",
            goal: "≤ 10 MB PSS",
            measured: format!("{pss:.1} MB PSS, {rss:.1} MB RSS"),
            met: pss <= 10.0,
        },
        Figure {
            what: "processor time of an idle `speech_server`, over 10 s",
            goal: "≤ 0.5 % of a core",
            measured: format!("{share:.2} %"),
            met: share <= 0.5,
        },
    ])
}
