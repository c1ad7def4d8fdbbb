//! The messages of `rc-world` are the structures of `World.idsl`.

use interfaces::rc_world::{Ask, Change, Chunk, Digest, Samples};
use rc_middleware::{Cdr, Reader, Writer};
use rc_world::property_graph::Schema;
use rc_world::{Message, Rights, Setup, Topic, World};
use std::collections::BTreeSet;
use std::time::Duration;

fn bytes_of(message: &Message) -> Vec<u8> {
    let mut writer = Writer::default();
    message.encode(&mut writer);
    writer.into_bytes()
}

/// Reads a message as the structure of the interface, and writes it again.
fn again<T: Cdr>(bytes: &[u8]) -> (T, Vec<u8>) {
    let mut reader = Reader::new(bytes);
    let value: T = reader.get().expect("a value");
    assert!(reader.rest().is_empty());
    let mut writer = Writer::default();
    writer.put(&value);
    (value, writer.into_bytes())
}

#[test]
fn messages_are_the_structures_of_the_interface() {
    let rights = Rights::everything().with_stream("door", "pose", Duration::ZERO);
    let world = |name: &str, rights: Rights| {
        World::new(Setup::new(name, Schema::anything().into()).with_rights(rights))
    };
    let (a, b) = (world("a", rights), world("b", Rights::everything()));
    let made = a.change(|edit| {
        let door = edit.add_node("door")?;
        edit.set(door, "name", "front")?;
        edit.set(door, "open", true)?;
        edit.set(door, "pose", [1.0, 2.0])?;
        let room = edit.add_node("room")?;
        edit.add_edge("in", door, room)?;
        Ok(())
    });
    made.expect("a sound change");
    let moved = a.change(|edit| {
        let door = edit.snapshot().named("front").next().expect("a door");
        Ok(edit.set(door, "pose", [3.0, 4.0])?)
    });
    moved.expect("a sound change");
    let mut topics = BTreeSet::new();
    let mut now = Duration::ZERO;
    for round in 0..200 {
        now += Duration::from_millis(20);
        for (from, to) in [(&a, &b), (&b, &a)] {
            from.turn(now);
            while let Some(message) = from.take() {
                let bytes = bytes_of(&message);
                let same = match message.topic() {
                    Topic::Change => again::<Change>(&bytes).1,
                    Topic::Samples => again::<Samples>(&bytes).1,
                    Topic::Digest => {
                        let (digest, same) = again::<Digest>(&bytes);
                        assert!(["a", "b"].contains(&digest.name.as_str()));
                        same
                    }
                    Topic::Ask => again::<Ask>(&bytes).1,
                    Topic::Chunk => {
                        let (chunk, same) = again::<Chunk>(&bytes);
                        let answers = Reader::new(&chunk.bytes)
                            .get::<Vec<interfaces::rc_world::Answer>>()
                            .expect("answers");
                        assert_eq!(answers.len(), 1);
                        same
                    }
                };
                assert_eq!(same, bytes);
                topics.insert(message.topic());
                // The first change is lost, so that it is asked for.
                if round > 0 {
                    to.receive(now, message);
                }
            }
        }
    }
    assert_eq!(topics.len(), 5);
    assert_eq!(a.status(now).digest, b.status(now).digest);
}
