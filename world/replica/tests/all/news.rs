//! Changes of one replica that another one sees.

use crate::network::{CALM, Network, Weather, add, flat, through_bytes};
use property_graph::{Element, Graph, Schema, Time, Value};
use rc_world::{Error, Rights, Setup, Token, Topic, World};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);

#[test]
fn a_change_is_one_version_everywhere() {
    let mut network = Network::new(2, CALM, 1);
    network.run(SECOND);
    let mut reader = network.at(1).reader();
    let token = network.at(0).change(|edit| {
        let room = edit.add_node("room")?;
        edit.set(room, "name", "kitchen")?;
        let door = edit.add_node("door")?;
        edit.set(door, "name", "front")?;
        edit.set(door, "width", 0.8)?;
        edit.add_edge("in", door, room)?;
        Ok(())
    });
    let token = token.expect("a sound change");
    assert!(network.at(0).has(token) && !network.at(1).has(token));
    let before = network.at(1).snapshot().version();
    network.run(Duration::from_millis(5));
    assert!(network.at(1).has(token));
    assert_eq!(network.at(1).snapshot().version(), before + 1);
    let news = network.at(1).news(&mut reader).expect("news");
    assert_eq!(news.of("door").added.len(), 1);
    assert_eq!(news.of("room").added.len(), 1);
    assert_eq!(news.of("in").added.len(), 1);
    assert!(news.of("door").changed.is_empty());
    assert!(network.at(1).news(&mut reader).is_none());

    let all = |token: Token| network.at(0).all_have(token);
    // The other one tells what it has within a second.
    assert!(!all(token));
    network.run(SECOND);
    assert!(network.at(0).all_have(token));
    let read: Token = token.to_string().parse().expect("a token");
    assert_eq!(read, token);
    assert!("x:y".parse::<Token>().is_err());
}

#[test]
fn changed_and_removed_elements_are_news_of_their_type() {
    let mut network = Network::new(2, CALM, 1);
    add(network.at(0), "door", "front");
    add(network.at(0), "door", "back");
    network.run(SECOND);
    let mut reader = network.at(1).reader();
    let changed = network.at(0).change(|edit| {
        let front = edit.snapshot().named("front").next().expect("a door");
        edit.set(front, "width", 0.9)?;
        edit.set(front, "height", 2.0)?;
        let back = edit.snapshot().named("back").next().expect("a door");
        edit.remove_node(back)?;
        Ok(())
    });
    changed.expect("a sound change");
    network.run(Duration::from_millis(5));
    let news = network.at(1).news(&mut reader).expect("news");
    let doors = news.of("door");
    assert_eq!(doors.removed.len(), 1);
    let (door, attributes) = doors.changed.first_key_value().expect("a door");
    assert_eq!(
        *door,
        Element::Node(news.after.named("front").next().expect("a door"))
    );
    assert_eq!(attributes.len(), 2);
    assert!(news.of("room").is_empty());
}

#[test]
fn what_a_component_does_not_write_is_refused_whole() {
    let rights = Rights::nothing()
        .with_type("room")
        .with_attribute("door", "width");
    let setup = Setup::new("planner", flat()).with_rights(rights);
    let world = World::new(setup);
    add(&world, "room", "kitchen");
    let refused = world.change(|edit| {
        let door = edit.add_node("door")?;
        edit.set(door, "name", "front")?;
        Ok(())
    });
    assert_eq!(refused, Err(Error::NotWritten("door".to_owned())));
    assert_eq!(world.snapshot().node_count(), 1);
    let foreign = world.change(|edit| {
        let room = edit.add_node_as(property_graph::Id::new(9, 1), "room")?;
        edit.set(room, "name", "hall")?;
        Ok(())
    });
    assert_eq!(foreign, Err(Error::ForeignId));
    let wrong = world.change(|edit| edit.add_node("dor").map(drop).map_err(Error::from));
    let message = "the schema has no entity `dor`, did you mean `door`?";
    assert_eq!(wrong.expect_err("an error").to_string(), message);
    assert_eq!(world.status(SECOND).changes, 2);
}

fn pose_of(world: &World) -> f64 {
    let now = world.snapshot();
    let door = now.named("front").next().expect("a door");
    let pose = now.get(door, "pose").and_then(|pose| pose.number(0));
    pose.expect("a pose")
}

fn set_pose(world: &World, x: f64) {
    let set = world.change(|edit| {
        let door = edit.snapshot().named("front").next().expect("a door");
        Ok(edit.set(door, "pose", [x, 0.0, 0.0])?)
    });
    set.expect("a sound change");
}

