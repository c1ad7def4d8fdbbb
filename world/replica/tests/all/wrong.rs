//! What others send wrongly changes nothing, and is counted.

use crate::network::{CALM, Network, add, flat};
use property_graph::{Schema, Value};
use rc_middleware::{Reader, Writer};
use rc_world::{Message, Rights, Setup, Topic, World};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);

/// A change as a stranger writes it: one step.
struct Forged {
    schema: u64,
    sender: u64,
    time: i64,
    since: u64,
    upto: u64,
    count: u64,
    writer: u64,
    sequence: u64,
    name: &'static str,
}

impl Forged {
    fn message(&self) -> Message {
        let mut writer = Writer::default();
        writer.put(&self.schema);
        writer.put(&self.sender);
        writer.put(&self.time);
        writer.put(&self.since);
        writer.put(&self.upto);
        writer.put(&1_u32);
        writer.put(&0_u8);
        writer.put(&self.count);
        writer.put(&self.writer);
        writer.put(&self.sequence);
        writer.put(&self.name.to_owned());
        for _ in 0..4 {
            writer.put(&0_u64);
        }
        writer.put(&0_u8);
        for _ in 0..4 {
            writer.put(&0_u32);
        }
        let bytes = writer.into_bytes();
        Message::decode(Topic::Change, &mut Reader::new(&bytes)).expect("a message")
    }
}

/// The schema as messages of a world name it.
fn schema_of(world: &World) -> u64 {
    world.turn(Duration::ZERO);
    let digest = world.take().expect("a digest");
    assert_eq!(digest.topic(), Topic::Digest);
    let mut writer = Writer::default();
    digest.encode(&mut writer);
    let bytes = writer.into_bytes();
    Reader::new(&bytes).get().expect("a number")
}

#[test]
fn what_no_replica_sends_is_refused() {
    let world = World::new(Setup::new("mapper", flat()).with_writer(7));
    add(&world, "room", "kitchen");
    while world.take().is_some() {}
    let schema = schema_of(&world);
    let sound = || Forged {
        schema,
        sender: 9,
        time: 0,
        since: 0,
        upto: 1,
        count: 1,
        writer: 9,
        sequence: 1,
        name: "room",
    };
    let wrong = [
        (
            Forged {
                schema: 5,
                ..sound()
            },
            "a replica has another schema",
        ),
        (
            Forged {
                writer: 7,
                ..sound()
            },
            "a change has the number of another writer, or none of its own",
        ),
        (
            Forged {
                sequence: 4,
                ..sound()
            },
            "a change has the number of another writer, or none of its own",
        ),
        (
            Forged {
                name: "a\u{1b}[2J",
                ..sound()
            },
            "the schema has no type `a\\u{1b}[2J`",
        ),
        (
            Forged {
                name: "roof",
                ..sound()
            },
            "the schema has no type `roof`",
        ),
        (sound(), "a `room` has no `name`"),
        (
            Forged {
                name: "in",
                count: 1 << 63,
                ..sound()
            },
            "the schema has no type `in`",
        ),
        (
            Forged {
                since: 1 << 62,
                upto: (1 << 62) + 1,
                sequence: (1 << 62) + 1,
                ..sound()
            },
            "a `room` has no `name`",
        ),
    ];
    for (at, (forged, reason)) in wrong.iter().enumerate() {
        world.receive(SECOND, forged.message());
        let counts = world.status(SECOND).counts;
        assert_eq!(counts.refused, at as u64 + 1, "{reason}");
        assert_eq!(counts.last_refusal, *reason);
        assert_eq!(world.snapshot().node_count(), 1);
    }
    // Its own messages come back to it.
    world.receive(
        SECOND,
        Forged {
            sender: 7,
            ..sound()
        }
        .message(),
    );
    assert_eq!(world.status(SECOND).counts.refused, wrong.len() as u64);
}

