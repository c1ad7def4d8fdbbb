//! `cargo xtask bench counts`: the cost of a message in units that do not depend on the speed of
//! the machine: kernel calls, user instructions, context switches, and bytes copied.
//!
//! `strace` counts kernel calls, `valgrind` counts instructions (callgrind) and copied bytes
//! (dhat), the kernel counts context switches. The command reports which tool is missing.

use crate::bench::machine;
use crate::figure::{BUILD, mark};
use crate::pair::{Pair, Row};
use crate::programs::{Failure, LOOK, Running, cargo, finish};
use crate::usage::context_switches;
use rustix::process::{Pid, Signal, kill_process};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A generated endpoint may make this many times the kernel calls of the hand-written one.
const CALLS_GOAL: f64 = 1.00;
/// A generated endpoint may execute this many times the user instructions of the hand-written one.
const INSTRUCTIONS_GOAL: f64 = 1.30;
/// Rounding of a count that is almost an integer.
const TOLERANCE: f64 = 0.02;
/// A tool may take this long to attach, to write its result, or to start a program.
const TOOL: Duration = Duration::from_mins(1);
/// A block may take this long under a tool.
const BLOCK: Duration = Duration::from_mins(5);
/// Both programs are counted for so long without a message.
const IDLE: Duration = Duration::from_secs(4);
/// Kernel calls that belong to the benchmark and not to the message: the pause between two samples.
const NOT_COUNTED: &str = "clock_nanosleep";

/// A row, and the number of its messages in one block.
const ROWS: [(&str, &str, usize, usize); 7] = [
    ("publish 64 B", "publish", 64, 400),
    ("publish 4 KiB", "publish", 4096, 400),
    ("publish 1 MiB copied", "publish", 1 << 20, 100),
    ("publish 1 MiB in place", "place", 1 << 20, 100),
    ("query 64 B", "query", 64, 1000),
    ("query 1 MiB", "query", 1 << 20, 100),
    ("full speed, 64 B", "flood", 64, 20_000),
];

/// Counts of one message at one endpoint; `None` if a tool is missing.
#[derive(Clone, Copy, Default)]
struct Counts {
    calls: Option<f64>,
    instructions: Option<f64>,
    switches: Option<f64>,
    copied: Option<f64>,
}

/// Counts of one row: those of the sender or client, and those of the receiver or server.
type Ends = [Counts; 2];

/// The counts of one pair of programs: of each row, and of an idle second.
struct Side {
    rows: Vec<Ends>,
    idle: Ends,
}

