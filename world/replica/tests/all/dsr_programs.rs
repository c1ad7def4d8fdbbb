//! DSR's own programs of tests, rewritten: many agents change attributes of one node, insert and remove nodes and edges at
//! the same time, and give one attribute different values. DSR's have 1,000 rounds, as `cargo xtask soak world` has.

use crate::network::{CALM, Network, add};
use property_graph::Value;
use rc_world::World;
use std::collections::BTreeSet;
use std::time::Duration;

/// How many agents there are.
const AGENTS: usize = 5;
const LIMIT: Duration = Duration::from_secs(20);

/// How many rounds there are. `RC_WORLD_ROUNDS` sets another number.
const ROUNDS: usize = 200;

fn rounds() -> usize {
    let rounds = std::env::var("RC_WORLD_ROUNDS").ok();
    rounds
        .and_then(|rounds| rounds.parse().ok())
        .unwrap_or(ROUNDS)
}

fn network(seed: u64) -> Network {
    let mut network = Network::new(AGENTS, CALM, seed);
    network.turn = 5;
    network
}

fn named(world: &World, name: &str) -> property_graph::NodeId {
    world.snapshot().named(name).next().expect("a node")
}

/// `change_attribute`: each agent sets an attribute of a node of its own, which all have in the end.
#[test]
fn each_agent_changes_an_attribute() {
    let mut network = network(1);
    for at in 0..AGENTS {
        add(network.at(at), "door", &format!("door {at}"));
    }
    network.converge(LIMIT);
    for round in 0..rounds() {
        for at in 0..AGENTS {
            let world = network.at(at);
            let door = named(world, &format!("door {at}"));
            let set = world.change(|edit| Ok(edit.set(door, "width", round as f64)?));
            set.expect("a change");
        }
        network.run(Duration::from_millis(5));
    }
    network.converge(LIMIT);
    let last = Value::Float(rounds() as f64 - 1.0);
    for at in 0..AGENTS {
        let now = network.at(at).snapshot();
        assert_eq!(now.of_type("door").count(), AGENTS);
        for door in now.of_type("door") {
            assert_eq!(now.get(door, "width"), Some(&last));
        }
        assert!(network.at(at).conflicts().is_empty());
    }
}

/// `concurrent_operations` and `conflict_resolution`: all agents give one attribute a value at the same moment. All show one of
/// these values, the same one, and whoever lost against its own learns of it.
#[test]
fn all_agents_change_one_attribute() {
    let mut network = network(2);
    add(network.at(0), "door", "front");
    network.converge(LIMIT);
    let mut overruled = 0;
    for round in 0..rounds() {
        let value = |at: usize| (round * AGENTS + at) as f64;
        for at in 0..AGENTS {
            let world = network.at(at);
            let door = named(world, "front");
            let set = world.change(|edit| Ok(edit.set(door, "width", value(at))?));
            set.expect("a change");
        }
        network.run(Duration::from_millis(10));
        let shown: BTreeSet<u64> = (0..AGENTS)
            .map(|at| {
                let now = network.at(at).snapshot();
                let width = now.get(named(network.at(at), "front"), "width");
                width.and_then(Value::as_f64).expect("a width") as u64
            })
            .collect();
        assert_eq!(shown.len(), 1, "round {round}: {shown:?}");
        let shown = *shown.first().expect("a value");
        assert!(
            (0..AGENTS).any(|at| value(at) as u64 == shown),
            "round {round}: {shown}"
        );
        for at in 0..AGENTS {
            while let Some(one) = network.at(at).overruled() {
                assert_eq!(one.attribute, "width");
                overruled += 1;
            }
        }
    }
    network.converge(LIMIT);
    // The one whose value is shown has heard of all others.
    assert_eq!(overruled, rounds() * (AGENTS - 1));
}

/// `insert_remove_node`: agents insert and remove nodes at the same time; all have those that nobody removed.
#[test]
fn agents_insert_and_remove_nodes() {
    let mut network = network(3);
    let mut expected = BTreeSet::new();
    for round in 0..rounds() {
        for at in 0..AGENTS {
            let name = format!("door {at} {round}");
            add(network.at(at), "door", &name);
            expected.insert(name);
        }
        network.run(Duration::from_millis(10));
        // Two nodes are removed by two agents each, a third one by one.
        for (at, of) in [1, 2, 1, 4, 2].into_iter().enumerate() {
            let name = format!("door {of} {round}");
            let world = network.at(at);
            let door = named(world, &name);
            let removed = world.change(|edit| Ok(edit.remove_node(door)?));
            removed.expect("a change");
            expected.remove(&name);
        }
        network.run(Duration::from_millis(5));
    }
    network.converge(LIMIT);
    for at in 0..AGENTS {
        let now = network.at(at).snapshot();
        let names: BTreeSet<String> = now.nodes().map(|node| node.name().to_owned()).collect();
        assert_eq!(names, expected);
    }
}

/// `insert_remove_edge`: agents put doors into rooms and take them out again. A door has one room at most, whoever put it
/// there last; an edge of a room that another one removes meanwhile is gone or listed as a conflict, everywhere alike.
#[test]
fn agents_insert_and_remove_edges() {
    let mut network = network(4);
    for at in 0..AGENTS {
        add(network.at(at), "door", &format!("door {at}"));
        add(network.at(at), "room", &format!("room {at}"));
    }
    network.converge(LIMIT);
    for round in 0..rounds() {
        for at in 0..AGENTS {
            let world = network.at(at);
            let (door, room) = (
                named(world, &format!("door {}", (at + round) % AGENTS)),
                named(world, &format!("room {at}")),
            );
            let put = world.change(|edit| {
                let old = edit.snapshot().out_edges(door, None).next();
                if let Some(old) = old.map(|edge| edge.edge_id()) {
                    edit.remove_edge(old)?;
                }
                if !round.is_multiple_of(3) {
                    edit.add_edge("in", door, room)?;
                }
                Ok(())
            });
            put.expect("a change");
        }
        network.run(Duration::from_millis(10));
    }
    network.converge(LIMIT);
    let shown = |at: usize| -> BTreeSet<(String, String)> {
        let now = network.at(at).snapshot();
        let name = |node| now.node(node).expect("a node").name().to_owned();
        now.edges()
            .map(|edge| (name(edge.from()), name(edge.to())))
            .collect()
    };
    let first = shown(0);
    for at in 0..AGENTS {
        assert_eq!(shown(at), first);
        let doors: BTreeSet<&String> = first.iter().map(|(door, _)| door).collect();
        assert_eq!(doors.len(), first.len(), "a door has one room at most");
        assert!(network.at(at).conflicts().is_empty());
        assert_eq!(network.at(at).fault(), None);
    }
}
