//! `cargo xtask bench graph`: the property graph compared with petgraph and InnerModel, and with
//! networkx, grafeo, real-ladybug, loro and `json.load` of Python, with the goals. `cargo xtask soak graph`:
//! comparisons in their long form.

use crate::figure::{Figure, table};
use crate::programs::{Failure, LongTest, cargo, long_tests, output, target};
use std::collections::HashMap;
use std::process::Command;
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(15);

/// Prints the figures of peers in Python. Arguments: the files that the figures of Rust leave.
const PEERS: &str = include_str!("graph.py");
const PACKAGES: &str = "grafeo==0.6.0\nloro==1.17.1\nnetworkx==3.6.1\nreal_ladybug==0.15.3\n";

/// Tests, with the variables that make them longer than in the test run.
const LONG: [LongTest; 4] = [
    (
        "a million operations beside petgraph and networkx",
        "-p property-graph --test all oracle::",
        &[("RC_GRAPH_OPERATIONS", "1000000")],
    ),
    (
        "a change that makes a million nodes",
        "-p property-graph --test all large::a_change_of_many",
        &[("RC_GRAPH_NODES", "1000000")],
    ),
    (
        "what replicas show in a thousand histories beside a plain log",
        "-p graph-merge --test all repair::conflicts",
        &[("RC_GRAPH_HISTORIES", "1000")],
    ),
    (
        "graphs with faults beside pyshacl",
        "-p graph-exchange --test all shacl::",
        &[],
    ),
];

/// Numbers of nodes.
const COUNTS: [usize; 4] = [100, 1_000, 10_000, 100_000];
/// Numbers of frames in a chain.
const LENGTHS: [usize; 2] = [7, 30];

pub(crate) fn run() -> Result<(), Failure> {
    // A workspace of its own, so that nothing else compiles petgraph.
    let words = "run --release --quiet --manifest-path xtask/bench/graph/Cargo.toml";
    let words: Vec<&str> = words.split(' ').collect();
    let folder = target()?.join("bench_graph");
    std::fs::create_dir_all(&folder)?;
    // Before anything is measured.
    let test = "cargo xtask bench graph";
    let python = rc_test_support::python::wheels("bench-graph", PACKAGES, test);
    let python = python.ok_or("the peers in Python cannot be installed")?;
    let mut figures = cargo(&words)?;
    figures.arg("--").arg(&folder);
    let mut lines = output(figures, LIMIT)?;
    let mut peers = Command::new(python);
    peers.arg("-c").arg(PEERS);
    peers.args(["dsr.json", "random.json"].map(|name| folder.join(name)));
    lines += &output(peers, LIMIT)?;
    let times = Times::read(&lines)?;
    let mut all = steps(&times)?;
    all.extend(changes(&times)?);
    all.extend(queries(&times)?);
    all.extend(files(&times)?);
    table(all);
    Ok(())
}

/// `cargo xtask soak graph`: the comparisons with other implementations in their long form.
pub(crate) fn soak() -> Result<(), Failure> {
    long_tests(&LONG, LIMIT)
}

/// Seconds by name.
struct Times(HashMap<String, f64>);

impl Times {
    fn read(lines: &str) -> Result<Self, Failure> {
        let mut all = HashMap::new();
        for line in lines.lines() {
            let (name, seconds) = line.split_once(' ').ok_or("a figure has no value")?;
            all.insert(name.to_owned(), seconds.trim().parse()?);
        }
        Ok(Self(all))
    }

    fn get(&self, name: &str) -> Result<f64, Failure> {
        let found = self.0.get(name).copied();
        found.ok_or_else(|| format!("no figure `{name}`").into())
    }

    /// The times of a name for each size.
    fn each(&self, name: &str, sizes: &[usize]) -> Result<Vec<f64>, Failure> {
        let all = sizes.iter().map(|size| self.get(&format!("{name}-{size}")));
        all.collect()
    }

    /// One time as a part of another one.
    fn part(
        &self,
        what: &'static str,
        goal: &'static str,
        most: f64,
        [own, peer]: [&str; 2],
    ) -> Result<Figure, Failure> {
        let (ours, theirs) = (self.get(own)?, self.get(peer)?);
        Ok(Figure {
            what,
            goal,
            measured: format!(
                "{}: {} and {}",
                if goal.contains("1/") {
                    fraction(ours / theirs)
                } else {
                    ratio(ours / theirs)
                },
                time(ours),
                time(theirs)
            ),
            met: ours <= most * theirs,
        })
    }
}

fn time(seconds: f64) -> String {
    match seconds {
        ..1e-6 => format!("{:.1} ns", seconds * 1e9),
        ..1e-3 => format!("{:.2} µs", seconds * 1e6),
        _ => format!("{:.2} ms", seconds * 1e3),
    }
}

fn ratio(ratio: f64) -> String {
    format!("{ratio:.2}")
}

