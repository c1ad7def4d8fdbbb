//! Random changes of the property graph and of a plain graph of petgraph, beside a `MultiDiGraph` of
//! networkx: equal graphs, neighbours and errors.

mod backend;
mod ours;
mod plain;

use backend::{Backend, Element, Neighbours, Operations, Refusal};
use ours::Ours;
use plain::Plain;
use rc_test_support::python;
use std::fmt::Write as _;
use std::process::Command;

const NAMES: [&str; 4] = ["a", "b", "c", "d"];
/// How many removed elements are asked for again.
const REMEMBERED: usize = 40;
/// How many nodes there are, about. networkx lists all edges to find an id.
const NODES: usize = 24;

#[derive(Clone, Copy)]
struct Node<N> {
    handle: N,
    id: u64,
}

#[derive(Clone, Copy)]
struct Edge<E> {
    handle: E,
    id: u64,
    from: u64,
    to: u64,
}

/// Elements that are in the graph, and some that were.
#[derive(Clone)]
struct Known<N, E> {
    nodes: Vec<Node<N>>,
    edges: Vec<Edge<E>>,
    gone_nodes: Vec<Node<N>>,
    gone_edges: Vec<Edge<E>>,
}

impl<N, E> Default for Known<N, E> {
    fn default() -> Self {
        Self {
            nodes: Vec::new(),
            edges: Vec::new(),
            gone_nodes: Vec::new(),
            gone_edges: Vec::new(),
        }
    }
}

impl<N, E> Known<N, E> {
    fn forget_some(&mut self) {
        let few = self.gone_nodes.len().saturating_sub(REMEMBERED);
        self.gone_nodes.drain(..few);
        let few = self.gone_edges.len().saturating_sub(REMEMBERED);
        self.gone_edges.drain(..few);
    }
}

/// Operations as the script reads them, and what the graph said to each.
#[derive(Default)]
struct Log {
    operations: String,
    said: Vec<String>,
}

impl Log {
    fn add(&mut self, operation: std::fmt::Arguments, said: impl Into<String>) {
        let _ = writeln!(self.operations, "{operation}");
        self.said.push(said.into());
    }

    /// Says in the words of the script how an operation ended.
    fn end<T>(&mut self, operation: std::fmt::Arguments, result: &Result<T, Refusal>) {
        let said = match result {
            Ok(_) => "ok",
            Err(Refusal::Absent) => "absent",
            Err(Refusal::There) => "there",
        };
        self.add(operation, said);
    }
}

/// One of a list; seldom one of the second list, whose elements are gone.
fn one<T: Copy>(here: &[T], gone: &[T], random: &mut fastrand::Rng) -> Option<T> {
    let list = if random.u32(0..16) == 0 { gone } else { here };
    (!list.is_empty()).then(|| list[random.usize(0..list.len())])
}

/// A new id; seldom one that is or was there.
fn id<N: Copy, E: Copy>(known: &Known<N, E>, next: &mut u64, random: &mut fastrand::Rng) -> u64 {
    if random.u32(0..12) == 0 {
        let node = one(&known.nodes, &known.gone_nodes, random).map(|node| node.id);
        let edge = one(&known.edges, &known.gone_edges, random).map(|edge| edge.id);
        let (first, second) = if random.bool() {
            (node, edge)
        } else {
            (edge, node)
        };
        if let Some(id) = first.or(second) {
            return id;
        }
    }
    *next += 1;
    *next
}

fn step<N: Copy, E: Copy>(
    edit: &mut dyn Operations<N, E>,
    known: &mut Known<N, E>,
    next: &mut u64,
    log: &mut Log,
    random: &mut fastrand::Rng,
) {
    let name = NAMES[random.usize(0..NAMES.len())];
    let node = one(&known.nodes, &known.gone_nodes, random);
    let other = one(&known.nodes, &known.gone_nodes, random);
    let edge = one(&known.edges, &known.gone_edges, random);
    let value = random.i64(0..1000);
    // The number of nodes stays near its middle.
    let grows = random.usize(0..2 * NODES) >= known.nodes.len();
    match (random.u32(0..16), node, other, edge) {
        (0..2, ..) if grows => {
            let id = id(known, next, random);
            let made = edit.add_node(id, name);
            log.end(format_args!("node {id} {name}"), &made);
            if let Ok(handle) = made {
                known.gone_nodes.retain(|gone| gone.id != id);
                known.nodes.push(Node { handle, id });
            }
        }
        (0..2, Some(node), ..) => {
            let removed = edit.remove_node(node.handle);
            log.end(format_args!("remove-node {}", node.id), &removed);
            if removed.is_ok() {
                known.nodes.retain(|other| other.id != node.id);
                known.gone_nodes.push(node);
                let touches = |edge: &Edge<E>| edge.from == node.id || edge.to == node.id;
                known
                    .gone_edges
                    .extend(known.edges.iter().filter(|edge| touches(edge)));
                known.edges.retain(|edge| !touches(edge));
            }
        }
        (2..6, Some(from), Some(to), _) => {
            let id = id(known, next, random);
            let made = edit.add_edge(id, name, from.handle, to.handle);
            let (from, to) = (from.id, to.id);
            log.end(format_args!("edge {id} {name} {from} {to}"), &made);
            if let Ok(handle) = made {
                known.edges.push(Edge {
                    handle,
                    id,
                    from,
                    to,
                });
            }
        }
        (6..8, .., Some(edge)) => {
            let removed = edit.remove_edge(edge.handle);
            let Edge { id, from, to, .. } = edge;
            log.end(format_args!("remove-edge {id} {from} {to}"), &removed);
            if removed.is_ok() {
                known.edges.retain(|other| other.id != id);
                known.gone_edges.push(edge);
            }
        }
        (8, Some(node), ..) => {
            let set = edit.set_node(node.handle, name, Some(value));
            log.end(format_args!("set-node {} {name} {value}", node.id), &set);
        }
        (9, Some(node), ..) => {
            let unset = edit.set_node(node.handle, name, None);
            log.end(format_args!("unset-node {} {name}", node.id), &unset);
        }
        (10, .., Some(edge)) => {
            let set = edit.set_edge(edge.handle, name, Some(value));
            let Edge { id, from, to, .. } = edge;
            log.end(
                format_args!("set-edge {id} {from} {to} {name} {value}"),
                &set,
            );
        }
        (11, .., Some(edge)) => {
            let unset = edit.set_edge(edge.handle, name, None);
            let Edge { id, from, to, .. } = edge;
            log.end(format_args!("unset-edge {id} {from} {to} {name}"), &unset);
        }
        (12.., Some(node), ..) => {
            let said = neighbours(edit.neighbours(node.handle));
            log.add(format_args!("neighbours {}", node.id), said);
        }
        _ => {}
    }
    known.forget_some();
}

