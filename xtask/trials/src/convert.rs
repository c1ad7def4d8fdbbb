//! `cargo xtask bench convert`: printed functions beside the same by hand, the programs of
//! connections beside printed functions, and the check of a network that converts.

use crate::programs::{Failure, cargo, output};
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(15);

pub(crate) fn run() -> Result<(), Failure> {
    // A workspace of its own: its build script prints the functions.
    let words = "run --release --quiet --manifest-path xtask/bench/convert/Cargo.toml";
    let words: Vec<&str> = words.split(' ').collect();
    print!("{}", output(cargo(&words)?, LIMIT)?);
    Ok(())
}