/// A ratio as a goal such as `1/50` has it.
fn fraction(part: f64) -> String {
    match 1.0 / part {
        times @ 10.0.. => format!("1/{times:.0}"),
        times @ 1.0.. => format!("1/{times:.1}"),
        _ => ratio(part),
    }
}

/// Our times and those of a peer, for each size.
fn beside(
    times: &Times,
    what: &'static str,
    goal: &'static str,
    most: f64,
    (names, sizes): ([&str; 2], &[usize]),
) -> Result<Figure, Failure> {
    let [ours, theirs] = [times.each(names[0], sizes)?, times.each(names[1], sizes)?];
    let list = |all: &[f64], shown: fn(f64) -> String| {
        let all: Vec<String> = all.iter().map(|value| shown(*value)).collect();
        all.join(", ")
    };
    let ratios = ours.iter().zip(&theirs).map(|(a, b)| a / b);
    let ratios: Vec<f64> = ratios.collect();
    Ok(Figure {
        what,
        goal,
        measured: format!(
            "{}: {} and {}",
            list(&ratios, ratio),
            list(&ours, time),
            list(&theirs, time)
        ),
        met: ratios.iter().all(|ratio| *ratio <= most),
    })
}

fn steps(times: &Times) -> Result<Vec<Figure>, Failure> {
    let hops = (["hop", "hop-petgraph"], COUNTS.as_slice());
    let what = "one step, of 100, 1,000, 10,000, 100,000 nodes with four edges each / petgraph's `neighbors`";
    let points = (["point-over", "point-innermodel-over"], LENGTHS.as_slice());
    Ok(vec![
        beside(times, what, "≤ 2.0", 2.0, hops)?,
        beside(
            times,
            "a point over 7, 30 frames / InnerModel",
            "≤ 1.2",
            1.2,
            points,
        )?,
    ])
}

fn changes(times: &Times) -> Result<Vec<Figure>, Failure> {
    let one = (["change", "pose-innermodel"], COUNTS.as_slice());
    let far = (["change-far", "pose-innermodel-far"], COUNTS.as_slice());
    let pose = (["pose-over", "pose-innermodel-over"], LENGTHS.as_slice());
    let all = times.each("change", &COUNTS)?;
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    let most = all.iter().copied().fold(0.0, f64::max);
    let fork = times.get("fork-100000")?;
    let what = "one attribute changes, of 100, 1,000, 10,000, 100,000 nodes / a pose of InnerModel";
    let again = "the same, each time a node 64 further";
    Ok(vec![
        beside(times, what, "≤ 2", 2.0, one)?,
        Figure {
            what: "the same, the longest / the shortest",
            goal: "≤ 3",
            measured: format!("{:.2}", most / least),
            met: most <= 3.0 * least,
        },
        beside(times, again, "≤ 2", 2.0, far)?,
        beside(
            times,
            "the pose of an edge changes, in a chain of 7, 30 / InnerModel",
            "",
            f64::INFINITY,
            pose,
        )?,
        Figure {
            what: "a fork of 100,000 nodes",
            goal: "< 2 µs",
            measured: time(fork),
            met: fork < 2e-6,
        },
    ])
}

fn queries(times: &Times) -> Result<Vec<Figure>, Failure> {
    let name = "query-name";
    let whole = "query-whole";
    Ok(vec![
        times.part(
            "a query over two hops from a name, 1,000 nodes / grafeo, with an index",
            "≤ 0.5",
            0.5,
            [name, "grafeo-name"],
        )?,
        times.part(
            "the same / networkx, which looks for the name",
            "≤ 1/50",
            0.02,
            [name, "networkx-found"],
        )?,
        times.part(
            "the same / networkx, whose nodes are found by key",
            "≤ 1/50",
            0.02,
            [name, "networkx-known"],
        )?,
        times.part(
            "the same / real-ladybug, with an index",
            "≤ 1/20",
            0.05,
            [name, "ladybug-name"],
        )?,
        times.part(
            "a sum over all 16,000 paths of two hops / grafeo",
            "≤ 0.5",
            0.5,
            [whole, "grafeo-whole"],
        )?,
        times.part(
            "the same / networkx",
            "≤ 1/50",
            0.02,
            [whole, "networkx-whole"],
        )?,
        times.part(
            "the same / real-ladybug",
            "≤ 1/20",
            0.05,
            [whole, "ladybug-whole"],
        )?,
    ])
}

fn files(times: &Times) -> Result<Vec<Figure>, Failure> {
    Ok(vec![
        times.part(
            "load of a file of DSR with 1,000 nodes, 1.4 MB / `json.load` of Python",
            "≤ 1.0",
            1.0,
            ["load", "json.load"],
        )?,
        times.part(
            "10,000 attributes taken over by a replica as records, each / loro's export and import, as bytes",
            "≤ 1.0",
            1.0,
            ["merge", "loro-merge"],
        )?,
        times.part(
            "the same with setting them / loro, set from Python",
            "≤ 1.0",
            1.0,
            ["merge-all", "loro-all"],
        )?,
    ])
}
