//! Questions about missing changes, and others whose answers do not help.

use crate::network::{CALM, Network, Weather, add, flat, through_bytes};
use crate::wrong::{Forged, digest, schema_of, steps};
use property_graph::{Id, Schema, Value};
use rc_middleware::{Reader, Writer};
use rc_world::{Message, Overheard, Rights, Setup, Topic, World};
use std::sync::Arc;
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);
/// The writer of a stranger who announces changes that nobody gets.
pub(crate) const STRANGER: u64 = 9;
/// The writers of the first two replicas of a [`Network`].
const FIRST: u64 = 101;
const SECOND_ONE: u64 = 102;

pub(crate) fn world(writer: u64) -> World {
    World::new(Setup::new("mapper", flat()).with_writer(writer))
}

/// The replica that is asked, and the number of the question.
pub(crate) fn asked(message: &Message) -> Option<(u64, u64)> {
    if message.topic() != Topic::Ask {
        return None;
    }
    let mut writer = Writer::default();
    message.encode(&mut writer);
    let bytes = writer.into_bytes();
    let mut reader = Reader::new(&bytes);
    let mut next = || reader.get::<u64>().expect("a number");
    let [_sender, to, number] = std::array::from_fn(|_| next());
    Some((to, number))
}

/// A question for everything.
fn question(sender: u64, to: u64, number: u64) -> Message {
    let mut writer = Writer::default();
    for of in [sender, to, number] {
        writer.put(&of);
    }
    // What it has, ranges and chunks: nothing.
    (0..3).for_each(|_| writer.put(&0_u32));
    let bytes = writer.into_bytes();
    Message::decode(Topic::Ask, &mut Reader::new(&bytes)).expect("a message")
}

/// The first part of the stranger's answer.
pub(crate) fn chunk(to: u64, number: u64, count: u32, bytes: &[u8]) -> Message {
    let mut writer = Writer::default();
    writer.put(&STRANGER);
    writer.put(&to);
    writer.put(&number);
    writer.put(&0_u32);
    writer.put(&count);
    writer.put(&bytes.to_vec());
    let bytes = writer.into_bytes();
    Message::decode(Topic::Chunk, &mut Reader::new(&bytes)).expect("a message")
}

#[test]
fn a_replica_whose_answers_bring_nothing_is_asked_less_and_less() {
    // A damaged answer, and one without changes.
    for bytes in [&[1_u8, 2, 3][..], &[0; 4]] {
        let world = world(7);
        let schema = schema_of(&world);
        let mut questions = 0;
        for step in 0..6000 {
            let now = Duration::from_millis(10) * step;
            if step % 100 == 0 {
                world.receive(now, digest(schema, STRANGER, 1));
            }
            world.turn(now);
            while let Some(message) = world.take() {
                if let Some((to, number)) = asked(&message) {
                    assert_eq!(to, STRANGER);
                    questions += 1;
                    world.receive(now, chunk(7, number, 1, bytes));
                }
            }
        }
        assert!((4..10).contains(&questions), "{questions} questions");
        // A world starts in spite of it, but the replica says that it lacks something.
        let status = world.status(60 * SECOND);
        assert!(world.has_joined() && status.is_behind);
    }
}

/// It does not answer, or never completely.
#[test]
fn a_stranger_that_announces_changes_and_never_answers_keeps_nobody_from_joining() {
    for begins in [false, true] {
        let world = world(7);
        let schema = schema_of(&world);
        for step in 0..2000 {
            let now = Duration::from_millis(10) * step;
            if step % 100 == 0 {
                world.receive(now, digest(schema, STRANGER, 1));
            }
            world.turn(now);
            while let Some(message) = world.take() {
                if let Some((_, number)) = asked(&message).filter(|_| begins) {
                    world.receive(now, chunk(7, number, 2, &[0; 4]));
                }
            }
        }
        let status = world.status(20 * SECOND);
        assert!(world.has_joined() && status.is_behind, "{begins}");
    }
}

