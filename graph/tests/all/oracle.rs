//! Random changes beside a `MultiDiGraph` of networkx: equal graphs, neighbours and errors.

use property_graph::{EdgeId, Edit, Error, Graph, Id, NodeId, Schema, Snapshot, Time, Value};
use rc_test_support::python;
use std::fmt::Write as _;
use std::process::Command;

const NAMES: [&str; 4] = ["a", "b", "c", "d"];
/// How many removed elements are asked for again.
const REMEMBERED: usize = 40;
/// How many nodes there are, about. networkx lists all edges to find an id.
const NODES: usize = 24;

#[derive(Clone, Copy)]
struct Node {
    handle: NodeId,
    id: u64,
}

#[derive(Clone, Copy)]
struct Edge {
    handle: EdgeId,
    id: u64,
    from: u64,
    to: u64,
}

/// Elements that are in the graph, and some that were.
#[derive(Clone, Default)]
struct Known {
    nodes: Vec<Node>,
    edges: Vec<Edge>,
    gone_nodes: Vec<Node>,
    gone_edges: Vec<Edge>,
}

impl Known {
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
    fn end<T>(&mut self, operation: std::fmt::Arguments, result: &Result<T, Error>) {
        let said = match result {
            Ok(_) => "ok",
            Err(Error::Removed) => "absent",
            Err(Error::DuplicateId(_)) => "there",
            Err(other) => panic!("{other}: {operation}"),
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
fn id(known: &Known, next: &mut u64, random: &mut fastrand::Rng) -> u64 {
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

fn step(
    edit: &mut Edit,
    known: &mut Known,
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
            let made = edit.add_node_as(Id::new(0, id), name);
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
                let touches = |edge: &Edge| edge.from == node.id || edge.to == node.id;
                known
                    .gone_edges
                    .extend(known.edges.iter().filter(|edge| touches(edge)));
                known.edges.retain(|edge| !touches(edge));
            }
        }
        (2..6, Some(from), Some(to), _) => {
            let id = id(known, next, random);
            let made = edit.add_edge_as(Id::new(0, id), name, from.handle, to.handle);
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
            let set = edit.set(node.handle, name, value);
            log.end(format_args!("set-node {} {name} {value}", node.id), &set);
        }
        (9, Some(node), ..) => {
            let unset = edit.unset(node.handle, name);
            log.end(format_args!("unset-node {} {name}", node.id), &unset);
        }
        (10, .., Some(edge)) => {
            let set = edit.set(edge.handle, name, value);
            let Edge { id, from, to, .. } = edge;
            log.end(
                format_args!("set-edge {id} {from} {to} {name} {value}"),
                &set,
            );
        }
        (11, .., Some(edge)) => {
            let unset = edit.unset(edge.handle, name);
            let Edge { id, from, to, .. } = edge;
            log.end(format_args!("unset-edge {id} {from} {to} {name}"), &unset);
        }
        (12.., Some(node), ..) => {
            let said = neighbours(edit.snapshot(), node.handle);
            log.add(format_args!("neighbours {}", node.id), said);
        }
        _ => {}
    }
    known.forget_some();
}

/// The edges of a node with their other ends, and its neighbours.
fn neighbours(graph: &Snapshot, node: NodeId) -> String {
    if graph.node(node).is_err() {
        assert_eq!(
            graph.successors(node).count() + graph.predecessors(node).count(),
            0
        );
        return "absent".to_owned();
    }
    let count = |node: NodeId| graph.node(node).expect("a node").id().count();
    let pairs = |pairs: &mut dyn Iterator<Item = (u64, NodeId)>| {
        let mut pairs: Vec<_> = pairs.map(|(edge, end)| (edge, count(end))).collect();
        pairs.sort_unstable();
        let pairs = pairs.iter().map(|(edge, end)| format!("{edge}:{end}"));
        pairs.collect::<Vec<_>>().join(",")
    };
    let nodes = |nodes: &mut dyn Iterator<Item = NodeId>| {
        let mut nodes: Vec<u64> = nodes.map(count).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let nodes = nodes.iter().map(u64::to_string);
        nodes.collect::<Vec<_>>().join(",")
    };
    [
        pairs(
            &mut graph
                .out_edges(node, None)
                .map(|e| (e.id().count(), e.to())),
        ),
        pairs(
            &mut graph
                .in_edges(node, None)
                .map(|e| (e.id().count(), e.from())),
        ),
        nodes(&mut graph.successors(node)),
        nodes(&mut graph.predecessors(node)),
    ]
    .join(" | ")
}

/// The whole graph in one line.
fn printed(graph: &Snapshot) -> String {
    let listed = |attributes: &mut dyn Iterator<Item = (&str, &Value)>, kind: &str| {
        let number = |value: &Value| value.as_i64().expect("an integer");
        let texts = attributes.map(|(name, value)| format!("{name}={}", number(value)));
        let mut texts: Vec<_> = texts.chain([format!("type={kind}")]).collect();
        texts.sort_unstable();
        texts.join(" ")
    };
    let mut nodes: Vec<_> = graph.nodes().collect();
    nodes.sort_by_key(property_graph::NodeRef::id);
    let nodes = nodes.iter().map(|node| {
        let attributes = listed(&mut node.attributes(), node.type_name());
        format!("{} {attributes}", node.id().count())
    });
    let mut edges: Vec<_> = graph.edges().collect();
    edges.sort_by_key(property_graph::EdgeRef::id);
    let count = |node: NodeId| graph.node(node).expect("a node").id().count();
    let edges = edges.iter().map(|edge| {
        let attributes = listed(&mut edge.attributes(), edge.type_name());
        let (from, to) = (count(edge.from()), count(edge.to()));
        format!("{} {from} {to} {attributes}", edge.id().count())
    });
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

#[test]
fn random_changes_equal_networkx() {
    let test = "random_changes_equal_networkx";
    let Some(python) = python::interpreter("networkx==3.6.1", test) else {
        return;
    };
    let count = count();
    let mut random = fastrand::Rng::with_seed(24);
    let graph = Graph::new(Schema::anything().into(), 1);
    let (mut known, mut next, mut log) = (Known::default(), 0, Log::default());
    let mut round = 0;
    while log.said.len() < count {
        let fails = random.u32(0..10) == 0;
        let before = known.clone();
        if fails {
            log.add(format_args!("save"), "ok");
        }
        let changed = graph.change(Time::ZERO, |edit| {
            for _ in 0..random.usize(1..12) {
                step(edit, &mut known, &mut next, &mut log, &mut random);
            }
            // A change that fails leaves nothing.
            if fails { Err(Error::NoFrame) } else { Ok(()) }
        });
        assert_eq!(changed.is_err(), fails);
        if fails {
            log.add(format_args!("back"), "ok");
            known = before;
        }
        round += 1;
        if round % 50 == 0 {
            log.add(format_args!("print"), printed(&graph.snapshot()));
        }
    }
    log.add(format_args!("print"), printed(&graph.snapshot()));
    for said in ["ok", "absent", "there"] {
        let count = log.said.iter().filter(|known| *known == said).count();
        assert!(count > log.said.len() / 1000, "{said}: {count}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("operations.txt");
    std::fs::write(&file, &log.operations).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/oracle.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let theirs = String::from_utf8(output.stdout).expect("a text");
    assert_eq!(theirs.lines().count(), log.said.len());
    let operations = log.operations.lines().enumerate();
    for (((at, operation), ours), theirs) in operations.zip(&log.said).zip(theirs.lines()) {
        assert_eq!(ours, theirs, "operation {at}: {operation}");
    }
}
