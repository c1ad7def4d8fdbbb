//! `cargo xtask bench kinematics`: printed and interpreted solvers beside Pinocchio in C++, of the packages of
//! `PyPI`. `cargo xtask soak kinematics`: 1,000 states of real robots beside Pinocchio.

use crate::programs::{Failure, cargo, output, target};
use crate::pypi;
use std::time::Duration;

/// The limit for builds, compilers and a run.
const LIMIT: Duration = Duration::from_mins(30);

pub(crate) fn run() -> Result<(), Failure> {
    let python = pypi::packages(
        "bench-kinematics",
        &[
            "pin==4.1.0",
            "cmeel-eigen==3.4.1",
            "example-robot-data==6.0.0",
        ],
    )?;
    // A workspace of its own, so that nothing else compiles it.
    let words = "run --release --quiet --manifest-path xtask/bench/kinematics/Cargo.toml";
    let words: Vec<&str> = words.split(' ').collect();
    let mut bench = cargo(&words)?;
    let folder = target()?.join("bench_kinematics");
    bench.arg("--").arg(folder).arg(python);
    print!("{}", output(bench, LIMIT)?);
    Ok(())
}

/// Compares 1,000 states of each of 13 robots.
pub(crate) fn soak() -> Result<(), Failure> {
    let words = "test -p rc-robot --test all real_robots";
    let words: Vec<&str> = words.split(' ').collect();
    let mut test = cargo(&words)?;
    test.env("KINEMATICS_STATES", "1000");
    print!("{}", output(test, LIMIT)?);
    Ok(())
}