#[test]
fn counts_near_the_end_and_times_far_ahead_do_no_harm() {
    let open = || Schema::anything().into();
    let world = World::new(Setup::new("mapper", open()).with_writer(7));
    let schema = schema_of(&world);
    let far = Forged {
        schema,
        sender: 9,
        // The year 2500.
        time: 16_725_225_600_000_000_000_i128 as i64,
        since: 0,
        upto: 1,
        count: 1 << 63,
        writer: 9,
        sequence: 1,
        name: "room",
    };
    world.receive(SECOND, far.message());
    let refusal = world.status(SECOND).counts.last_refusal;
    assert_eq!(
        refusal,
        "the delta is damaged: a number of writer 9 is too far ahead"
    );
    let late = Forged {
        count: 1,
        time: i64::MAX,
        ..far
    };
    world.receive(SECOND, late.message());
    assert_eq!(world.snapshot().node_count(), 1);
    // The clock of this replica stands at zero: others may be ahead by a second.
    assert_eq!(world.snapshot().time(), SECOND);
    add(&world, "room", "kitchen");
    assert_eq!(world.snapshot().node_count(), 2);
}

#[test]
fn any_bytes_are_a_message_or_an_error() {
    let mut network = Network::new(2, CALM, 5);
    add(network.at(0), "room", "kitchen");
    let mut messages = Vec::new();
    for at in [0, 1] {
        network.at(at).turn(SECOND);
        while let Some(message) = network.at(at).take() {
            messages.push(message);
        }
    }
    let world = network.world(0, Rights::everything());
    for _ in 0..20_000 {
        let message = &messages[network.random.usize(..messages.len())];
        let mut writer = Writer::default();
        message.encode(&mut writer);
        let mut bytes = writer.into_bytes();
        for _ in 0..network.random.usize(1..6) {
            let at = network.random.usize(..bytes.len());
            bytes[at] = network.random.u8(..);
        }
        bytes.truncate(network.random.usize(1..=bytes.len()));
        let topic = if network.random.bool() {
            message.topic()
        } else {
            rc_world::STATE[network.random.usize(..4)]
        };
        if let Ok(message) = Message::decode(topic, &mut Reader::new(&bytes)) {
            world.receive(SECOND, message);
        }
        world.turn(SECOND);
        while world.take().is_some() {}
    }
    assert!(world.status(SECOND).peers.len() <= 1024);
    assert!(world.snapshot().node_count() < 20_000);
}

#[test]
fn a_value_that_does_not_fit_is_refused_and_a_large_one_is_advised() {
    let world = World::new(Setup::new("mapper", Schema::anything().into()));
    let large = world.change(|edit| {
        let node = edit.add_node("picture")?;
        Ok(edit.set(node, "pixels", Value::Bytes(vec![0; 65 * 1024].into()))?)
    });
    let advice = "a value for `pixels` has more than 65536 bytes; publish it on a topic, and set a \
                  reference to the sample";
    assert_eq!(large.expect_err("an error").to_string(), advice);
}

#[test]
fn two_instances_with_one_name_are_two_replicas() {
    let mut network = Network::new(2, CALM, 5);
    let twin = |writer| World::new(Setup::new("agent0", flat()).with_writer(writer));
    network.worlds = vec![Some(twin(8)), Some(twin(9))];
    add(network.at(0), "room", "kitchen");
    add(network.at(1), "room", "hall");
    network.converge(5 * SECOND);
    assert_eq!(network.at(0).snapshot().node_count(), 2);
    let status = network.at(0).status(network.now);
    assert_eq!(status.peers[0].name, status.name);
}

#[test]
fn one_that_slept_for_a_minute_catches_up() {
    let mut network = Network::new(3, CALM, 5);
    network.run(SECOND);
    network.groups = vec![0, 0, 1];
    for step in 0..600 {
        add(network.at(step % 2), "room", &format!("room {step}"));
        if step >= 10 {
            let removed = network.at(step % 2).change(|edit| {
                let name = format!("room {}", step - 10);
                let room = edit.snapshot().named(&name).next();
                if let Some(room) = room {
                    edit.remove_node(room)?;
                }
                Ok(())
            });
            removed.expect("a sound change");
        }
        network.run(Duration::from_millis(100));
    }
    network.groups = vec![0; 3];
    network.converge(5 * SECOND);
    assert_eq!(network.at(2).snapshot().node_count(), 10);
    let clock_set_back = network.at(2).status(Duration::ZERO);
    assert_eq!(clock_set_back.peers.len(), 2);
}
