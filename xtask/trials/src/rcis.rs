//! `cargo xtask bench rcis`: sensors and robots of simulated worlds, compared with ray casts of
//! `MuJoCo`.

use crate::programs::{Failure, cargo, output, target};
use crate::pypi;
use std::process::Command;
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(15);

/// Prints the figure of `MuJoCo`. Argument: the folder with the mesh.
const PEER: &str = include_str!("rcis.py");

pub(crate) fn run() -> Result<(), Failure> {
    let words = "run --release --quiet --manifest-path xtask/bench/rcis/Cargo.toml";
    let words: Vec<&str> = words.split(' ').collect();
    let folder = target()?.join("bench_rcis");
    std::fs::create_dir_all(&folder)?;
    let mut figures = cargo(&words)?;
    figures.arg("--").arg(&folder);
    print!("{}", output(figures, LIMIT)?);
    let python = pypi::packages("bench-rcis", &["mujoco==3.3.7"])?;
    let mut peer = Command::new(python);
    peer.arg("-c").arg(PEER).arg(&folder);
    print!("\n{}", output(peer, LIMIT)?);
    Ok(())
}
