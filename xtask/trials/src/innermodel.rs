//! `cargo xtask bench innermodel`: tests that compare URDF files with `urdf-rs`; then transforms,
//! loading, versions and rays, compared with `k` with `urdf-rs`, and with Pinocchio and trimesh of
//! `PyPI`.

use crate::programs::{Failure, cargo, finish, output, target};
use crate::pypi;
use std::process::Command;
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(15);

/// Prints these figures of Pinocchio and trimesh. Argument: the folder with chains and mesh.
const PEERS: &str = include_str!("innermodel.py");

pub(crate) fn run() -> Result<(), Failure> {
    // A workspace of its own, so that nothing else compiles k.
    let words = "run --release --quiet --manifest-path xtask/bench/innermodel/Cargo.toml";
    let words: Vec<&str> = words.split(' ').collect();
    let tests = "test --quiet --manifest-path xtask/bench/innermodel/Cargo.toml";
    let tests: Vec<&str> = tests.split(' ').collect();
    finish(cargo(&tests)?, LIMIT)?;
    let folder = target()?.join("bench_innermodel");
    std::fs::create_dir_all(&folder)?;
    let mut files = cargo(&words)?;
    files.arg("--").arg(&folder);
    finish(files, LIMIT)?;
    print!("{}", output(cargo(&words)?, LIMIT)?);
    let python = pypi::packages(
        "bench-innermodel",
        &["pin==4.1.0", "trimesh[easy]==5.2.0", "embreex==4.4.0.post1"],
    )?;
    let mut peers = Command::new(python);
    peers.arg("-c").arg(PEERS).arg(&folder);
    print!("\n{}", output(peers, LIMIT)?);
    Ok(())
}
