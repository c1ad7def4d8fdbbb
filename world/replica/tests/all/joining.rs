//! A replica that has nothing takes the world of another one.

use crate::network::{add, through_bytes};
use crate::questions::{STRANGER, asked, chunk, world};
use crate::wrong::{StepOf, digest, put_steps, schema_of};
use property_graph::{Id, Value};
use rc_middleware::Writer;
use rc_world::{Message, Reason, Topic, World};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);
const NONE: Id = Id(0);

/// The messages of a replica at a time.
fn told(world: &World, now: Duration) -> Vec<Message> {
    world.turn(now);
    let all = std::iter::from_fn(|| world.take());
    all.map(|message| through_bytes(&message)).collect()
}

#[test]
fn a_newcomer_has_the_world_of_the_only_other_one_without_a_wait() {
    for writer in 103..120 {
        let (old, new) = (world(writer), world(200));
        let made = old.change(|edit| {
            for number in 0..2000 {
                let room = edit.add_node("room")?;
                edit.set(room, "name", format!("room {number}"))?;
            }
            Ok(())
        });
        made.expect("a sound change");
        told(&old, SECOND);
        // Its announcement, a question, and the answer: everything at one time.
        let now = SECOND + Duration::from_millis(500);
        for _ in 0..3 {
            for (from, to) in [(&new, &old), (&old, &new)] {
                for message in told(from, now) {
                    to.receive(now, message);
                }
            }
        }
        assert_eq!(new.snapshot().node_count(), 2000, "{writer}");
        let digests = [&old, &new].map(|world| world.status(now).digest);
        assert_eq!(digests[0], digests[1]);
    }
}

#[test]
fn many_that_come_one_after_the_other_are_told_together() {
    let world = world(7);
    let schema = schema_of(&world);
    let mut digests = 0;
    for step in 0..60 {
        let now = SECOND + Duration::from_millis(step);
        world.receive(now, digest(schema, 1000 + step, 1));
        let all = told(&world, now);
        let of_digests = |message: &&Message| message.topic() == Topic::Digest;
        digests += all.iter().filter(of_digests).count();
    }
    assert!((1..=3).contains(&digests), "{digests}");
}

/// An answer of the stranger: these steps are all that there is.
fn answer(steps: &[StepOf<'_>]) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.put(&1_u32);
    writer.put(&STRANGER);
    // What it has seen, since when, until when, and what it has forgotten.
    for upto in [0, 0, steps.len() as u64, 0] {
        writer.put(&u32::from(upto > 0));
        if upto > 0 {
            writer.put(&STRANGER);
            writer.put(&upto);
        }
    }
    // No range.
    writer.put(&0_u32);
    put_steps(&mut writer, 0, steps);
    writer.into_bytes()
}

/// A replica that had nothing, and was answered so.
fn answered(steps: &[StepOf<'_>]) -> World {
    let world = world(7);
    let schema = schema_of(&world);
    world.receive(SECOND, digest(schema, STRANGER, 1));
    let number = told(&world, SECOND)
        .iter()
        .find_map(|message| Some(asked(message)?.1));
    let number = number.expect("a question");
    world.receive(SECOND, chunk(7, number, 1, &answer(steps)));
    world.turn(2 * SECOND);
    world
}

fn text(text: &str) -> Value {
    Value::Text(text.into())
}

fn of(count: u64) -> Id {
    Id::new(STRANGER, count)
}

/// The steps from this number on that make a room.
fn room(name: &str, count: u64) -> Vec<StepOf<'static>> {
    vec![
        (0, "room", NONE, NONE, None),
        (2, "name", of(count), NONE, Some(text(name))),
    ]
}

/// Who answers a newcomer gets nothing past the checks: what the schema does not allow is not shown, and an
/// answer that no replica sends is refused as a whole.
#[test]
fn a_stranger_that_answers_gets_nothing_past_the_checks() {
    let kitchen = room("kitchen", 1);
    let with = |more: &[StepOf<'static>]| [&kitchen[..], more].concat();
    let wide = Some(Value::Floats([1.0, 2.0].as_slice().into()));
    // Steps, and the reasons why elements are not shown.
    let hidden: [(Vec<StepOf<'_>>, &[Reason]); 6] = [
        (with(&[(0, "roof", NONE, NONE, None)]), &[Reason::Schema]),
        (with(&[(0, "door", NONE, NONE, None)]), &[Reason::Schema]),
        (with(&room("kitchen", 3)), &[Reason::Key]),
        (with(&[(1, "in", of(1), of(1), None)]), &[Reason::Schema]),
        (with(&[(2, "colour", of(1), NONE, Some(text("red")))]), &[]),
        (with(&[(2, "name", of(1), NONE, wide)]), &[Reason::Schema]),
    ];
    for (steps, reasons) in &hidden {
        let world = answered(steps);
        let status = world.status(2 * SECOND);
        let shown = world.snapshot();
        let found: Vec<Reason> = world.conflicts().iter().map(|c| c.reason).collect();
        assert_eq!(
            (status.counts.refused, &found[..]),
            (0, *reasons),
            "{steps:?}"
        );
        // With a wrong name, the room itself is not shown.
        let rooms = usize::from(!matches!(
            steps.last(),
            Some((2, "name", _, _, Some(Value::Floats(_))))
        ));
        assert_eq!(shown.named("kitchen").count(), rooms, "{steps:?}");
        assert_eq!(shown.node_count() + shown.edge_count(), rooms, "{steps:?}");
        let attributes = shown
            .nodes()
            .flat_map(|node| node.attributes().map(|(name, _)| name));
        assert!(
            attributes.eq(std::iter::repeat_n("name", rooms)),
            "{steps:?}"
        );
        assert!(world.fault().is_none(), "{steps:?}");
        add(&world, "room", "hall");
    }
    let long = "n".repeat(257);
    let refused: [(Vec<StepOf<'_>>, &str); 4] = [
        (with(&[(0, "a\nb", NONE, NONE, None)]), "name"),
        (with(&[(0, "", NONE, NONE, None)]), "name"),
        (
            [&kitchen[..], &[(2, long.as_str(), of(1), NONE, None)]].concat(),
            "name",
        ),
        (
            with(&[(
                2,
                "width",
                of(1),
                NONE,
                Some(Value::Floats([f64::NAN].as_slice().into())),
            )]),
            "value",
        ),
    ];
    for (steps, reason) in &refused {
        let world = answered(steps);
        let counts = world.status(2 * SECOND).counts;
        assert_eq!(counts.refused, 1, "{steps:?}");
        assert!(
            counts.last_refusal.contains(reason),
            "{}",
            counts.last_refusal
        );
        assert_eq!(world.snapshot().node_count(), 0, "{steps:?}");
    }
}
