//! `cargo xtask bench graph`: steps, changes, transforms, loading and queries of the property graph,
//! beside petgraph and InnerModel; then `json.load` of Python on the same file.

use crate::programs::{Failure, cargo, output, target};
use std::process::Command;
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(15);

/// Prints how long Python needs for a file. Argument: the file.
const PEER: &str = "\
import json, sys, time
best = 1e9
for _ in range(15):
    start = time.perf_counter()
    with open(sys.argv[1]) as file:
        json.load(file)
    best = min(best, time.perf_counter() - start)
print(f'json.load of Python: {best * 1e3:.2f} ms')
";

pub(crate) fn run() -> Result<(), Failure> {
    // A workspace of its own, so that nothing else compiles petgraph.
    let words = "run --release --quiet --manifest-path xtask/bench/graph/Cargo.toml";
    let words: Vec<&str> = words.split(' ').collect();
    let folder = target()?.join("bench_graph");
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("graph.json");
    let mut figures = cargo(&words)?;
    figures.arg("--").arg(&file);
    print!("{}", output(figures, LIMIT)?);
    let mut peer = Command::new("python3");
    peer.arg("-c").arg(PEER).arg(&file);
    print!("{}", output(peer, LIMIT)?);
    Ok(())
}
