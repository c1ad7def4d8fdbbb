//! Invalid messages of others change nothing, and are counted.

use crate::network::{CALM, Network, add, flat};
use property_graph::{Id, Schema, Value};
use rc_middleware::{Reader, Writer};
use rc_world::{Message, Rights, Setup, Topic, World};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);

/// A change as a stranger writes it: one step.
pub(crate) struct Forged {
    pub(crate) schema: u64,
    pub(crate) sender: u64,
    pub(crate) time: i64,
    pub(crate) since: u64,
    pub(crate) upto: u64,
    pub(crate) count: u64,
    pub(crate) writer: u64,
    pub(crate) sequence: u64,
    pub(crate) name: &'static str,
}

impl Forged {
    pub(crate) fn message(&self) -> Message {
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
pub(crate) fn schema_of(world: &World) -> u64 {
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

/// A step: what, name, element, end, value.
pub(crate) type StepOf<'s> = (u8, &'s str, Id, Id, Option<Value>);

/// The steps that a stranger with the writer 9 sends as one change, in order.
pub(crate) fn steps(schema: u64, since: u64, steps: &[StepOf<'_>]) -> Message {
    let mut writer = Writer::default();
    writer.put(&schema);
    writer.put(&9_u64);
    writer.put(&0_i64);
    writer.put(&since);
    writer.put(&(since + steps.len() as u64));
    put_steps(&mut writer, since, steps);
    let bytes = writer.into_bytes();
    Message::decode(Topic::Change, &mut Reader::new(&bytes)).expect("a message")
}

/// Writes steps of the writer 9 that follow this one.
pub(crate) fn put_steps(writer: &mut Writer<'_>, since: u64, steps: &[StepOf<'_>]) {
    writer.put(&(steps.len() as u32));
    for ((what, name, of, to, value), sequence) in steps.iter().zip(since + 1..) {
        writer.put(what);
        writer.put(&(1000 + sequence));
        writer.put(&9_u64);
        writer.put(&sequence);
        writer.put(&(*name).to_owned());
        for id in [of, to] {
            writer.put(&id.writer());
            writer.put(&id.count());
        }
        let (mut texts, mut floats, mut bytes) = (Vec::new(), Vec::new(), Vec::new());
        let kind: u8 = match value {
            None => 0,
            Some(Value::Text(text)) => {
                texts.push(text.to_string());
                4
            }
            Some(Value::Bytes(all)) => {
                bytes.extend_from_slice(all);
                5
            }
            Some(value) => {
                floats.extend_from_slice(&value.numbers().expect("numbers"));
                7
            }
        };
        writer.put(&kind);
        writer.put(&Vec::<i64>::new());
        writer.put(&floats);
        writer.put(&texts);
        writer.put(&bytes);
    }
}

/// Whether a world still shows what is changed.
fn is_alive(world: &World) -> bool {
    let before = world.snapshot().node_count();
    add(world, "room", "a new room");
    let gone = world.change(|edit| {
        let room = edit.snapshot().named("a new room").next().expect("a room");
        Ok(edit.remove_node(room)?)
    });
    gone.is_ok() && world.fault().is_none() && world.snapshot().node_count() == before
}

#[test]
fn no_step_of_a_stranger_keeps_others_from_being_shown() {
    let none = Id::new(0, 0);
    let text = |text: &str| Some(Value::Text(text.into()));
    let door = Id::new(7, 1);
    let own = |count: u64| Id::new(9, count);
    let cases = [
        // The name of a door is removed, and it has to have one.
        (vec![(2, "name", door, none, None)], true),
        // An edge of a room to a room, which may only start at a door.
        (
            vec![
                (0, "room", none, none, None),
                (2, "name", own(1), none, text("hall")),
                (1, "in", own(1), own(1), None),
            ],
            false,
        ),
        // A pose with too few numbers.
        (
            vec![(2, "pose", door, none, Some(Value::from([1.0])))],
            true,
        ),
    ];
    for (steps_of, is_refused) in cases {
        let world = World::new(Setup::new("mapper", flat()).with_writer(7));
        let schema = schema_of(&world);
        add(&world, "door", "front");
        world.receive(SECOND, steps(schema, 0, &steps_of));
        world.turn(SECOND);
        let refused = world.status(SECOND).counts.refused;
        assert_eq!(refused, u64::from(is_refused), "{steps_of:?}");
        let wide = world.change(|edit| {
            let door = edit.add_node("door")?;
            edit.set(door, "name", "back")?;
            Ok(edit.set(door, "width", 0.8)?)
        });
        wide.expect("a sound change");
        assert!(is_alive(&world), "{steps_of:?}: {:?}", world.fault());
    }
    // An attribute comes before its element, with another type and a later count than there.
    let world = World::new(Setup::new("mapper", flat()).with_writer(7));
    let schema = schema_of(&world);
    let early = [(2, "name", own(1), none, Some(Value::from([1.0])))];
    world.receive(SECOND, steps(schema, 2, &early));
    assert_eq!(world.status(SECOND).counts.refused, 0);
    let late = [
        (0, "door", none, none, None),
        (2, "name", own(1), none, text("front")),
    ];
    world.receive(SECOND, steps(schema, 0, &late));
    world.turn(SECOND);
    assert!(is_alive(&world));
    // It waited for those before it, and is refused now.
    assert_eq!(world.status(SECOND).counts.refused, 1);
    assert_eq!(world.conflicts(), []);
    assert!(world.snapshot().named("front").next().is_some());
    // A change that is too large is refused in an open world, too.
    let world = World::new(Setup::new("mapper", Schema::anything().into()).with_writer(7));
    let schema = schema_of(&world);
    let large = Some(Value::Bytes(vec![0; 70_000].into()));
    let picture = [
        (0, "picture", none, none, None),
        (2, "pixels", own(1), none, large),
    ];
    world.receive(SECOND, steps(schema, 0, &picture));
    assert_eq!(world.status(SECOND).counts.refused, 1);
    assert!(is_alive(&world));
}

#[test]
fn counts_near_the_end_and_times_far_ahead_do_no_harm() {
    let open = || Schema::anything().into();
    let world = World::new(Setup::new("mapper", open()).with_writer(7));
    let schema = schema_of(&world);
    let far = Forged {
        schema,
        sender: 9,
        time: 0,
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
    // The latest time of a message, and the year 2500, which becomes one before 1970 in 64 bits.
    let year_2500 = 16_725_225_600_000_000_000_u64.cast_signed();
    for (at, time) in (0..).zip([i64::MAX, year_2500]) {
        let late = Forged {
            since: at,
            upto: at + 1,
            sequence: at + 1,
            count: 1,
            time,
            ..far
        };
        world.receive(SECOND, late.message());
        assert_eq!(world.snapshot().node_count() as u64, at + 1);
        // The clock of this replica stands at zero: others may be ahead by a second. No version is
        // before the last one.
        assert_eq!(world.snapshot().time(), SECOND);
    }
    add(&world, "room", "kitchen");
    assert_eq!(world.snapshot().node_count(), 3);
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

/// A digest of a stranger who has seen this many writers.
pub(crate) fn digest(schema: u64, sender: u64, writers: u64) -> Message {
    let mut writer = Writer::default();
    writer.put(&schema);
    writer.put(&sender);
    writer.put(&"stranger".to_owned());
    writer.put(&(writers as u32));
    for own in 0..writers {
        writer.put(&(own + 1000));
        writer.put(&1_u64);
    }
    writer.put(&Vec::<u64>::new());
    writer.put(&0_u64);
    writer.put(&0_u64);
    writer.put(&0_u32);
    writer.put(&false);
    let bytes = writer.into_bytes();
    Message::decode(Topic::Digest, &mut Reader::new(&bytes)).expect("a message")
}

#[test]
fn strangers_with_many_writers_are_refused() {
    let world = World::new(Setup::new("mapper", flat()).with_writer(7));
    let schema = schema_of(&world);
    for sender in 0..20 {
        world.receive(SECOND, digest(schema, 100 + sender, 100_000));
    }
    let status = world.status(SECOND);
    assert_eq!((status.peers.len(), status.counts.refused), (2, 18));
}

/// A question for everything, or for chunks of its answer.
fn question(number: u64, chunks: &[u32]) -> Message {
    let mut writer = Writer::default();
    writer.put(&9_u64);
    writer.put(&7_u64);
    writer.put(&number);
    writer.put(&0_u32);
    writer.put(&Vec::<u32>::new());
    writer.put(&chunks.to_vec());
    let bytes = writer.into_bytes();
    Message::decode(Topic::Ask, &mut Reader::new(&bytes)).expect("a message")
}

#[test]
fn chunks_are_those_of_one_answer() {
    let world = World::new(Setup::new("mapper", flat()).with_writer(7));
    for at in 0..1000 {
        add(&world, "room", &format!("room {at}"));
    }
    while world.take().is_some() {}
    let chunks = |now: Duration, message: Message| {
        world.receive(now, message);
        let all: Vec<Message> = std::iter::from_fn(|| world.take()).collect();
        all.into_iter()
            .filter(|one| one.topic() == Topic::Chunk)
            .collect::<Vec<_>>()
    };
    let first = chunks(SECOND, question(1, &[]));
    assert!(first.len() > 2);
    // A change in the meantime is in no chunk of this answer.
    add(&world, "room", "a new room");
    let again = chunks(2 * SECOND, question(1, &[0, 1]));
    assert_eq!(again, first[..2]);
    // After a while nobody has it any more, and the one that asks has to ask again.
    assert_eq!(chunks(9 * SECOND, question(1, &[1])), []);
    assert!(chunks(9 * SECOND, question(2, &[])).len() > 2);
}

#[test]
fn a_message_of_many_samples_does_not_use_up_the_counts() {
    let open = || Schema::anything().into();
    let world = World::new(Setup::new("mapper", open()).with_writer(7));
    let schema = schema_of(&world);
    add(&world, "room", "kitchen");
    let mut writer = Writer::default();
    writer.put(&schema);
    writer.put(&9_u64);
    writer.put(&0_i64);
    writer.put(&70_000_u32);
    for at in 1..=70_000_u64 {
        writer.put(&7_u64);
        writer.put(&1_u64);
        writer.put(&"name".to_owned());
        writer.put(&(at << 47));
        writer.put(&9_u64);
        writer.put(&4_u8);
        writer.put(&Vec::<i64>::new());
        writer.put(&Vec::<f64>::new());
        writer.put(&vec!["x".to_owned()]);
        writer.put(&Vec::<u8>::new());
    }
    let bytes = writer.into_bytes();
    let samples = Message::decode(Topic::Samples, &mut Reader::new(&bytes)).expect("a message");
    world.receive(SECOND, samples);
    assert_eq!(world.status(SECOND).counts.refused, 1);
    add(&world, "room", "hall");
    assert_eq!(world.snapshot().node_count(), 2);
}

#[test]
fn a_replica_goes_on_after_its_clock_was_set_back() {
    let mut steady = rc_world::Steady::new(5000 * SECOND);
    steady.follow(5001 * SECOND);
    steady.follow(1000 * SECOND);
    assert_eq!(steady.time(), 5001 * SECOND);
    steady.follow(1003 * SECOND);
    assert_eq!(steady.time(), 5004 * SECOND);
}

/// A change that is too large for one message is sent in chunks. No replica shows a part of it.
#[test]
fn one_that_is_killed_in_the_middle_of_a_change_leaves_nothing_of_it() {
    let mut network = Network::new(3, CALM, 7);
    network.run(4 * SECOND);
    let large = network.at(0).change(|edit| {
        for number in 0..3000 {
            let room = edit.add_node("room")?;
            edit.set(room, "name", format!("room {number}"))?;
        }
        Ok(())
    });
    large.expect("a sound change");
    // It tells that there is something, is asked, and sends some of the chunks.
    let sent = |network: &Network| network.sent.get(&Topic::Chunk).copied().unwrap_or_default();
    while sent(&network) == 0 {
        network.run(Duration::from_millis(1));
    }
    network.kill(0);
    network.converge(20 * SECOND);
    for at in network.living() {
        assert_eq!(network.at(at).snapshot().node_count(), 0, "agent{at}");
        add(network.at(at), "room", &format!("of agent{at}"));
    }
    network.converge(10 * SECOND);
    assert_eq!(network.at(1).snapshot().node_count(), 2);
}

/// Questions cost what an answer costs; what waits has a bound, and others are still served.
#[test]
fn a_flood_of_questions_takes_no_memory() {
    let world = World::new(Setup::new("mapper", flat()).with_writer(7));
    for number in 0..40 {
        let large = world.change(|edit| {
            for room in 0..100 {
                let node = edit.add_node("room")?;
                edit.set(node, "name", format!("room {number} {room}"))?;
            }
            Ok(())
        });
        large.expect("a sound change");
    }
    while world.take().is_some() {}
    let strangers: Vec<World> = (0..200_u64)
        .map(|number| {
            let setup = Setup::new("stranger", flat()).with_writer(1000 + number);
            World::new(setup)
        })
        .collect();
    world.turn(SECOND);
    let digest = std::iter::from_fn(|| world.take())
        .last()
        .expect("a digest");
    let mut now = SECOND;
    for _ in 0..20 {
        now += Duration::from_millis(400);
        for stranger in &strangers {
            stranger.receive(now, digest.clone());
            stranger.turn(now);
            while let Some(message) = stranger.take() {
                world.receive(now, message);
            }
        }
        world.turn(now);
        let status = world.status(now);
        assert!(status.queued <= 16 << 20, "{} bytes", status.queued);
    }
    assert!(world.status(now).counts.answered > 0);
    // Its own changes still go.
    while world.take().is_some() {}
    add(&world, "room", "last");
    let sent: Vec<_> = std::iter::from_fn(|| world.take()).collect();
    assert!(sent.iter().any(|message| message.topic() == Topic::Change));
}

/// Names of instances are texts of others: they are cleaned, and cut.
#[test]
fn names_with_control_characters_are_shown_without_them() {
    let name = format!("map\u{1b}[31mper\n{}", "x".repeat(1000));
    let stranger = World::new(Setup::new(&name, flat()).with_writer(9));
    let world = World::new(Setup::new("planner", flat()).with_writer(7));
    stranger.turn(SECOND);
    while let Some(message) = stranger.take() {
        world.receive(SECOND, message);
    }
    let status = world.status(SECOND);
    let shown = &status.peers[0].name;
    assert!(!shown.chars().any(char::is_control), "{shown:?}");
    assert!(shown.chars().count() <= 1024, "{shown:?}");
}

/// Others take no text of more than 16 MiB: what a change with one makes beside it is not made either.
#[test]
fn a_change_that_others_would_refuse_is_made_in_no_part() {
    let world = World::new(Setup::new("mapper", flat()).with_writer(7));
    add(&world, "room", "kitchen");
    while world.take().is_some() {}
    let long = "x".repeat((1 << 24) + 1);
    let refused = world.change(|edit| {
        for name in ["hall", long.as_str()] {
            let room = edit.add_node("room")?;
            edit.set(room, "name", name)?;
        }
        Ok(())
    });
    let refused = refused.expect_err("a text that is too long").to_string();
    assert!(refused.contains("too long"), "{refused}");
    assert_eq!(world.snapshot().node_count(), 1);
    assert!(world.take().is_none());
    add(&world, "room", "hall");
    assert_eq!(world.snapshot().node_count(), 2);
}

/// No message carries it: others would get neither this change nor a later one.
#[test]
fn a_text_with_a_zero_byte_is_refused_also_as_the_value_of_a_stream() {
    let every = Duration::from_millis(20);
    let rights = Rights::everything().with_stream("room", "name", every);
    let setup = Setup::new("mapper", flat()).with_writer(7);
    let world = World::new(setup.with_rights(rights));
    let name = |of: &World, name: &str| {
        of.change(|edit| {
            let room = edit.snapshot().nodes().next().map(|room| room.node_id());
            let room = room.map_or_else(|| edit.add_node("room"), Ok)?;
            edit.set(room, "name", name)?;
            Ok(())
        })
    };
    for names in [["kit\0chen", "kitchen"], ["ha\0ll", "hall"]] {
        let before = world.snapshot();
        let refused = name(&world, names[0]).expect_err("a text that ends too early");
        assert!(refused.to_string().contains("zero byte"), "{refused}");
        assert!(world.snapshot().since(&before).is_empty());
        name(&world, names[1]).expect("a sound change");
        assert_eq!(world.snapshot().named(names[1]).count(), 1);
    }
    let other = World::new(Setup::new("planner", flat()).with_writer(9));
    other.meet(&world).expect("the same schema");
    assert_eq!(other.snapshot().named("hall").count(), 1);
}
