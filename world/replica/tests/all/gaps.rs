//! Gaps: changes that arrive before earlier ones of their writer.

use crate::network::{CALM, Network, add, through_bytes};
use crate::partitions::{STORM, change, graph_of};
use rc_middleware::{Reader, Writer};
use rc_world::{Message, Rights, Token, Topic, World};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);

/// The one change that a replica has to send.
fn taken(world: &World) -> Message {
    let all = std::iter::from_fn(|| world.take());
    let mut changes = all.filter(|message| message.topic() == Topic::Change);
    let change = changes.next().expect("a change");
    assert!(changes.next().is_none());
    change
}

/// The last step of a change.
fn token_of(change: &Message) -> Token {
    let mut writer = Writer::default();
    change.encode(&mut writer);
    let bytes = writer.into_bytes();
    let mut reader = Reader::new(&bytes);
    let mut next = || reader.get::<u64>().expect("a number");
    let [_schema, sender, _time, _since, upto] = std::array::from_fn(|_| next());
    Token {
        writer: sender,
        sequence: upto,
    }
}

#[test]
fn nobody_is_shown_what_lies_behind_a_gap_that_a_dead_writer_has_left() {
    let mut network = Network::new(4, CALM, 5);
    network.run(3 * SECOND);
    let first = add(network.at(0), "room", "kitchen");
    network.run(SECOND);
    // One change reaches nobody, the next one reaches one replica. Then the writer is killed.
    add(network.at(0), "room", "hall");
    taken(network.at(0));
    let last = add(network.at(0), "door", "front");
    network
        .at(1)
        .receive(network.now, through_bytes(&taken(network.at(0))));
    network.kill(0);
    network.run(20 * SECOND);
    network.converge(SECOND);
    for at in 1..4 {
        let world = network.at(at);
        assert!(world.has(first) && !world.has(last));
        assert_eq!(world.snapshot().node_count(), 1, "replica {at}");
        let status = world.status(network.now);
        assert!(!status.is_behind, "{status:#?}");
    }
    assert_eq!(network.at(1).status(network.now).counts.gaps, 1);
    // One that joins has the same, and all of them go on.
    let joins = network.world(0, Rights::everything());
    network.worlds[0] = Some(joins);
    network.run(3 * SECOND);
    add(network.at(0), "door", "back");
    network.converge(5 * SECOND);
    assert_eq!(network.at(3).snapshot().node_count(), 2);
}

#[test]
fn changes_behind_a_gap_follow_each_as_a_version_once_it_is_filled() {
    let mut network = Network::new(2, CALM, 5);
    network.run(3 * SECOND);
    let names = ["kitchen", "hall", "cellar", "attic"];
    let changes = names.map(|name| {
        add(network.at(0), "room", name);
        taken(network.at(0))
    });
    let other = network.at(1);
    for late in changes[1..].iter().rev() {
        other.receive(network.now, late.clone());
        assert_eq!(other.snapshot().node_count(), 0);
    }
    let before = other.snapshot().version();
    other.receive(network.now, changes[0].clone());
    assert_eq!(other.snapshot().node_count(), 4);
    assert_eq!(other.snapshot().version(), before + 4);
    // It asks for nothing.
    network.run(SECOND);
    assert_eq!(network.at(1).status(network.now).counts.asked, 0);
}

#[test]
fn what_waits_behind_a_gap_is_bounded_and_comes_with_the_answer() {
    let mut network = Network::new(2, CALM, 5);
    network.run(3 * SECOND);
    add(network.at(0), "door", "front");
    taken(network.at(0));
    // 20 MB behind the gap.
    let waiting = |network: &Network| network.at(1).status(network.now).waiting;
    for number in 0..500 {
        let made = network.at(0).change(|edit| {
            let room = edit.add_node("room")?;
            Ok(edit.set(room, "name", format!("{number} {}", "x".repeat(40_000)))?)
        });
        made.expect("a sound change");
        network.at(1).receive(network.now, taken(network.at(0)));
    }
    assert_eq!(network.at(1).snapshot().node_count(), 0);
    let most = 15 << 20..=16 << 20;
    assert!(most.contains(&waiting(&network)), "{}", waiting(&network));
    network.converge(5 * SECOND);
    assert_eq!(network.at(1).snapshot().node_count(), 501);
    assert_eq!(waiting(&network), 0);
}

#[test]
fn a_replica_with_a_change_behind_a_gap_is_behind_before_the_writer_has_announced_itself() {
    let mut network = Network::new(1, CALM, 5);
    let late = network.world(1, Rights::everything());
    late.turn(network.now);
    add(network.at(0), "room", "kitchen");
    taken(network.at(0));
    add(network.at(0), "room", "hall");
    late.receive(network.now, taken(network.at(0)));
    assert!(late.status(network.now).is_behind);
    // The writer is silent, and nobody else has the first one.
    let end = network.now + 10 * SECOND;
    late.turn(end);
    let status = late.status(end);
    assert!(!status.is_behind && status.waiting == 0, "{status:#?}");
}

/// The rule of who has what: a replica has all changes of each writer up to one, and none behind it. So
/// it shows what it shows that gets these changes in their order.
#[test]
fn all_have_what_a_replay_of_the_changes_that_they_have_seen_has() {
    for seed in 1..=6 {
        let mut network = Network::new(8, STORM, seed);
        network.turn = 10;
        for step in 0..160 {
            let living = network.living();
            let at = living[network.random.usize(..living.len())];
            change(&mut network, at, step);
            if step % 10 == 9 {
                // Its last messages arrive at some or at none.
                network.weather.lost = 70;
                let at = network.random.usize(..8);
                for more in 0..3 {
                    if network.worlds[at].is_some() {
                        change(&mut network, at, step + more);
                        network.run(Duration::from_millis(10));
                    }
                }
                network.kill(at);
                let again = network.world(at, Rights::everything());
                network.worlds[at] = Some(again);
                network.weather = STORM;
            }
            network.run(Duration::from_millis(20));
        }
        network.converge(30 * SECOND);
        let plain = network.world(99, Rights::everything());
        let (mut seen, mut lost) = (0, 0);
        for change in &network.changes {
            if network.at(0).has(token_of(change)) {
                plain.receive(network.now, change.clone());
                seen += 1;
            } else {
                lost += 1;
            }
        }
        plain.turn(network.now);
        assert_eq!(graph_of(network.at(0)), graph_of(&plain), "seed {seed}");
        assert!(seen > 100 && lost > 0, "{seen} seen, {lost} lost");
    }
}
