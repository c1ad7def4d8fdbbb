//! `cargo xtask bench`: the goal figures, as Markdown for BENCHMARKS.md.
//!
//! Latencies are those between two processes. Generated and hand-written programs run at the same time and are
//! measured in turns, block by block, so that a slow minute of the machine slows both.

use crate::languages;
use crate::pair::{Network, Pair, ROWS, Times, quantile};
use crate::parameters;
use crate::programs::{Failure, Program, cargo, finish, root, target};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// Blocks of each row and side.
const BLOCKS: usize = 40;
/// A first build of everything may take this long; it is not part of what is measured.
const BUILD: Duration = Duration::from_secs(900);
/// A rebuild after a small change may take this long.
const REBUILD: Duration = Duration::from_secs(30);
/// Runs of the generator.
const GENERATIONS: usize = 20;
/// Rebuilds after a change.
const REBUILDS: usize = 5;
/// How long an idle component is watched.
const IDLE: Duration = Duration::from_secs(10);

/// A goal: what it is called, what was measured, and whether that is enough.
pub(crate) struct Figure {
    pub(crate) what: &'static str,
    pub(crate) goal: &'static str,
    pub(crate) measured: String,
    pub(crate) met: bool,
}

/// Measures; `smoke` does only a little of the latencies.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    build(smoke)?;
    println!("{}\n", machine());
    let blocks = if smoke { 5 } else { BLOCKS };
    let mut met = latencies(blocks, if smoke { 0.4 } else { 1.0 })?;
    if !smoke {
        let figures = [generation()?, rebuild()?, regeneration()?]
            .into_iter()
            .chain(idle()?)
            .chain(languages::figures()?)
            .chain(parameters::figures()?);
        println!();
        met &= table(figures);
    }
    if !met {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures the generator and the checker alone.
pub(crate) fn languages() -> Result<(), Failure> {
    finish(cargo(&["build", "--release", "-p", "rc-codegen"])?, BUILD)?;
    println!("{}\n", machine());
    if !table(languages::figures()?) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures what concerns parameters alone.
pub(crate) fn parameters() -> Result<(), Failure> {
    build(true)?;
    println!("{}\n", machine());
    if !table(parameters::figures()?) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Prints figures; says whether all goals are met.
fn table(figures: impl IntoIterator<Item = Figure>) -> bool {
    println!("| | goal | measured | |\n|---|---|---|---|");
    let mut met = true;
    for figure in figures {
        let Figure {
            what,
            goal,
            measured,
            met: good,
        } = figure;
        println!("| {what} | {goal} | {measured} | {} |", mark(good));
        met &= good;
    }
    met
}

fn mark(met: bool) -> &'static str {
    if met { "met" } else { "**missed**" }
}

/// Builds what is measured, and warms what is measured of cargo itself.
fn build(smoke: bool) -> Result<(), Failure> {
    // Always the same packages: with others cargo builds the same crates with other features.
    let words = "build --release -p ping -p pong -p bench_peer -p speech_server -p rc-codegen";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    if !smoke {
        finish(cargo(&["build", "-p", "avoider"])?, BUILD)?;
    }
    Ok(())
}

/// What the figures were measured on.
fn machine() -> String {
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

/// Measures and prints the table of latencies; says whether all goals are met.
fn latencies(blocks: usize, share: f64) -> Result<bool, Failure> {
    let mut generated = Pair::generated()?;
    let mut by_hand = Pair::by_hand()?;
    println!(
        "| µs | generated p50 | p99 | by hand p50 | p99 | ratio at p50 (goal ≤ 1.10) | middle half of the blocks | n |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut met = true;
    for row in ROWS {
        let (mut ours, mut theirs) = (Times::default(), Times::default());
        let mut ratios = Vec::new();
        // The first block warms up.
        for block in 0..=blocks {
            // Who goes first changes, too.
            let (a, b) = if block % 2 == 0 {
                let a = generated.block(&row, share)?;
                (a, by_hand.block(&row, share)?)
            } else {
                let b = by_hand.block(&row, share)?;
                (generated.block(&row, share)?, b)
            };
            if block > 0 {
                let median = |times: &[i64]| quantile(&mut times.to_vec(), 0.5) as f64;
                ratios.push(median(&a) / median(&b));
                ours.add(a);
                theirs.add(b);
            }
        }
        let ratio = ours.quantile(0.5) / theirs.quantile(0.5);
        met &= ratio <= 1.10;
        println!(
            "| {} | {:.1} | {:.1} | {:.1} | {:.1} | {ratio:.2} {} | {:.2}–{:.2} | {} |",
            row.name,
            ours.quantile(0.5),
            ours.quantile(0.99),
            theirs.quantile(0.5),
            theirs.quantile(0.99),
            mark(ratio <= 1.10),
            quantile(&mut ratios, 0.25),
            quantile(&mut ratios, 0.75),
            ours.len(),
        );
    }
    Ok(met)
}

/// The whole process of the generator, which writes a component into an empty folder.
fn generation() -> Result<Figure, Failure> {
    let rcgen = target()?.join("release/rcgen");
    let mut times = Vec::new();
    for _ in 0..GENERATIONS {
        let out = tempfile::tempdir()?;
        let mut command = Command::new(&rcgen);
        command.arg(root().join("components/simulator/simulator.cdsl"));
        command.arg("--out").arg(out.path().join("simulator"));
        times.push(finish(command, REBUILD)?.0);
    }
    let median = quantile(&mut times, 0.5);
    Ok(Figure {
        what: "`rcgen simulator.cdsl`, whole process (release), median of 20",
        goal: "< 20 ms",
        measured: format!("{:.0} ms", median.as_secs_f64() * 1000.0),
        met: median < Duration::from_millis(20),
    })
}

/// A file that is written back when this is dropped.
struct Altered {
    path: PathBuf,
    text: String,
}

impl Altered {
    fn new(path: PathBuf) -> Result<Self, Failure> {
        let text = fs::read_to_string(&path)?;
        Ok(Self { path, text })
    }

    /// Puts a new statement into a function.
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
    // The first one makes the incremental state, and is not counted.
    for number in 0..=REBUILDS {
        worker.alter(number + std::process::id() as usize)?;
        times.push(finish(cargo(&["build", "-p", "avoider"])?, REBUILD)?.0);
    }
    times.remove(0);
    drop(worker);
    finish(cargo(&["build", "-p", "avoider"])?, REBUILD)?;
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
    let (took, said) = finish(cargo(&["build", "-p", "avoider"])?, REBUILD)?;
    let compiled = said.matches("Compiling").count();
    Ok(Figure {
        what: "`cargo build` after generating anew without a change",
        goal: "compiles nothing",
        measured: format!("{compiled} crates compiled, {:.2} s", took.as_secs_f64()),
        met: compiled == 0,
    })
}

/// Memory and processor time of a component that has nothing to do.
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

/// What all threads of a process used, to the nanosecond.
fn processor_time(pid: u32) -> Result<Duration, Failure> {
    let mut total = Duration::ZERO;
    for task in fs::read_dir(format!("/proc/{pid}/task"))? {
        let text = fs::read_to_string(task?.path().join("schedstat"))?;
        let nanoseconds = text.split(' ').next().unwrap_or_default().parse()?;
        total += Duration::from_nanos(nanoseconds);
    }
    Ok(total)
}

/// Proportional and whole resident memory, in MB.
fn memory(pid: u32) -> Result<(f64, f64), Failure> {
    let path = format!("/proc/{pid}/smaps_rollup");
    let text = fs::read_to_string(Path::new(&path))?;
    let find = |name: &str| -> Result<f64, Failure> {
        let line = text.lines().find_map(|line| line.strip_prefix(name));
        let kilobytes = line.and_then(|line| line.split_whitespace().next());
        let kilobytes: f64 = kilobytes.ok_or(format!("no {name} in {path}"))?.parse()?;
        Ok(kilobytes * 1024.0 / 1e6)
    };
    Ok((find("Pss:")?, find("Rss:")?))
}