#[test]
fn streams_have_a_rate_and_their_last_value_arrives() {
    let weather = Weather {
        lost: 50,
        repeated: 10,
        late: 20,
    };
    let mut network = Network::new(3, weather, 7);
    let rights = Rights::everything().with_stream("door", "pose", Duration::from_millis(10));
    let writer = network.world(0, rights);
    network.worlds[0] = Some(writer);
    add(network.at(0), "door", "front");
    set_pose(network.at(0), -1.0);
    network.converge(20 * SECOND);
    let changes = network.at(0).status(network.now).changes;
    network.sent.clear();
    for step in 0..1000 {
        set_pose(network.at(0), f64::from(step));
        network.run(Duration::from_millis(1));
    }
    assert!(network.sent[&Topic::Samples] <= 101, "{:?}", network.sent);
    // No change has a stream's number, so nothing is repaired.
    assert_eq!(network.at(0).status(network.now).changes, changes);
    assert!(pose_of(network.at(1)) > 500.0 && pose_of(network.at(2)) > 500.0);
    network.converge(60 * SECOND);
    assert_eq!([pose_of(network.at(1)), pose_of(network.at(2))], [999.0; 2]);
    // A change of the attribute is later than the stream, and so is a value of the stream after it.
    set_pose(network.at(1), -5.0);
    network.converge(60 * SECOND);
    assert_eq!([0, 1, 2].map(|at| pose_of(network.at(at))), [-5.0; 3]);
    set_pose(network.at(0), 7.0);
    network.converge(60 * SECOND);
    assert_eq!([0, 1, 2].map(|at| pose_of(network.at(at))), [7.0; 3]);
}

#[test]
fn replicas_with_one_start_have_it_once() {
    let start = Graph::new(flat(), 5);
    let made = start.change(Time::ZERO, |edit| {
        let room = edit.add_node("room")?;
        edit.set(room, "name", "kitchen")?;
        let door = edit.add_node("door")?;
        edit.set(door, "name", "front")?;
        edit.add_edge("in", door, room)?;
        Ok::<_, property_graph::Error>(())
    });
    made.expect("a start");
    let start = start.snapshot();
    let mut network = Network::new(3, CALM, 1);
    for at in [0, 1] {
        network.at(at).start_with(&start).expect("a start");
        network.at(at).start_with(&start).expect("the same start");
    }
    add(network.at(2), "room", "hall");
    network.converge(5 * SECOND);
    assert_eq!(network.at(2).snapshot().node_count(), 3);
    assert_eq!(network.at(2).snapshot().edge_count(), 1);
    let removed = network.at(2).change(|edit| {
        let door = edit.snapshot().named("front").next().expect("a door");
        Ok(edit.remove_node(door)?)
    });
    removed.expect("a sound change");
    network.converge(5 * SECOND);
    // The writer of the start is not waited for.
    network.run(2 * SECOND);
    for at in [0, 1, 2] {
        assert_eq!(network.at(at).status(network.now).tombstones, 0);
    }
    // One that starts later does not bring it back.
    let late = network.world(0, Rights::everything());
    late.start_with(&start).expect("a start");
    network.worlds[0] = Some(late);
    network.converge(10 * SECOND);
    assert_eq!(network.at(0).snapshot().named("front").count(), 0);
    // The one that was killed is not waited for, and the writer of the start never.
    network.run(10 * SECOND);
    for at in [0, 1, 2] {
        assert_eq!(network.at(at).status(network.now).tombstones, 0);
    }

    let wrong = World::new(Setup::new("x", std::sync::Arc::new(Schema::default())));
    assert!(matches!(wrong.start_with(&start), Err(Error::Start(_))));
    assert_eq!(wrong.snapshot().node_count(), 0);
}

#[test]
fn a_late_joiner_gets_a_large_world_in_chunks() {
    let mut network = Network::new(2, CALM, 1);
    let made = network.at(0).change(|edit| {
        for at in 0..3000 {
            let door = edit.add_node("door")?;
            edit.set(door, "name", format!("door {at}"))?;
            edit.set(door, "pose", [0.0, 1.0, f64::from(at)])?;
        }
        Ok(())
    });
    made.expect("a sound change");
    network.converge(10 * SECOND);
    let late = network.world(1, Rights::everything());
    network.worlds[1] = Some(late);
    network.sent.clear();
    network.run(Duration::from_millis(1));
    assert!(!network.at(1).has_joined());
    let took = network.converge(5 * SECOND);
    assert!(took <= SECOND, "{took:?}");
    network.run(3 * SECOND);
    assert!(network.at(1).has_joined());
    let [chunks, asks] = [Topic::Chunk, Topic::Ask].map(|topic| network.sent[&topic]);
    assert!(
        (10..40).contains(&chunks) && asks <= chunks / 8 + 1,
        "{chunks} {asks}"
    );
    let pose = network.at(1).snapshot();
    let door = pose.named("door 2999").next().expect("a door");
    assert_eq!(
        pose.get(door, "pose").and_then(|pose| pose.number(2)),
        Some(2999.0)
    );
    assert_eq!(pose.get(door, "width"), None::<&Value>);
}

#[test]
fn a_fork_keeps_what_is_tried_to_itself() {
    let world = World::new(Setup::new("planner", flat()));
    add(&world, "room", "kitchen");
    let fork = world.fork();
    let tried = fork.change(Time::ZERO, |edit| {
        let room = edit.snapshot().named("kitchen").next().expect("a room");
        edit.remove_node(room)
    });
    tried.expect("a sound change");
    assert_eq!(
        (fork.snapshot().node_count(), world.snapshot().node_count()),
        (0, 1)
    );
    // The fork is of a schema, too.
    assert!(
        fork.change(Time::ZERO, |edit| edit.add_node("dor"))
            .is_err()
    );
}