/// The edges of a node with their other ends, and its neighbours.
fn neighbours(found: Result<Neighbours, Refusal>) -> String {
    let Ok(found) = found else {
        return "absent".to_owned();
    };
    let pairs = |mut pairs: Vec<(u64, u64)>| {
        pairs.sort_unstable();
        let pairs = pairs.iter().map(|(edge, end)| format!("{edge}:{end}"));
        pairs.collect::<Vec<_>>().join(",")
    };
    let nodes = |mut nodes: Vec<u64>| {
        nodes.sort_unstable();
        nodes.dedup();
        let nodes = nodes.iter().map(u64::to_string);
        nodes.collect::<Vec<_>>().join(",")
    };
    [
        pairs(found.out),
        pairs(found.in_),
        nodes(found.successors),
        nodes(found.predecessors),
    ]
    .join(" | ")
}

/// The whole graph in one line.
fn printed(graph: &impl Backend) -> String {
    let listed = |element: &Element| {
        let texts = element.attributes.iter();
        let texts = texts.map(|(name, value)| format!("{name}={value}"));
        let mut texts: Vec<_> = texts.chain([format!("type={}", element.kind)]).collect();
        texts.sort_unstable();
        texts.join(" ")
    };
    let mut nodes = graph.nodes();
    nodes.sort();
    let nodes = nodes
        .iter()
        .map(|node| format!("{} {}", node.id, listed(node)));
    let mut edges = graph.edges();
    edges.sort();
    let edges = edges
        .iter()
        .map(|(edge, from, to)| format!("{} {from} {to} {}", edge.id, listed(edge)));
    let nodes: Vec<String> = nodes.collect();
    let edges: Vec<String> = edges.collect();
    format!("{} | {}", nodes.join("; "), edges.join("; "))
}

/// How many operations: as many as `RC_GRAPH_OPERATIONS` says.
fn count() -> usize {
    let count = std::env::var("RC_GRAPH_OPERATIONS").ok();
    count.map_or(100_000, |count| {
        count.parse().expect("a number of operations")
    })
}

/// Random operations, and what a backend says to them.
fn operations(mut graph: impl Backend) -> Log {
    let count = count();
    let mut random = fastrand::Rng::with_seed(24);
    let (mut known, mut next, mut log) = (Known::default(), 0, Log::default());
    let mut round = 0;
    while log.said.len() < count {
        let fails = random.u32(0..10) == 0;
        let before = known.clone();
        if fails {
            log.add(format_args!("save"), "ok");
        }
        // A change that fails leaves nothing.
        graph.change(|edit| {
            for _ in 0..random.usize(1..12) {
                step(edit, &mut known, &mut next, &mut log, &mut random);
            }
            !fails
        });
        if fails {
            log.add(format_args!("back"), "ok");
            known = before;
        }
        round += 1;
        if round % 50 == 0 {
            log.add(format_args!("print"), printed(&graph));
        }
    }
    log.add(format_args!("print"), printed(&graph));
    for said in ["ok", "absent", "there"] {
        let count = log.said.iter().filter(|known| *known == said).count();
        assert!(count > log.said.len() / 1000, "{said}: {count}");
    }
    log
}

fn compare(operations: &str, ours: &[String], theirs: &[String]) {
    assert_eq!(ours.len(), theirs.len());
    for (at, operation) in operations.lines().enumerate() {
        assert_eq!(ours[at], theirs[at], "operation {at}: {operation}");
    }
}

#[test]
fn random_changes_equal_petgraph_and_networkx() {
    let ours = operations(Ours::new());
    let plain = operations(Plain::default());
    let lines = [&ours.operations, &plain.operations].map(|all| all.lines().count());
    assert_eq!(lines[0], lines[1]);
    let pairs = ours.operations.lines().zip(plain.operations.lines());
    for (at, (own, plain)) in pairs.enumerate() {
        assert_eq!(own, plain, "operation {at}");
    }
    compare(&ours.operations, &ours.said, &plain.said);
    let test = "random_changes_equal_petgraph_and_networkx";
    let Some(python) = python::interpreter("networkx==3.6.1", test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("operations.txt");
    std::fs::write(&file, &ours.operations).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/oracle/script.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let theirs = String::from_utf8(output.stdout).expect("a text");
    let theirs: Vec<String> = theirs.lines().map(str::to_owned).collect();
    compare(&ours.operations, &ours.said, &theirs);
}
