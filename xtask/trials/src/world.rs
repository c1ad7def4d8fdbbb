//! `cargo xtask bench world`: a world compared with topics with the same bytes. `cargo xtask soak
//! world`: twenty agents on two hosts, of which some are killed, paused and cut off.

use crate::programs::{Failure, cargo, output};
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(15);

pub(crate) fn bench(smoke: bool) -> Result<(), Failure> {
    let profile = if smoke { "dev" } else { "release" };
    let words = ["run", "--quiet", "--profile", profile, "-p", "bench_world"];
    let more: &[&str] = if smoke { &["--", "--smoke"] } else { &[] };
    print!("{}", output(cargo(&[&words, more].concat())?, LIMIT)?);
    Ok(())
}

pub(crate) fn soak() -> Result<(), Failure> {
    let words = "test -p rc-deploy --test dds world_soak::twenty -- --ignored --nocapture";
    let words: Vec<&str> = words.split(' ').collect();
    print!("{}", output(cargo(&words)?, LIMIT)?);
    let words = "test -p rc-world --test all dsr_ -- --nocapture";
    let words: Vec<&str> = words.split(' ').collect();
    let mut rounds = cargo(&words)?;
    rounds
        .env("RC_WORLD_ROUNDS", "1000")
        .env("RC_WORLD_SCRIPT", "3000");
    print!("{}", output(rounds, LIMIT)?);
    let words = "test -p rc-world --test all a_million -- --nocapture";
    let words: Vec<&str> = words.split(' ').collect();
    let mut nodes = cargo(&words)?;
    nodes.env("RC_WORLD_NODES", "1100000");
    print!("{}", output(nodes, LIMIT)?);
    Ok(())
}