#[test]
fn a_stranger_that_repeats_a_part_of_its_answer_keeps_nobody_from_asking_others() {
    let (world, other) = (world(7), world(200));
    let schema = schema_of(&world);
    add(&other, "room", "kitchen");
    let mut number = None;
    for step in 0..1000 {
        let now = Duration::from_millis(10) * step;
        if step % 100 == 0 {
            world.receive(now, digest(schema, STRANGER, 1));
        }
        if step % 20 == 0
            && let Some(number) = number
        {
            world.receive(now, chunk(7, number, 2, &[0; 4]));
        }
        world.turn(now);
        while let Some(message) = world.take() {
            number = number.or(asked(&message)
                .filter(|(to, _)| *to == STRANGER)
                .map(|(_, number)| number));
            other.receive(now, message);
        }
        other.turn(now);
        while let Some(message) = other.take() {
            // Its change is lost.
            if message.topic() != Topic::Change {
                world.receive(now, message);
            }
        }
    }
    assert!(number.is_some());
    assert_eq!(world.snapshot().node_count(), 1);
}

/// It sends one part of a world, and then answers without the other ones, or is busy.
#[test]
fn a_stranger_that_begins_with_parts_keeps_nobody_from_asking_others() {
    let mut part = Writer::default();
    part.put(&1_u32);
    part.put(&STRANGER);
    // Four vectors, the range 0 of 64, no steps.
    for number in [0_u32, 0, 0, 0, 2, 0, 64, 0] {
        part.put(&number);
    }
    let part = part.into_bytes();
    for (count, bytes, steps) in [(1, &[0; 4][..], 800), (0, &[], 13_000)] {
        let (world, other) = (world(7), world(200));
        let schema = schema_of(&world);
        add(&other, "room", "kitchen");
        let mut questions = 0;
        for step in 0..steps {
            let now = Duration::from_millis(10) * step;
            if step % 100 == 0 {
                world.receive(now, digest(schema, STRANGER, 1));
            }
            world.turn(now);
            while let Some(message) = world.take() {
                if let Some((STRANGER, number)) = asked(&message) {
                    let answer = match questions {
                        0 => chunk(7, number, 1, &part),
                        _ => chunk(7, number, count, bytes),
                    };
                    world.receive(now, answer);
                    questions += 1;
                }
                other.receive(now, message);
            }
            other.turn(now);
            while let Some(message) = other.take() {
                // Its change is lost.
                if message.topic() != Topic::Change {
                    world.receive(now, message);
                }
            }
        }
        assert!(questions > 1, "{questions} questions");
        assert_eq!(world.snapshot().node_count(), 1);
        assert!(world.has_joined());
    }
}

#[test]
fn a_second_loss_right_after_an_answer_is_repaired_as_soon_as_the_first_one() {
    let mut network = Network::new(2, CALM, 5);
    network.run(3 * SECOND);
    for (at, names) in [["kitchen", "hall"], ["cellar", "attic"]]
        .iter()
        .enumerate()
    {
        let [_, second] = names.map(|name| {
            add(network.at(0), "room", name);
            let mut all = std::iter::from_fn(|| network.at(0).take());
            let change = all.find(|message| message.topic() == Topic::Change);
            change.expect("a change")
        });
        network.at(1).receive(network.now, through_bytes(&second));
        // A question after 30 ms, and an answer at most each 50 ms.
        let limit = Duration::from_millis([40, 70][at]);
        network.run(limit);
        let count = network.at(1).snapshot().node_count();
        assert_eq!(count, 2 * (at + 1), "after {limit:?}");
    }
}

