//! `cargo xtask bench time`: how many ticks a second a source of time makes that waits for all its
//! followers.

use crate::bench::machine;
use crate::figure::BUILD;
use crate::pair::Network;
use crate::programs::{Failure, LOOK, Program, cargo, finish, target};
use rc_management::{Client, component};
use std::time::{Duration, Instant};

/// The numbers of followers of each row.
const FOLLOWERS: [usize; 5] = [0, 1, 2, 8, 32];
/// The limit for the start of a component, and for a reply.
const ANSWER: Duration = Duration::from_secs(10);

/// Measures over shared memory; with `smoke`, few followers for a moment.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let words = "build --release -p clock -p speech_server";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    println!("{}\n", machine());
    let (counts, time) = if smoke {
        (&FOLLOWERS[..3], Duration::from_millis(500))
    } else {
        (&FOLLOWERS[..], Duration::from_secs(5))
    };
    println!("| followers | ticks/s, in turn | µs a tick | ticks/s, at once | µs a tick |");
    println!("|---:|---:|---:|---:|---:|");
    for &count in counts {
        let (in_turn, at_once) = (ticks(count, false, time)?, ticks(count, true, time)?);
        let each = |rate: f64| 1e6 / rate.max(1e-3);
        println!(
            "| {count} | {in_turn:.0} | {:.0} | {at_once:.0} | {:.0} |",
            each(in_turn),
            each(at_once)
        );
    }
    Ok(())
}

/// Ticks a second, with followers that compute in each of them.
fn ticks(followers: usize, at_once: bool, time: Duration) -> Result<f64, Failure> {
    let network = Network::new("time")?;
    let folder = target()?.join("release");
    let config = tempfile::NamedTempFile::new()?;
    std::fs::write(
        config.path(),
        format!("[parameters]\nstep = \"100ms\"\nrate = 0.0\nat_once = {at_once}\n"),
    )?;
    let names: Vec<String> = (0..followers).map(|number| format!("f{number}")).collect();
    let mut running = Vec::new();
    for name in &names {
        // Each serves an address of its own.
        let address = format!("Speech={}/{name}", network.name);
        let own = ["--network", &network.name, "--name", name, "--log", "error"];
        let more = ["--clock", "simulated", "--bind", &address];
        running.push(Program::start(
            &folder.join("speech_server"),
            &[&own[..], &more].concat(),
        )?);
    }
    let (names, config) = (names.join(","), config.path().to_string_lossy());
    let own = [
        "--network",
        &network.name,
        "--log",
        "error",
        "--config",
        &config,
    ];
    let source = ["--clock", "source", "--followers", &names];
    running.push(Program::start(
        &folder.join("clock"),
        &[&own[..], &source].concat(),
    )?);
    let begin = Instant::now();
    while tick(&network).unwrap_or(0) == 0 {
        if begin.elapsed() > ANSWER {
            return Err(format!("no tick with {followers} followers").into());
        }
        std::thread::sleep(LOOK);
    }
    let (start, first) = (Instant::now(), tick(&network)?);
    std::thread::sleep(time);
    let (elapsed, last) = (start.elapsed(), tick(&network)?);
    // The source ends last: no component waits for it.
    running.reverse();
    Ok((last - first) as f64 / elapsed.as_secs_f64())
}

/// The present tick of the source.
fn tick(network: &Network) -> Result<u64, Failure> {
    let mut client = Client::connect(&network.directory.socket("clock"), ANSWER)?;
    let status: component::Status = client.call(&component::Request::Status, ANSWER)?;
    Ok(status.clock.tick)
}
