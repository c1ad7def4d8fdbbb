//! Where frames are, as connections ask a replica.

use property_graph::schema::{Attribute, Entity, Kind, Port, PoseOf, Relation, Tree};
use property_graph::{Schema, Time};
use rc_world::{Setup, World, transform};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Rooms and robots in them, with poses in millimetres.
fn house() -> Arc<Schema> {
    let attribute = |name: &str, kind: Kind, unit: Option<&str>| Attribute {
        name: name.to_owned(),
        kind,
        unit: unit.map(str::to_owned),
        range: None,
        optional: true,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    let port = |name: &str| Port {
        name: name.to_owned(),
        entity: "frame".to_owned(),
        ..Port::default()
    };
    Arc::new(Schema {
        name: "house".to_owned(),
        entities: vec![Entity {
            name: "frame".to_owned(),
            attributes: vec![attribute("name", Kind::Text, None)],
            ..Entity::default()
        }],
        relations: vec![Relation {
            name: "RT".to_owned(),
            ports: vec![port("parent"), port("child")],
            attributes: vec![
                attribute("by", Kind::Floats(Some(3)), Some("mm")),
                attribute("angles", Kind::Floats(Some(3)), Some("rad")),
            ],
            tree: Some(Tree {
                child: 1,
                pose: Some(PoseOf::Two("by".to_owned(), "angles".to_owned())),
            }),
            ..Relation::default()
        }],
        ..Schema::default()
    })
}

#[test]
fn a_replica_knows_where_frames_are_in_metres() {
    let now = Arc::new(AtomicU64::new(0));
    let clock = Arc::clone(&now);
    let setup = Setup::new("mapper", house());
    let world =
        World::new(setup.with_clock(move || Time::from_nanos(clock.load(Ordering::Relaxed))));
    let tenth = |count: u64| Time::from_nanos(count * 100_000_000);
    let set = |count: u64, by: [f64; 3], turn: f64| {
        now.store(count * 100_000_000, Ordering::Relaxed);
        let changed = world.change(|edit| {
            let known = edit.snapshot().edges().next().map(|edge| edge.edge_id());
            let edge = if let Some(edge) = known {
                edge
            } else {
                let map = edit.add_node("frame")?;
                edit.set(map, "name", "map")?;
                let robot = edit.add_node("frame")?;
                edit.set(robot, "name", "robot")?;
                edit.add_edge("RT", map, robot)?
            };
            edit.set(edge, "by", by)?;
            edit.set(edge, "angles", [0.0, 0.0, turn])?;
            Ok(())
        });
        changed.expect("a sound change");
    };
    let unknown = transform(&world, "map", "robot", tenth(0));
    assert_eq!(
        unknown,
        Err("no node of the world has the name `map`".to_owned())
    );
    set(10, [1000.0, 0.0, 200.0], 0.0);
    set(20, [3000.0, 0.0, 200.0], std::f64::consts::PI);
    set(40, [3000.0, 0.0, 400.0], std::f64::consts::PI);
    let near = |count: u64, expected: [f64; 12]| {
        let found = transform(&world, "map", "robot", tenth(count)).expect("a transform");
        for (one, other) in found.iter().zip(expected) {
            assert!((one - other).abs() < 1e-12, "{found:?} {expected:?}");
        }
    };
    near(10, [1., 0., 0., 1., 0., 1., 0., 0., 0., 0., 1., 0.2]);
    // Half way, it has turned by a quarter.
    near(15, [0., -1., 0., 2., 1., 0., 0., 0., 0., 0., 1., 0.2]);
    // The next change is more than a second later: until then it stands still.
    for count in [20, 30, 39] {
        near(count, [-1., 0., 0., 3., 0., -1., 0., 0., 0., 0., 1., 0.2]);
    }
    // After the newest change, everything stays where it is.
    for count in [40, 41, 1000] {
        near(count, [-1., 0., 0., 3., 0., -1., 0., 0., 0., 0., 1., 0.4]);
    }
    let early = transform(&world, "map", "robot", Time::ZERO);
    assert_eq!(
        early,
        Err("no node of the world has the name `map`".to_owned())
    );
    let wrong = transform(&world, "map", "\u{1b}[2J", tenth(40)).expect_err("no such node");
    assert!(!wrong.contains('\u{1b}'), "{wrong}");
}
