//! `cargo xtask bench graph`: steps, changes, transforms, loading and queries of the property graph,
//! beside petgraph and InnerModel; then `json.load` of Python on the same file, and networkx.

use crate::programs::{Failure, cargo, output, target};
use crate::pypi;
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

/// Prints how long networkx needs for two hops from the node with a value, in a graph of the same size.
const NETWORKX: &str = "\
import random, time
import networkx
random.seed(1)
graph = networkx.MultiDiGraph()
for at in range(1000):
    graph.add_node(at, kind='thing', x=float(at), y=1.0, name=f'n{at}')
for at in range(1000):
    for _ in range(4):
        graph.add_edge(at, random.randrange(1000), kind='to')

def two_hops(attribute, value):
    rows = []
    for a, of_a in graph.nodes(data=True):
        if of_a['kind'] == 'thing' and of_a[attribute] == value:
            for _, b, first in graph.out_edges(a, data=True):
                if first['kind'] == 'to':
                    for _, c, second in graph.out_edges(b, data=True):
                        if second['kind'] == 'to':
                            rows.append(graph.nodes[c]['x'])
    return rows

best = 1e9
for _ in range(15):
    start = time.perf_counter()
    assert len(two_hops('x', 7.0)) == 16
    best = min(best, time.perf_counter() - start)
print(f'the same of networkx: {best * 1e6:.1f} µs')
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
    let python = pypi::packages("bench-graph", &["networkx==3.6.1"])?;
    let mut peer = Command::new(python);
    peer.arg("-c").arg(NETWORKX);
    print!("{}", output(peer, LIMIT)?);
    Ok(())
}
