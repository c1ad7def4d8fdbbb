//! Replicas converge after losses, kills and partitions.

use crate::network::{CALM, Network, Weather, add};
use property_graph::Value;
use rc_world::{Reason, Rights, Token, World};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);
pub(crate) const STORM: Weather = Weather {
    lost: 10,
    repeated: 5,
    late: 40,
};

/// A random change. Steps that the schema does not allow are left out.
pub(crate) fn change(network: &mut Network, at: usize, step: usize) -> Option<Token> {
    let what = network.random.u32(..10);
    let pick = network.random.usize(..);
    let world = network.at(at);
    let before = world.snapshot().version();
    let result = world.change(|edit| {
        let now = edit.snapshot().clone();
        let nodes: Vec<_> = now.nodes().map(|node| node.node_id()).collect();
        let doors: Vec<_> = now.of_type("door").collect();
        let rooms: Vec<_> = now.of_type("room").collect();
        match what {
            0..3 => {
                let kind = if pick.is_multiple_of(3) {
                    "room"
                } else {
                    "door"
                };
                let node = edit.add_node(kind)?;
                // Some names are taken by others meanwhile.
                edit.set(node, "name", format!("{kind} {}", pick % 200))?;
            }
            3 if !nodes.is_empty() => edit.remove_node(nodes[pick % nodes.len()])?,
            4..6 if !doors.is_empty() && !rooms.is_empty() => {
                let (door, room) = (doors[pick % doors.len()], rooms[pick % rooms.len()]);
                let old = now.out_edges(door, now.symbol("in")).next();
                if let Some(old) = old {
                    edit.remove_edge(old.edge_id())?;
                }
                edit.add_edge("in", door, room)?;
            }
            _ if !doors.is_empty() => {
                let door = doors[pick % doors.len()];
                edit.set(door, "width", step as f64)?;
                edit.set(door, "height", step as f64)?;
            }
            _ => {}
        }
        Ok(())
    });
    let is_changed = network.at(at).snapshot().version() > before;
    result.ok().filter(|_| is_changed)
}

/// No reader sees a part of a change.
fn is_whole(world: &World) -> bool {
    let now = world.snapshot();
    now.of_type("door")
        .all(|door| now.get(door, "width") == now.get(door, "height"))
}

#[test]
fn twenty_replicas_end_equal_after_losses_kills_and_partitions() {
    let mut network = Network::new(20, STORM, 42);
    network.turn = 10;
    let mut tokens: Vec<(usize, Token)> = Vec::new();
    let mut most = 0;
    // `RC_WORLD_STEPS=4000` runs 100 s, with a partition in each 5 s.
    let steps = std::env::var("RC_WORLD_STEPS").ok();
    let steps = steps.and_then(|steps| steps.parse().ok()).unwrap_or(200);
    for step in 0..steps {
        let living = network.living();
        let at = living[network.random.usize(..living.len())];
        if let Some(token) = change(&mut network, at, step) {
            tokens.retain(|(other, _)| *other != at);
            tokens.push((at, token));
        }
        if step % 60 == 59 {
            let at = network.random.usize(..20);
            network.kill(at);
            tokens.retain(|(other, _)| *other != at);
        }
        if step % 60 == 30 {
            for at in 0..20 {
                if network.worlds[at].is_none() {
                    let again = network.world(at, Rights::everything());
                    network.worlds[at] = Some(again);
                }
            }
        }
        match step % 200 {
            60 => (0..20).for_each(|at| network.groups[at] = u8::from(at < 10)),
            120 => network.groups = vec![0; 20],
            _ => {}
        }
        network.run(Duration::from_millis(25));
        if step % 20 == 0 {
            for at in network.living() {
                assert!(is_whole(network.at(at)), "step {step}");
                let status = network.at(at).status(network.now);
                most = most.max(status.queued);
                assert_eq!(status.counts.refused, 0, "{}", status.counts.last_refusal);
                assert_eq!(status.fault, None);
            }
        }
    }
    // Whatever the number of steps.
    network.groups = vec![0; 20];
    network.converge(30 * SECOND);
    assert!(most < 1 << 20, "{most} bytes waited");
    // No change of a living replica is lost.
    for (at, token) in &tokens {
        for other in network.living() {
            assert!(network.at(other).has(*token), "{at} {token}");
        }
    }
    let first = network.living()[0];
    let graph = |at: usize| graph_of(network.at(at));
    for other in network.living() {
        assert_eq!(graph(other), graph(first));
        let conflicts = network.at(other).conflicts();
        assert_eq!(conflicts, network.at(first).conflicts());
    }
    assert!(network.at(first).snapshot().node_count() > 20);
    // Those that were killed are forgotten, and so are their tombstones.
    network.weather = CALM;
    network.turn = 50;
    network.run(70 * SECOND);
    for at in network.living() {
        let status = network.at(at).status(network.now);
        assert_eq!(status.tombstones, 0, "{status:#?}");
        assert!(status.peers.len() < 20);
    }
}