/// Each of two changes fits the schema by itself, but not both: a late joiner gets them as one.
#[test]
fn a_stranger_that_breaks_the_schema_by_two_changes_keeps_nobody_from_joining() {
    let mut network = Network::new(1, CALM, 5);
    let none = Id::new(0, 0);
    let schema = schema_of(network.at(0));
    let text = |text: &str| Some(Value::Text(text.into()));
    let of = Id::new(STRANGER, 2);
    let early = steps(schema, 0, &[(2, "width", of, none, text("wide"))]);
    let door = [
        (0, "door", none, none, None),
        (2, "name", of, none, text("front")),
    ];
    for message in [early, steps(schema, 1, &door)] {
        network.at(0).receive(network.now, message);
    }
    assert_eq!(network.at(0).snapshot().node_count(), 1);
    let late = network.world(1, Rights::everything());
    network.worlds.push(Some(late));
    network.groups.push(0);
    network.converge(5 * SECOND);
    network.run(3 * SECOND);
    let late = network.at(1);
    assert!(late.has_joined());
    let now = late.snapshot();
    let door = now.named("front").next().expect("a door");
    assert_eq!(now.get(door, "width"), None);
}

/// A late joiner has seen no number from which the great ones are near.
#[test]
fn a_stranger_that_counts_in_great_steps_keeps_nobody_from_joining() {
    let open = |writer: u64| {
        let setup = Setup::new("mapper", Schema::anything().into());
        World::new(setup.with_writer(writer))
    };
    let (first, late) = (open(7), open(200));
    let schema = schema_of(&first);
    for at in 0..3 {
        let since = first.status(SECOND).changes;
        let sequence = at * (1 << 48) + 1;
        let change = Forged {
            schema,
            sender: STRANGER,
            time: 0,
            since,
            upto: sequence,
            count: (at + 1) << 48,
            writer: STRANGER,
            sequence,
            name: "room",
        };
        first.receive(SECOND, change.message());
    }
    assert_eq!(first.snapshot().node_count(), 3);
    for step in 0..400 {
        let now = Duration::from_millis(10) * step;
        for (from, to) in [(&first, &late), (&late, &first)] {
            from.turn(now);
            while let Some(message) = from.take() {
                to.receive(now, message);
            }
        }
    }
    assert!(late.has_joined());
    assert_eq!(late.snapshot().node_count(), 3);
    add(&late, "room", "kitchen");
    assert_eq!(late.snapshot().node_count(), 4);
}

/// A replica that joins late gets a world of which an answer holds a sixteenth. Meanwhile it changes, and
/// the replica that has begun to answer is killed.
#[test]
fn a_world_larger_than_an_answer_arrives_in_parts_and_is_shown_as_a_whole() {
    const DOORS: usize = 1000;
    let rough = Weather {
        lost: 10,
        repeated: 5,
        late: 20,
    };
    for weather in [CALM, rough] {
        let mut network = Network::with_most_answer(3, weather, 11, 24 << 10);
        network.kill(2);
        for part in 0..10 {
            let filled = network.at(0).change(|edit| {
                for number in 0..DOORS / 10 {
                    let door = edit.add_node("door")?;
                    edit.set(door, "name", format!("door {part} {number}"))?;
                    edit.set(door, "width", 0.8)?;
                }
                Ok(())
            });
            filled.expect("a sound change");
            network.run(Duration::from_millis(100));
        }
        network.converge(20 * SECOND);
        let late = network.world(2, Rights::everything());
        network.worlds[2] = Some(late);
        let (mut shown, mut asked_first) = (None, 0);
        for step in 0..400_usize {
            network.run(Duration::from_millis(20));
            let changed = network.at(1).change(|edit| {
                let doors: Vec<_> = edit.snapshot().nodes().map(|node| node.node_id()).collect();
                if step % 4 == 0 {
                    edit.remove_node(doors[step * 7 % doors.len()])?;
                }
                edit.set(doors[(step * 7 + 1) % doors.len()], "height", step as f64)?;
                Ok(())
            });
            changed.expect("a sound change");
            if step == 20 {
                let killed = network.kill(0).expect("it lives");
                asked_first = killed.status(network.now).counts.answered;
            }
            let count = network.at(2).snapshot().node_count();
            if count > 0 {
                shown.get_or_insert(count);
            }
        }
        network.converge(20 * SECOND);
        let shown = shown.expect("the world has arrived");
        assert!(shown > DOORS - 110, "{shown} doors were shown first");
        let answers = network.at(1).status(network.now).counts.answered;
        assert!(answers > 12, "{answers} answers, after {asked_first}");
        assert!(asked_first > 0 || weather.lost > 0);
        assert!(network.at(2).has_joined());
    }
}

