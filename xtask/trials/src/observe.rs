//! `cargo xtask bench observe`: the latency that a tool adds to the samples of an observed topic,
//! and the cost of `rcdeploy echo` at 10 kHz compared with a hand-written subscriber.

use crate::bench::{BLOCKS, GOAL, machine};
use crate::compare::{Peer, met};
use crate::figure::BUILD;
use crate::pair::{Pair, ROWS, Row};
use crate::programs::{Failure, LOOK, Program, Running, cargo, finish, target};
use crate::usage::processor_time;
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How long the tool may take until it receives.
const START: Duration = Duration::from_secs(10);
/// Values of a second at 10 kHz.
const A_SECOND: usize = 10_000;
/// The limit for a block at 10 kHz, beyond the time of its values.
const BLOCK: Duration = Duration::from_secs(20);

/// Compares two generated pairs, one of which `rcdeploy echo` observes; with `smoke`, a few blocks.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let words = "build --release --workspace --bin ping --bin pong --bin rcdeploy --bin bench_peer";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    println!("{}\n", machine());
    let mut observed = Pair::generated_in("seen")?;
    let mut alone = Pair::generated_in("alone")?;
    let network = observed.network().ok_or("no network")?.to_owned();
    let tool = observe(&network, &mut observed)?;
    let peer = Peer {
        name: "without a tool",
        goal: GOAL,
    };
    let blocks = if smoke { 5 } else { BLOCKS };
    let share = if smoke { 0.4 } else { 1.0 };
    let ratios = peer.table(&ROWS[..1], &mut observed, &mut alone, blocks, share)?;
    drop(tool);
    drop((observed, alone));
    at_ten_kilohertz(if smoke { 1 } else { 20 })?;
    if !met(&ratios) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Starts `rcdeploy echo` for the samples of a pair, and waits until it prints one.
fn observe(network: &str, pair: &mut Pair) -> Result<Program, Failure> {
    let mut command = Command::new(target()?.join("release/rcdeploy"));
    command.args(["echo", network, "ping.Sample.sample", "--format", "json"]);
    command.stderr(Stdio::null());
    let tool = Program::spawn(command)?;
    let end = Instant::now() + START;
    while Instant::now() < end {
        pair.block(&ROWS[0], 0.1)?;
        if tool.read_line(Duration::from_millis(200)).is_ok() {
            return Ok(tool);
        }
    }
    Err("the tool receives nothing".into())
}

/// Prints what each tool receives of values at 10 kHz, and its processor time.
fn at_ten_kilohertz(seconds: usize) -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let release = target()?.join("release");
    println!("\n| 10 kHz × 64 B for {seconds} s | received | lost | processor, % of one |");
    println!("|---|---:|---:|---:|");
    let mut generated = Pair::generated_in("echo")?;
    let network = generated.network().ok_or("no network")?.to_owned();
    let mut echo = Command::new(release.join("rcdeploy"));
    echo.args(["echo", &network, "ping.Sample.sample", "--format", "json"]);
    let out = folder.path().join("echo");
    print_row("`rcdeploy echo`", echo, &mut generated, &out, seconds)?;
    drop(generated);
    let mut by_hand = Pair::by_hand()?;
    let (root, prefix) = by_hand.files()?;
    let mut watch = Command::new(release.join("bench_peer"));
    watch.args(["watch", &root, &prefix]);
    let out = folder.path().join("watch");
    print_row("written by hand", watch, &mut by_hand, &out, seconds)
}

/// Runs a tool that prints a line for each value of a pair into a file.
fn print_row(
    name: &str,
    mut tool: Command,
    pair: &mut Pair,
    out: &Path,
    seconds: usize,
) -> Result<(), Failure> {
    tool.stdin(Stdio::null()).stderr(Stdio::null());
    let running = Running(tool.stdout(File::create(out)?).spawn()?);
    let end = Instant::now() + START;
    while lines(out)? == 0 {
        if Instant::now() > end {
            return Err(format!("{name} receives nothing").into());
        }
        pair.block(&ROWS[0], 0.1)?;
    }
    settle(out)?;
    let row = Row {
        name: Cow::Borrowed("10 kHz"),
        kind: "steady",
        size: 64,
        count: A_SECOND * seconds,
    };
    let (before, processor) = (lines(out)?, processor_time(running.0.id())?);
    let begin = Instant::now();
    let limit = BLOCK + Duration::from_secs(seconds as u64);
    pair.counted_block(&row, limit)?;
    settle(out)?;
    let share = processor_time(running.0.id())?
        .saturating_sub(processor)
        .as_secs_f64()
        / begin.elapsed().as_secs_f64();
    // A value without data ends the block.
    let received = (lines(out)? - before).saturating_sub(1);
    let lost = row.count.saturating_sub(received);
    println!("| {name} | {received} | {lost} | {:.1} |", share * 100.0);
    Ok(())
}

/// Waits until a file does not grow any more.
fn settle(file: &Path) -> Result<(), Failure> {
    let mut length = None;
    while length != Some(std::fs::metadata(file)?.len()) {
        length = Some(std::fs::metadata(file)?.len());
        std::thread::sleep(50 * LOOK);
    }
    Ok(())
}

/// The number of lines of a file.
fn lines(file: &Path) -> Result<usize, Failure> {
    let whole = BufReader::new(File::open(file)?).split(b'\n');
    Ok(whole.count())
}