/// The graph as a text.
pub(crate) fn graph_of(world: &World) -> Vec<String> {
    let now = world.snapshot();
    let nodes = now.nodes().map(|node| {
        let mut all: Vec<_> = node.attributes().map(|a| format!("{a:?}")).collect();
        all.sort();
        format!("{:?} {} {all:?}", node.id(), node.type_name())
    });
    let edges = now.edges().map(|edge| {
        let [from, to] = [edge.from(), edge.to()].map(|end| now.node(end).map(|end| end.id()));
        format!("{:?} {} {from:?} {to:?}", edge.id(), edge.type_name())
    });
    let mut all: Vec<String> = nodes.chain(edges).collect();
    all.sort();
    all
}

#[test]
fn conflicts_of_a_partition_are_listed_when_it_heals() {
    let mut network = Network::new(2, CALM, 3);
    network.run(SECOND);
    network.groups = vec![0, 1];
    add(network.at(0), "room", "kitchen");
    network.run(2 * SECOND);
    add(network.at(1), "room", "kitchen");
    add(network.at(1), "room", "hall");
    network.run(8 * SECOND);
    let peers = network.at(0).status(network.now).peers;
    assert!(!peers[0].is_live && !peers[0].has_left);
    network.groups = vec![0, 0];
    network.converge(5 * SECOND);
    for at in [0, 1] {
        let conflicts = network.at(at).conflicts();
        assert_eq!(conflicts.len(), 1);
        assert_eq!(conflicts[0].reason, Reason::Key);
        assert_eq!(network.at(at).snapshot().node_count(), 2);
        assert_eq!(network.at(at).status(network.now).conflicts, 1);
        let health = network.at(at).health();
        let told = "room `kitchen`: an older node has the same key";
        assert_eq!((health.conflicts, health.behind), (1, 0));
        assert_eq!(health.first_conflicts, [told]);
    }
    // With another name, both are there.
    let renamed = network.at(0).change(|edit| {
        let room = edit.snapshot().named("kitchen").next().expect("a room");
        Ok(edit.set(room, "name", "old kitchen")?)
    });
    renamed.expect("a sound change");
    network.converge(5 * SECOND);
    assert_eq!(network.at(1).conflicts(), []);
    assert_eq!(network.at(1).snapshot().node_count(), 3);
}