/// An answer to one of them leaves no room for an answer to the other one. Who reads the messages of all,
/// as of a recording, has the world, too.
#[test]
fn two_late_joiners_of_a_world_larger_than_an_answer_both_get_it() {
    const DOORS: usize = 1000;
    // All parts take longer than a replica waits for one that does not answer.
    let slow = Weather { late: 140, ..CALM };
    let mut network = Network::with_most_answer(1, slow, 13, 12 << 10);
    let filled = network.at(0).change(|edit| {
        for number in 0..DOORS {
            let door = edit.add_node("door")?;
            edit.set(door, "name", format!("door {number}"))?;
        }
        Ok(())
    });
    filled.expect("a sound change");
    network.run(3 * SECOND);
    let (listener, mut overheard) = (Arc::new(world(300)), Overheard::default());
    let listening = Arc::clone(&listener);
    let mut number = 0;
    network.listener = Some(Box::new(move |now, message| {
        // Another one is told to ask again and again.
        for _ in 0..300 {
            number += 1;
            overheard.take(&listening, &question(7, STRANGER, number));
            overheard.take(&listening, &chunk(7, number, 0, &[]));
        }
        overheard.take(&listening, &message);
        listening.receive(now, message);
        listening.turn(now);
        while listening.take().is_some() {}
    }));
    for at in 1..3 {
        let late = network.world(at, Rights::everything());
        network.worlds.push(Some(late));
        network.groups.push(0);
    }
    let all_have_joined = |network: &Network| (1..3).all(|at| network.at(at).has_joined());
    while !all_have_joined(&network) && network.now < 20 * SECOND {
        network.run(Duration::from_millis(10));
        for at in 1..3 {
            let count = network.at(at).snapshot().node_count();
            assert!(count == DOORS || count == 0 && !network.at(at).has_joined());
        }
        let count = listener.snapshot().node_count();
        assert!(count == DOORS || count == 0, "{count} doors");
    }
    assert!(all_have_joined(&network), "after {:?}", network.now);
    assert_eq!(listener.snapshot().node_count(), DOORS);
    for at in 0..3 {
        assert_eq!(network.at(at).refused(), 0);
    }
}

/// A question for some chunks of an answer.
fn chunk_question(sender: u64, to: u64, number: u64, chunks: &[u32]) -> Message {
    let mut writer = Writer::default();
    for of in [sender, to, number] {
        writer.put(&of);
    }
    writer.put(&0_u32);
    writer.put(&0_u32);
    writer.put(&chunks.to_vec());
    let bytes = writer.into_bytes();
    Message::decode(Topic::Ask, &mut Reader::new(&bytes)).expect("a message")
}

/// A network of one replica with many doors, whose answers have at most so many bytes.
fn doors(count: usize, most_answer: usize, seed: u64) -> Network {
    let mut network = Network::with_most_answer(1, CALM, seed, most_answer);
    let filled = network.at(0).change(|edit| {
        for number in 0..count {
            let door = edit.add_node("door")?;
            edit.set(door, "name", format!("door {number}"))?;
        }
        Ok(())
    });
    filled.expect("a sound change");
    network.run(3 * SECOND);
    network
}

fn join(network: &mut Network, at: usize) {
    let late = network.world(at, Rights::everything());
    network.worlds.push(Some(late));
    network.groups.push(0);
}

