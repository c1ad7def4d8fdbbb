//! `cargo xtask bench world`: a world compared with topics with the same bytes. `cargo xtask soak
//! world`: twenty agents on two hosts, of which some are killed, paused and cut off, and other tests
//! at length.

use crate::programs::{Failure, cargo, output};
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(30);

pub(crate) fn bench(smoke: bool) -> Result<(), Failure> {
    let profile = if smoke { "dev" } else { "release" };
    let words = ["run", "--quiet", "--profile", profile, "-p", "bench_world"];
    let more: &[&str] = if smoke { &["--", "--smoke"] } else { &[] };
    print!("{}", output(cargo(&[&words, more].concat())?, LIMIT)?);
    Ok(())
}

/// The tests of the soak, and the variables that make them long.
const SOAK: [(&str, &[(&str, &str)]); 5] = [
    (
        "test -p rc-deploy --test dds world_soak::twenty -- --ignored --nocapture",
        &[],
    ),
    (
        "test -p rc-world --test all dsr_ -- --nocapture",
        &[("RC_WORLD_ROUNDS", "1000"), ("RC_WORLD_SCRIPT", "3000")],
    ),
    (
        "test -p rc-world --test all a_million -- --nocapture",
        &[("RC_WORLD_NODES", "1100000")],
    ),
    // Eight readers.
    (
        "test -p rc-world --test all no_reader -- --nocapture",
        &[("RC_WORLD_READS", "125000")],
    ),
    (
        "test -p rc-deploy --test all a_question_with_a_token -- --nocapture",
        &[("RC_WORLD_READS", "100000")],
    ),
];

pub(crate) fn soak() -> Result<(), Failure> {
    for (words, variables) in SOAK {
        let mut test = cargo(&words.split(' ').collect::<Vec<&str>>())?;
        test.envs(variables.iter().copied());
        print!("{}", output(test, LIMIT)?);
    }
    Ok(())
}