/// Hands all messages of one replica to another one, without a turn.
fn pass(from: &World, to: &World) {
    while let Some(message) = from.take() {
        to.receive(SECOND, through_bytes(&message));
    }
}

/// Two replicas with a hall, a door `front`, and a bath that both have made.
fn in_conflict() -> [World; 2] {
    let rights = Rights::everything().with_stream("door", "pose", Duration::ZERO);
    let world = |name: &str, writer: u64| {
        let setup = Setup::new(name, flat()).with_writer(writer);
        World::new(setup.with_rights(rights.clone()))
    };
    let [a, b] = [world("a", 7), world("b", 8)];
    add(&a, "room", "hall");
    add(&a, "door", "front");
    set_pose(&a, 1.0);
    pass(&a, &b);
    add(&a, "room", "bath");
    add(&b, "room", "bath");
    pass(&a, &b);
    pass(&b, &a);
    for world in [&a, &b] {
        world.turn(SECOND);
        assert_eq!(world.conflicts().len(), 1);
    }
    [a, b]
}

#[test]
fn a_change_on_what_was_removed_meanwhile_leaves_nothing() {
    let [a, b] = in_conflict();
    let hall = a.snapshot().named("hall").next().expect("a room");
    let removed = b.change(|edit| {
        let hall = edit.snapshot().named("hall").next().expect("a room");
        Ok(edit.remove_node(hall)?)
    });
    removed.expect("a sound change");
    pass(&b, &a);
    let before = a.status(SECOND).elements;
    let refused = a.change(|edit| {
        let door = edit.add_node("door")?;
        edit.set(door, "name", "back")?;
        edit.add_edge("in", door, hall)?;
        Ok(())
    });
    assert!(refused.is_err());
    assert_eq!(a.status(SECOND).elements, before);
    assert_eq!(a.snapshot().named("back").count(), 0);
}

#[test]
fn a_value_of_a_stream_is_shown_with_a_change_while_there_are_conflicts() {
    let [a, _] = in_conflict();
    let moved = a.change(|edit| {
        let door = edit.snapshot().named("front").next().expect("a door");
        edit.set(door, "width", 0.8)?;
        Ok(edit.set(door, "pose", [2.0, 0.0, 0.0])?)
    });
    moved.expect("a sound change");
    assert_eq!(pose_of(&a), 2.0);
}

#[test]
fn a_change_is_not_before_what_it_follows() {
    let late = Setup::new("late", flat()).with_clock(|| Time::from_millis(500));
    let [early, late] = [Setup::new("early", flat()), late].map(World::new);
    add(&late, "room", "hall");
    pass(&late, &early);
    add(&early, "room", "bath");
    // A clock that was set back would end the history.
    assert_eq!(early.snapshot().time(), Time::from_millis(500));
    let then = early.at(Time::from_millis(500)).expect("a version");
    assert_eq!(then.version().node_count(), 2);
}

#[test]
fn one_that_hears_a_newcomer_first_has_not_joined() {
    let [old, new, keeper] = ["old", "new", "keeper"].map(|name| {
        let world = World::new(Setup::new(name, flat()));
        world.turn(Duration::ZERO);
        world
    });
    add(&old, "room", "hall");
    pass(&new, &keeper);
    keeper.turn(SECOND / 10);
    assert!(!keeper.has_joined());
    pass(&old, &keeper);
    keeper.turn(3 * SECOND);
    old.turn(3 * SECOND);
    // It has heard that there is more.
    pass(&old, &keeper);
    keeper.turn(3 * SECOND);
    assert!(keeper.has_joined());
    assert_eq!(keeper.snapshot().node_count(), 1);
}

/// A tool that does not announce itself gets values of streams that are not repeated for it.
#[test]
fn one_that_only_asks_gets_the_values_of_streams_with_the_next_digest() {
    let rights = Rights::everything().with_stream("door", "width", Duration::ZERO);
    let finder = World::new(Setup::new("finder", flat()).with_rights(rights));
    add(&finder, "door", "front");
    for width in [0.7, 0.9] {
        let set = finder.change(|edit| {
            let door = edit.snapshot().named("front").next().expect("a door");
            Ok(edit.set(door, "width", width)?)
        });
        set.expect("a sound change");
        finder.turn(Duration::ZERO);
    }
    while finder.take().is_some() {}
    let tool = World::new(Setup::new("tool", flat()));
    let mut now = SECOND;
    while now < 4 * SECOND {
        finder.turn(now);
        tool.turn(now);
        while let Some(message) = finder.take() {
            tool.receive(now, message);
        }
        while let Some(message) = tool.take() {
            if message.topic() == Topic::Ask {
                finder.receive(now, message);
            }
        }
        now += Duration::from_millis(10);
    }
    let shown = tool.snapshot();
    let door = shown.named("front").next().expect("a door");
    assert_eq!(shown.get(door, "width"), Some(&Value::Float(0.9)));
    let known = finder.status(now).peers;
    assert!(known.iter().all(|peer| !peer.is_live), "{known:?}");
}