/// The writer of the shown value learns of the other one, and may decide: the other writer cannot
/// know that it was asked.
#[test]
fn of_two_values_of_a_partition_the_winner_learns_and_may_decide() {
    let mut network = Network::new(3, CALM, 3);
    network.run(SECOND);
    add(network.at(2), "door", "front");
    network.run(SECOND);
    let set = |network: &Network, at: usize, attribute: &str, value: f64| {
        let changed = network.at(at).change(|edit| {
            let door = edit.snapshot().named("front").next().expect("a door");
            Ok(edit.set(door, attribute, value)?)
        });
        changed.expect("a sound change")
    };
    network.groups = vec![0, 1, 0];
    set(&network, 0, "width", 0.8);
    set(&network, 1, "width", 0.7);
    set(&network, 1, "width", 0.9);
    // Values that agree, and those of one side alone, are nobody's business.
    set(&network, 0, "height", 2.0);
    set(&network, 1, "height", 2.0);
    network.run(6 * SECOND);
    network.groups = vec![0, 0, 0];
    network.converge(5 * SECOND);
    let shown = network.at(2).snapshot();
    let door = shown.named("front").next().expect("a door");
    assert_eq!(shown.get(door, "width"), Some(&Value::Float(0.9)));
    for at in [0, 2] {
        assert_eq!(network.at(at).overruled(), None);
    }
    let overruled = network.at(1).overruled().expect("another value");
    assert_eq!(overruled.attribute, "width");
    assert_eq!(overruled.shown, Some(Value::Float(0.9)));
    assert_eq!(overruled.other, Some(Value::Float(0.8)));
    assert_eq!(network.at(1).overruled(), None);
    // It decides for the lesser one.
    set(&network, 1, "width", 0.8);
    network.converge(5 * SECOND);
    let shown = network.at(0).snapshot();
    assert_eq!(shown.get(door, "width"), Some(&Value::Float(0.8)));
    // One after the other is not a conflict.
    set(&network, 0, "width", 0.6);
    network.run(SECOND);
    set(&network, 1, "width", 0.5);
    network.converge(5 * SECOND);
    assert!((0..3).all(|at| network.at(at).overruled().is_none()));
}

#[test]
fn one_that_says_goodbye_is_not_waited_for() {
    let mut network = Network::new(3, CALM, 3);
    network.run(SECOND);
    network.at(2).leave();
    network.run(Duration::from_millis(5));
    network.kill(2);
    let token = add(network.at(0), "room", "kitchen");
    network.run(SECOND);
    assert!(network.at(0).all_have(token));
    let status = network.at(0).status(network.now);
    let gone = status.peers.iter().find(|peer| peer.has_left);
    assert_eq!(gone.map(|peer| peer.name.as_str()), Some("agent2"));
}

/// Each side of a partition joins a door with a room that the other side removes, or ends at. Such edges are
/// shown nowhere, and one that nobody removed would stay for good.
#[test]
fn edges_without_an_end_are_removed_also_those_of_writers_that_have_ended() {
    let mut network = Network::new(4, CALM, 3);
    network.run(Duration::from_secs(4));
    for name in ["kitchen", "hall"] {
        add(network.at(0), "room", name);
    }
    for name in ["front", "back"] {
        add(network.at(0), "door", name);
    }
    network.converge(Duration::from_secs(10));
    network.groups = vec![0, 0, 1, 1];
    for (at, door) in [(2, "front"), (3, "back")] {
        let joined = network.at(at).change(|edit| {
            let named = |name: &str| edit.snapshot().named(name).next().expect("a node");
            let (door, room) = (named(door), named("kitchen"));
            edit.add_edge("in", door, room)?;
            Ok(())
        });
        joined.expect("a sound change");
    }
    let removed = network.at(0).change(|edit| {
        let room = edit.snapshot().named("kitchen").next().expect("a room");
        Ok(edit.remove_node(room)?)
    });
    removed.expect("a sound change");
    network.run(Duration::from_secs(2));
    // One of the writers ends before it hears of the removal.
    network.kill(3);
    network.groups = vec![0; 4];
    network.run(Duration::from_millis(2500));
    network.converge(Duration::from_secs(10));
    network.run(Duration::from_secs(12));
    for at in network.living() {
        let world = network.at(at);
        let status = world.status(network.now);
        assert_eq!((status.conflicts, world.conflicts().len()), (0, 0));
        assert_eq!(status.elements, 3, "a room and two doors");
        assert_eq!(status.tombstones, 0);
    }
}
