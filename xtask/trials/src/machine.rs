//! `cargo xtask bench machine`: a step of a state machine, compared with the crate `statig`.

use crate::programs::{Failure, cargo, output};
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(10);

pub(crate) fn run() -> Result<(), Failure> {
    // A workspace of its own, so that nothing else compiles statig.
    let manifest = ["--manifest-path", "xtask/bench/machine/Cargo.toml"];
    let mut words = vec!["run", "--release", "--quiet"];
    words.extend(manifest);
    print!("{}", output(cargo(&words)?, LIMIT)?);
    Ok(())
}
