//! `cargo xtask bench kinematics`: printed and interpreted solvers beside Pinocchio in C++, of the packages of
//! `PyPI`. `cargo xtask soak kinematics`: real robots beside Pinocchio.

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
            "casadi==3.8.2",
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

/// The tests of real robots, with 1,000 states of each of 13 of them, 10,000 poses of each of four arms, 10,000 steps of a linkage, and
/// a million cycles of 1 kHz.
pub(crate) fn soak() -> Result<(), Failure> {
    for (words, name, count) in [
        (
            "test -p rc-robot --test all real:: -- --ignored",
            "KINEMATICS_STATES",
            None,
        ),
        (
            "test -p rc-robot --test all real:: -- --ignored",
            "KINEMATICS_STATES",
            Some("1000"),
        ),
        (
            "test -p rc-kinematics --test all arms:: -- --include-ignored",
            "KINEMATICS_POSES",
            Some("10000"),
        ),
        (
            "test -p rc-kinematics --test all four_bar",
            "KINEMATICS_STEPS",
            Some("10000"),
        ),
        (
            "test -p rc-kinematics --test all cycles:: -- --nocapture",
            "KINEMATICS_CYCLES",
            Some("1000000"),
        ),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        let mut test = cargo(&words)?;
        test.env_remove(name);
        if let Some(count) = count {
            test.env(name, count);
        }
        print!("{}", output(test, LIMIT)?);
    }
    Ok(())
}