/// Builds the programs, counts, and prints the tables. `smoke` counts a tenth of the messages.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    // The whole workspace is selected, so that features are those of the other benchmarks.
    let words = "build --release --workspace --bin ping --bin pong --bin bench_peer";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    println!("{}\n", machine());
    let share = if smoke { 0.1 } else { 1.0 };
    let mut missing = Vec::new();
    let ours = side(&Pair::generated_under, share, &mut missing)?;
    let theirs = side(&Pair::by_hand_under, share, &mut missing)?;
    let met = table(&ours, &theirs);
    idle_table(&ours.idle, &theirs.idle);
    missing.sort();
    missing.dedup();
    for reason in &missing {
        println!("Not counted: {reason}.\n");
    }
    if !met {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Starts a pair of programs under tools, see [`Pair::generated_under`].
type Start<'a> = &'a dyn Fn([&[String]; 2]) -> Result<Pair, Failure>;

/// Counts all rows of one pair of programs.
fn side(start: Start<'_>, share: f64, missing: &mut Vec<String>) -> Result<Side, Failure> {
    let mut side = Side {
        rows: vec![Ends::default(); ROWS.len()],
        idle: Ends::default(),
    };
    let folder = tempfile::tempdir()?;
    {
        let slow = slowly(&[]);
        let mut pair = start([&slow, &slow])?;
        count(
            &mut pair,
            &mut side,
            (share, &[0, 1]),
            switches,
            |before, pair| {
                let after = switches(pair)?;
                Ok([0, 1].map(|end| after[end] - before[end]))
            },
            |counts| &mut counts.switches,
        )?;
        if is_installed("strace") {
            for end in 0..2 {
                count(
                    &mut pair,
                    &mut side,
                    (share, &[end]),
                    |pids| Trace::start(pids[end], folder.path()),
                    |trace, _| {
                        let mut counts = [0.0; 2];
                        counts[end] = trace.end()?;
                        Ok(counts)
                    },
                    |counts| &mut counts.calls,
                )?;
            }
        } else {
            missing.push("kernel calls, because `strace` is not installed".to_owned());
        }
    }
    if !is_installed("valgrind") || !is_installed("callgrind_control") {
        missing.push(
            "user instructions and copied bytes, because `valgrind` is not installed".to_owned(),
        );
        return Ok(side);
    }
    if let Err(error) = instructions(start, share, folder.path(), &mut side) {
        missing.push(format!(
            "user instructions, because callgrind failed: {error}"
        ));
    }
    for (at, ends) in side.rows.iter_mut().enumerate() {
        if ROWS[at].2 >= 1 << 20
            && let Err(error) = copied(start, at, share, folder.path(), ends)
        {
            missing.push(format!("copied bytes, because dhat failed: {error}"));
        }
    }
    Ok(side)
}

fn switches(pids: [u32; 2]) -> Result<[f64; 2], Failure> {
    let [sender, receiver] = pids.map(context_switches);
    Ok([sender? as f64, receiver? as f64])
}

/// Counts an idle time and all rows: `begin` begins to count both processes, `end` gives the
/// counts. Those of `ends` go into the `field`.
fn count<T>(
    pair: &mut Pair,
    side: &mut Side,
    (share, ends): (f64, &[usize]),
    begin: impl Fn([u32; 2]) -> Result<T, Failure>,
    end: impl Fn(T, [u32; 2]) -> Result<[f64; 2], Failure>,
    field: impl Fn(&mut Counts) -> &mut Option<f64>,
) -> Result<(), Failure> {
    let pids = pair.pids();
    // The first block warms up.
    pair.counted_block(&row(0, share).0, BLOCK)?;
    let begun = begin(pids)?;
    std::thread::sleep(IDLE);
    let idle = end(begun, pids)?;
    for &end in ends {
        *field(&mut side.idle[end]) = Some(idle[end] / IDLE.as_secs_f64());
    }
    for (at, counts) in side.rows.iter_mut().enumerate() {
        let (row, received) = row(at, share);
        pair.counted_block(&row, BLOCK)?;
        let begun = begin(pids)?;
        let messages = pair.counted_block(&row, BLOCK)?;
        let counted = end(begun, pids)?;
        let messages = [row.count, received(messages)];
        for &end in ends {
            *field(&mut counts[end]) = Some(counted[end] / messages[end] as f64);
        }
    }
    Ok(())
}

/// The command line of a tool, with a pause between samples in which the receiver always falls
/// asleep. Without it, a slow receiver finds several samples at each wake-up.
fn slowly(tool: &[&str]) -> Vec<String> {
    let words = ["env", "BENCH_PAUSE_MS=5"].iter().chain(tool);
    words.map(|word| (*word).to_owned()).collect()
}

/// A row of the table, and the messages that the receiver handles: all, or those that arrived.
fn row(at: usize, share: f64) -> (Row, fn(usize) -> usize) {
    let (name, kind, size, count) = ROWS[at];
    let row = Row {
        name: name.into(),
        kind,
        size,
        count: ((count as f64 * share) as usize).max(10),
    };
    (row, |messages| messages.max(1))
}

pub(crate) fn is_installed(program: &str) -> bool {
    let version = Command::new(program)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    version.is_ok_and(|status| status.success())
}

/// `strace` that is attached to one process.
pub(crate) struct Trace {
    strace: Running,
    file: PathBuf,
}

impl Trace {
    pub(crate) fn start(pid: u32, folder: &Path) -> Result<Self, Failure> {
        let file = folder.join(format!("strace.{pid}"));
        let mut command = Command::new("strace");
        command
            .args(["-f", "-c", "-p", &pid.to_string(), "-o"])
            .arg(&file);
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let mut strace = Running(command.spawn()?);
        let end = Instant::now() + TOOL;
        while !all_traced(pid)? {
            if Instant::now() >= end || strace.ended_within(Duration::ZERO) {
                return Err(format!("strace does not attach to process {pid}").into());
            }
            std::thread::sleep(LOOK);
        }
        Ok(Self { strace, file })
    }

    /// Detaches. Returns the number of kernel calls.
    pub(crate) fn end(mut self) -> Result<f64, Failure> {
        kill_process(Pid::from_child(&self.strace.0), Signal::INT)?;
        if !self.strace.ended_within(TOOL) {
            return Err("strace does not end".into());
        }
        Ok(calls(&std::fs::read_to_string(&self.file)?) as f64)
    }
}

/// Sum of the calls in a table of `strace -c`: share, seconds, microseconds a call, calls, perhaps
/// errors, name.
fn calls(table: &str) -> u64 {
    let rows = table
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>());
    rows.filter(|words| words.len() >= 5 && !matches!(words.last(), Some(&("total" | NOT_COUNTED))))
        .filter_map(|words| words.get(3)?.parse::<u64>().ok())
        .sum()
}