/// It asks for everything again and again, or for one chunk of an answer that it has.
#[test]
fn a_stranger_that_takes_no_answer_keeps_nobody_from_the_world() {
    for repeats in [false, true] {
        let mut network = doors(1000, 24 << 10, 17);
        let schema = schema_of(&world(7));
        let mut number = 0;
        for step in 0..1500 {
            if step == 10 {
                join(&mut network, 1);
            }
            let (first, now) = (network.at(0), network.now);
            if step % 50 == 0 {
                first.receive(now, digest(schema, STRANGER, 0));
            }
            // More often than an answer is kept.
            if step % 15 == 0 {
                let again = repeats && number > 0;
                if again {
                    first.receive(now, chunk_question(STRANGER, FIRST, number, &[0]));
                } else {
                    number += 1;
                    first.receive(now, question(STRANGER, FIRST, number));
                }
            }
            network.run(Duration::from_millis(20));
            if network.worlds.len() == 2 && network.at(1).has_joined() {
                break;
            }
        }
        assert!(network.at(1).has_joined(), "repeats: {repeats}");
        assert_eq!(network.at(1).snapshot().node_count(), 1000);
    }
}

/// A stranger takes an answer slowly, and asks for others meanwhile. There is room for all.
#[test]
fn a_stranger_that_takes_an_answer_slowly_delays_nobody_while_there_is_room() {
    let mut network = doors(4000, usize::MAX, 23);
    let schema = schema_of(&world(7));
    network
        .at(0)
        .receive(network.now, digest(schema, STRANGER, 0));
    network
        .at(0)
        .receive(network.now, question(STRANGER, FIRST, 1));
    network.run(Duration::from_millis(60));
    for step in 0..40 {
        let (first, now) = (network.at(0), network.now);
        if step % 5 == 0 {
            first.receive(now, chunk_question(STRANGER, FIRST, 1, &[8 + step / 5]));
        }
        first.receive(now, question(STRANGER, FIRST, 2 + u64::from(step)));
        if step == 5 {
            join(&mut network, 1);
        }
        network.run(Duration::from_millis(60));
    }
    // It was never told to ask again.
    assert_eq!(network.at(1).snapshot().node_count(), 4000);
    assert_eq!(network.at(1).status(network.now).counts.asked, 1);
}

/// While a replica takes the chunks of an answer, somebody asks in its name.
#[test]
fn questions_in_the_name_of_another_replica_take_no_answer_away_from_it() {
    let mut network = doors(4000, usize::MAX, 19);
    // The chunks take longer than the pause between two answers.
    network.weather = Weather { late: 140, ..CALM };
    join(&mut network, 1);
    let mut forged = 0;
    let start = network.now;
    while network.at(1).snapshot().node_count() == 0 && network.now < start + 20 * SECOND {
        if network.at(0).status(network.now).counts.answered > 0 {
            forged += 1;
            let forgery = question(SECOND_ONE, FIRST, 1_000_000 + forged);
            network.at(0).receive(network.now, forgery);
        }
        network.run(Duration::from_millis(1));
    }
    assert_eq!(network.at(1).snapshot().node_count(), 4000);
    assert!(forged > 2, "{forged} forged questions");
    // The first answer was enough.
    assert_eq!(network.at(1).status(network.now).counts.asked, 1);
}

#[test]
fn a_stranger_that_is_busy_for_ever_keeps_nobody_from_joining_and_is_asked_seldom() {
    let world = world(7);
    let schema = schema_of(&world);
    let mut questions = 0;
    for step in 0..13_000 {
        let now = Duration::from_millis(10) * step;
        if step % 100 == 0 {
            world.receive(now, digest(schema, STRANGER, 1));
        }
        world.turn(now);
        while let Some(message) = world.take() {
            if let Some((_, number)) = asked(&message) {
                questions += 1;
                world.receive(now, chunk(7, number, 0, &[]));
            }
        }
        assert!(!world.has_joined() || step > 12_000, "after {now:?}");
    }
    assert!((200..270).contains(&questions), "{questions} questions");
    assert!(world.has_joined() && world.status(130 * SECOND).is_behind);
}
