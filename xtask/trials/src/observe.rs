//! `cargo xtask bench observe`: what a tool that observes a topic adds to the latency of its samples.

use crate::bench::{BLOCKS, BUILD, GOAL, machine};
use crate::compare::{Peer, met};
use crate::pair::{Pair, ROWS};
use crate::programs::{Failure, Program, cargo, finish, target};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How long the tool may take until it receives.
const START: Duration = Duration::from_secs(10);

/// Compares two generated pairs, one of which `rcdeploy echo` observes; with `smoke`, a few blocks.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let words = "build --release --workspace --bin ping --bin pong --bin rcdeploy";
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
