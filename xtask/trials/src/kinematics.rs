//! `cargo xtask bench kinematics`: printed and interpreted solvers beside Pinocchio in C++, of the packages of
//! `PyPI`. `cargo xtask soak kinematics`: real robots beside Pinocchio.

use crate::programs::{Failure, LongTest, cargo, long_tests, output, target};
use crate::pypi;
use std::time::Duration;

/// Differential inverse kinematics in Python, and its packages. Each has an environment of its own: one that cannot be installed has no row.
const DIFFERENTIAL: [(&str, &[&str]); 2] = [
    ("mink", &["mink==1.3.0", "mujoco==4.0.0", "daqp==0.11.0"]),
    ("pink", &["pin-pink==4.4.0", "pin==4.1.0", "daqp==0.11.0"]),
];

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
            "ik-geo==1.0.3",
        ],
    )?;
    // A workspace of its own, so that nothing else compiles it.
    let words = "run --release --quiet --manifest-path xtask/bench/kinematics/Cargo.toml";
    let words: Vec<&str> = words.split(' ').collect();
    let mut bench = cargo(&words)?;
    let folder = target()?.join("bench_kinematics");
    bench.arg("--").arg(folder).arg(python);
    for (name, packages) in DIFFERENTIAL {
        match pypi::packages(&format!("bench-{name}"), packages) {
            Ok(python) => _ = bench.arg(name).arg(python),
            Err(reason) => eprintln!("xtask: there is no row beside {name}: {reason}"),
        }
    }
    print!("{}", output(bench, LIMIT)?);
    Ok(())
}

/// The tests of real robots, with 1,000 states of each of 13 of them beside Pinocchio and of 12 or more beside `MuJoCo`, 10,000 poses of each of four arms,
/// 1,000 poses out of reach of two of them beside scipy, 10,000 steps of a linkage and of two arms with a bar, and a million cycles of 1 kHz. Each has a limit.
pub(crate) fn soak() -> Result<(), Failure> {
    let tests: [LongTest; 8] = [
        (
            "all robots",
            "-p rc-robot --test all real:: -- --ignored",
            &[],
        ),
        (
            "1,000 states",
            "-p rc-robot --test all real:: -- --ignored",
            &[("KINEMATICS_STATES", "1000")],
        ),
        (
            "10,000 poses",
            "-p rc-kinematics --test all arms:: -- --include-ignored",
            &[("KINEMATICS_POSES", "10000")],
        ),
        (
            "10,000 steps",
            "-p rc-kinematics --test all four_bar",
            &[("KINEMATICS_STEPS", "10000")],
        ),
        (
            "10,000 steps of two arms with a bar",
            "-p rc-kinematics --test all keep_their_bar -- --include-ignored",
            &[("KINEMATICS_STEPS", "10000")],
        ),
        (
            "1,000 poses out of reach of UR5",
            "-p rc-kinematics --test all nearest_answer -- --include-ignored",
            &[("KINEMATICS_FAR", "1000"), ("KINEMATICS_ARM", "ur5")],
        ),
        (
            "1,000 poses out of reach of Panda",
            "-p rc-kinematics --test all nearest_answer -- --include-ignored",
            &[("KINEMATICS_FAR", "1000"), ("KINEMATICS_ARM", "panda")],
        ),
        (
            "10^6 cycles",
            "-p rc-kinematics --test all cycles::",
            &[("KINEMATICS_CYCLES", "1000000")],
        ),
    ];
    long_tests(&tests, LIMIT)
}