/// Whether all threads of a process have a tracer.
fn all_traced(pid: u32) -> Result<bool, Failure> {
    for task in std::fs::read_dir(format!("/proc/{pid}/task"))? {
        let status = std::fs::read_to_string(task?.path().join("status"))?;
        if status.lines().any(|line| line == "TracerPid:\t0") {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Counts instructions of all rows, of one program after the other: next to a slow one, the other
/// one would poll without effect.
fn instructions(
    start: Start<'_>,
    share: f64,
    folder: &Path,
    side: &mut Side,
) -> Result<(), Failure> {
    let out = folder.join("callgrind.%p");
    let tool = slowly(&[
        "valgrind",
        "--tool=callgrind",
        "--quiet",
        &format!("--callgrind-out-file={}", out.display()),
    ]);
    let without = slowly(&[]);
    for end in 0..2 {
        let mut tools = [&without[..]; 2];
        tools[end] = &tool;
        let mut pair = start(tools)?;
        let dumps = std::cell::Cell::new(0);
        count(
            &mut pair,
            side,
            (share, &[end]),
            |pids| control("--zero", pids[end]),
            |(), pids| {
                dumps.set(dumps.get() + 1);
                control("--dump", pids[end])?;
                let dump = folder.join(format!("callgrind.{}.{}", pids[end], dumps.get()));
                let mut counts = [0.0; 2];
                counts[end] = instructions_in(&std::fs::read_to_string(dump)?)?;
                Ok(counts)
            },
            |counts| &mut counts.instructions,
        )?;
    }
    Ok(())
}

/// The last total in a dump of callgrind.
fn instructions_in(dump: &str) -> Result<f64, Failure> {
    let mut totals = dump
        .lines()
        .filter_map(|line| line.strip_prefix("totals: "));
    let total = totals.next_back().ok_or("callgrind wrote no total")?;
    Ok(total.parse()?)
}

fn control(order: &str, pid: u32) -> Result<(), Failure> {
    let mut command = Command::new("callgrind_control");
    command.args([order, &pid.to_string()]);
    finish(command, TOOL).map(drop)
}

/// Counts the bytes that one row copies, with a pair of programs under dhat. Copies at the start of
/// a program count, too; they are small against a message of 1 MiB.
fn copied(
    start: Start<'_>,
    at: usize,
    share: f64,
    folder: &Path,
    ends: &mut Ends,
) -> Result<(), Failure> {
    let tool = slowly(&[
        "valgrind",
        "--tool=dhat",
        "--mode=copy",
        &format!("--log-file={}", folder.join("dhat.%p").display()),
        &format!("--dhat-out-file={}", folder.join("dhat.out.%p").display()),
    ]);
    let mut pair = start([&tool, &tool])?;
    let (row, received) = row(at, share);
    let messages = pair.counted_block(&row, BLOCK)?;
    let pids = pair.pids();
    pair.stop(TOOL)?;
    for (end, pid) in pids.into_iter().enumerate() {
        let text = std::fs::read_to_string(folder.join(format!("dhat.{pid}")))?;
        // `==PID== Total:     1,234 bytes in 5 blocks`
        let total = text.lines().find_map(|line| line.split_once("Total:"));
        let (_, total) = total.ok_or("dhat wrote no total")?;
        let bytes = total.split_whitespace().next().unwrap_or_default();
        let bytes: f64 = bytes.replace(',', "").parse()?;
        let of = if end == 0 {
            row.count
        } else {
            received(messages)
        };
        ends[end].copied = Some(bytes / (of * row.size) as f64);
    }
    Ok(())
}

/// Prints what both programs do in a second without a message.
fn idle_table(ours: &Ends, theirs: &Ends) {
    println!(
        "| a second without a message | kernel calls: generated | by hand | instructions: generated | by hand | context switches: generated | by hand |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (end, (a, b)) in ["publisher and client", "subscriber and server"]
        .iter()
        .zip(ours.iter().zip(theirs))
    {
        let pair = |count: fn(&Counts) -> Option<f64>| {
            format!("{} | {}", number(count(a), 1), number(count(b), 1))
        };
        println!(
            "| {end} | {} | {} | {} |",
            pair(|counts| counts.calls),
            pair(|counts| counts.instructions),
            pair(|counts| counts.switches),
        );
    }
    println!();
}

/// Prints the tables. Returns whether all goals are met.
fn table(ours: &Side, theirs: &Side) -> bool {
    println!(
        "| a message | endpoint | kernel calls: generated | by hand | ratio (goal ≤ {CALLS_GOAL:.2}) | \
         instructions: generated | by hand | ratio (goal ≤ {INSTRUCTIONS_GOAL:.2}) | \
         context switches: generated | by hand |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut met = true;
    let mut copies = String::new();
    for (at, (ours, theirs)) in ours.rows.iter().zip(&theirs.rows).enumerate() {
        let (name, kind, ..) = ROWS[at];
        let names = if kind == "query" {
            ["client", "server"]
        } else {
            ["publisher", "subscriber"]
        };
        for (end, (a, b)) in names.iter().zip(ours.iter().zip(theirs)) {
            let calls = compared(a.calls, b.calls, CALLS_GOAL, 2, &mut met);
            let instructions = compared(
                a.instructions,
                b.instructions,
                INSTRUCTIONS_GOAL,
                0,
                &mut met,
            );
            println!(
                "| {name} | {end} | {calls} | {instructions} | {} | {} |",
                number(a.switches, 2),
                number(b.switches, 2),
            );
            if a.copied.is_some() {
                // Writing to a String cannot fail.
                let _ = writeln!(
                    copies,
                    "| {name} | {end} | {} | {} |",
                    number(a.copied, 2),
                    number(b.copied, 2)
                );
            }
        }
    }
    println!();
    if !copies.is_empty() {
        println!("| bytes copied, as a multiple of the data | endpoint | generated | by hand |");
        println!("|---|---|---|---|\n{copies}");
    }
    met
}

/// Three columns: both counts, and their ratio against the goal.
fn compared(a: Option<f64>, b: Option<f64>, goal: f64, digits: usize, met: &mut bool) -> String {
    let ratio = a.zip(b).map(|(a, b)| a / b);
    let judged = ratio.map_or_else(
        || "not counted".to_owned(),
        |ratio| {
            let good = ratio <= goal + TOLERANCE;
            *met &= good;
            format!("{ratio:.2} {}", mark(good))
        },
    );
    format!("{} | {} | {judged}", number(a, digits), number(b, digits))
}

fn number(count: Option<f64>, digits: usize) -> String {
    count.map_or_else(|| "–".to_owned(), |count| format!("{count:.digits$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_strace_is_read() {
        let table = "\
% time     seconds  usecs/call     calls    errors syscall
------ ----------- ----------- --------- --------- ----------------
 60.00    0.000600           6       100           epoll_wait
 30.00    0.000300           6        50        10 recvfrom
 10.00    0.000100           1       100           clock_nanosleep
------ ----------- ----------- --------- --------- ----------------
100.00    0.001000           4       250        10 total
";
        assert_eq!(calls(table), 150);
    }
}
