//! Worlds as a whole: scenes that change, clones, predictions.

use crate::{STEP, room, world};
use innermodel::{InnerModel, NewNode, Pose};
use innermodel_simulation::{Error, MotorGoal, Pose2D, Speed, World};
use std::time::Duration;

const INSIDE: &str = r#"<differentialrobot id="base" ty="160" collide="1">
        <cylinder id="hull" radius="200" length="300" collide="1"/>
        <laser id="scanner" max="9000" angle="2" measures="21" noise="4"/>
        <battery id="battery"/>
        <joint id="pan" axis="y"><camera id="eye" width="16" height="12" focal="12"/></joint>
    </differentialrobot>
    <transform id="arm" tx="-2000"><joint id="elbow" ty="500"/><prismaticJoint id="grip"/></transform>
    <transform id="chair" tx="2000" ty="200"><sphere id="seat" radius="150" collide="1"/></transform>"#;

fn ahead(advance: f64) -> Speed {
    Speed {
        advance,
        ..Speed::default()
    }
}

#[test]
fn steps_have_limits() {
    for step in [
        Duration::ZERO,
        Duration::from_nanos(1),
        Duration::from_secs(2),
    ] {
        let error = World::new(InnerModel::new(), step, 1).unwrap_err();
        assert_eq!(error, Error::Step(step));
    }
    assert_eq!(
        World::new(InnerModel::new(), Duration::ZERO, 1)
            .unwrap_err()
            .to_string(),
        "a step of 0ns is not possible; it has to be from 10 µs to 1 s"
    );
    let mut empty = World::new(InnerModel::new(), STEP, 1).expect("a world");
    assert_eq!(
        empty.run(u64::MAX).unwrap_err(),
        Error::TooManySteps(u64::MAX)
    );
    empty.run(3).expect("steps");
    assert_eq!((empty.steps(), empty.time()), (3, 3 * STEP));
}

#[test]
fn a_scene_lists_its_devices() {
    let world = world(&room(INSIDE));
    let devices: Vec<_> = world.devices().into_iter().map(|d| (d.tag, d.id)).collect();
    let expected = [
        ("differentialrobot", "base"),
        ("laser", "scanner"),
        ("battery", "battery"),
        ("joint", "pan"),
        ("camera", "eye"),
        ("joint", "elbow"),
        ("prismaticJoint", "grip"),
    ];
    assert_eq!(devices, expected.map(|(tag, id)| (tag, id.to_owned())));
    let groups = world.groups(&["joint", "prismaticJoint"]);
    assert_eq!(
        groups,
        [
            ("base".to_owned(), vec!["pan".to_owned()]),
            (
                "arm".to_owned(),
                vec!["elbow".to_owned(), "grip".to_owned()]
            )
        ]
    );
}

#[test]
fn a_missing_mesh_is_told_and_has_no_body() {
    let mut world =
        world(r#"<innerModel><mesh id="ghost" file="nowhere.obj" collide="1"/></innerModel>"#);
    let problems = world.problems();
    assert_eq!(problems.len(), 1);
    assert!(
        problems[0].starts_with("`ghost` has no body: "),
        "{problems:?}"
    );
    assert!(world.problems().is_empty());
    world.run(2).expect("steps");
}

#[test]
fn devices_come_and_go() {
    let mut world = world(&room(INSIDE));
    let kind = world.tree().node("scanner").expect("a node").kind().clone();
    world
        .edit(|edit| {
            edit.add("arm", NewNode::new("second", kind, Pose::default()))?;
            edit.remove("chair")
        })
        .expect("a change");
    assert_eq!(world.scan("second").expect("a scan").ranges.len(), 21);
    world.edit(|edit| edit.remove("base")).expect("a change");
    assert!(matches!(world.scan("scanner"), Err(Error::Tree(_))));
    assert!(matches!(
        world.drive("base", ahead(1.0)),
        Err(Error::Tree(_))
    ));
    world.run(5).expect("steps");
    // A refused request changes nothing.
    let before = world.digest();
    let refused = world.edit(|edit| {
        edit.remove("arm")?;
        edit.remove("nothing")
    });
    assert!(refused.is_err());
    assert_eq!(world.digest(), before);
}

#[test]
fn a_joint_carries_what_was_put_below_it() {
    let mut world = world(&room(INSIDE));
    world
        .edit(|edit| edit.re_parent("chair", "grip"))
        .expect("a change");
    let before = world
        .tree()
        .pose("root", "chair")
        .expect("a node")
        .translation;
    let up = MotorGoal::Position {
        target: 300.0,
        speed: 0.0,
    };
    world.command(&[("grip", up)]).expect("a joint");
    world.step().expect("a step");
    let after = world
        .tree()
        .pose("root", "chair")
        .expect("a node")
        .translation;
    assert_eq!(
        [0, 1, 2].map(|n| (after[n] - before[n]).round()),
        [0.0, 0.0, 300.0]
    );
    assert!(!world.collide("chair", "hull").expect("two nodes"));
    assert!(world.collide("arm", "nothing").is_err());
}

#[test]
fn a_world_is_set_back_while_time_goes_on() {
    let mut world = world(&room(INSIDE));
    world.drive("base", ahead(300.0)).expect("a robot");
    world.run(50).expect("steps");
    let kept = world.snapshot();
    let (place, level) = (
        world.place("base").expect("a robot"),
        world.battery("battery").expect("a battery").level,
    );
    world.run(50).expect("steps");
    world.edit(|edit| edit.remove("arm")).expect("a change");
    assert_ne!(world.place("base").expect("a robot"), place);
    world.restore(&kept);
    assert_eq!(world.place("base").expect("a robot"), place);
    assert_eq!(world.battery("battery").expect("a battery").level, level);
    assert!(world.motor("elbow").is_ok());
    assert_eq!(world.time(), 100 * STEP);
    world.step().expect("a step");
    let nearer = world.place("base").expect("a robot").z - place.z;
    assert!(
        (nearer - 3.0).abs() < 1e-9,
        "the command holds again: {nearer}"
    );
}

#[test]
fn a_prediction_equals_what_happens() {
    let mut world = world(&room(INSIDE));
    world.run(7).expect("steps");
    let before = world.digest();
    let speed = Speed {
        advance: 700.0,
        turn: 0.2,
        ..Speed::default()
    };
    let predicted = world
        .predict("base", speed, Duration::from_secs(3))
        .expect("a robot");
    assert_eq!(world.digest(), before, "a prediction changes nothing");
    world.drive("base", speed).expect("a robot");
    let mut first = None;
    for step in 1..=300_u32 {
        world.step().expect("a step");
        let stopped = world.base("base").expect("a robot").stopped_by;
        if let (None, Some((_, obstacle))) = (first, stopped) {
            first = Some((step * STEP, obstacle));
        }
    }
    assert_eq!(
        world.tree().pose("root", "base").expect("a node"),
        predicted.pose
    );
    let (after, obstacle) = first.expect("a wall");
    let collision = predicted.collision.expect("a wall");
    assert_eq!(
        (collision.after, Some(collision.obstacle)),
        (after, world.id_of(obstacle))
    );
    assert_eq!(collision.body, "hull");
    let still = world
        .predict("base", Speed::default(), Duration::ZERO)
        .expect("a robot");
    assert_eq!((still.pose, still.collision), (predicted.pose, None));
}

#[test]
fn a_clone_is_a_world_of_its_own_with_the_same_future() {
    let mut first = world(&room(INSIDE));
    first.drive("base", ahead(250.0)).expect("a robot");
    first.run(10).expect("steps");
    let mut second = first.clone();
    assert_eq!(first.digest(), second.digest());
    for world in [&mut first, &mut second] {
        world.run(30).expect("steps");
    }
    assert_eq!(first.digest(), second.digest());
    assert_eq!(first.scan("scanner"), second.scan("scanner"));
    let before = first.digest();
    second.drive("base", ahead(-250.0)).expect("a robot");
    second.edit(|edit| edit.remove("chair")).expect("a change");
    second.run(30).expect("steps");
    assert_eq!(first.digest(), before);
    assert!(first.tree().node("chair").is_ok());
    assert_ne!(first.digest(), second.digest());
}

#[test]
fn the_best_of_many_plans_is_found_faster_than_it_is_driven() {
    let text = room(INSIDE).replace(r#"tx="2000" ty="200""#, r#"ty="200" tz="900""#);
    let world = world(&text);
    let before = world.digest();
    let goal = (0.0, 1500.0);
    let started = std::time::Instant::now();
    let plans = (-10..=10).map(|turn| {
        let speed = Speed {
            advance: 500.0,
            turn: f64::from(turn) / 10.0,
            ..Speed::default()
        };
        let found = world
            .predict("base", speed, Duration::from_secs(3))
            .expect("a robot");
        let Pose2D { x, z, .. } = found.place;
        let hit = if found.collision.is_some() { 1e6 } else { 0.0 };
        (turn, hit + (x - goal.0).hypot(z - goal.1), found)
    });
    let best = plans.min_by(|a, b| a.1.total_cmp(&b.1)).expect("plans");
    assert!(
        started.elapsed() < Duration::from_secs(63),
        "slower than the world"
    );
    assert!(best.0 != 0 && best.2.collision.is_none(), "{best:?}");
    assert_eq!(world.digest(), before);
}

#[test]
fn a_clone_keeps_no_past() {
    let mut world = world(&room(INSIDE)).clone();
    world.drive("base", ahead(100.0)).expect("a robot");
    world.run(100).expect("steps");
    assert!(world.model().at(Duration::from_millis(500)).is_err());
    assert!(world.model().at(world.time()).is_ok());
}

#[test]
fn problems_wait_in_a_bounded_list() {
    let mut world = world("<innerModel/>");
    for at in 0..500 {
        let text = format!(r#"<innerModel><mesh id="m" file="nowhere{at}.obj"/></innerModel>"#);
        let kind = crate::world(&text)
            .tree()
            .node("m")
            .expect("a node")
            .kind()
            .clone();
        let new = NewNode::new(format!("mesh{at}"), kind, Pose::default());
        world.edit(|edit| edit.add("root", new)).expect("a change");
    }
    assert_eq!(world.problems().len(), 100);
    assert!(world.problems().is_empty());
}

#[test]
fn encoders_read_with_their_errors_and_motors_go_to_the_exact_place() {
    let text = r#"<innerModel>
        <joint id="pan" noise="0.01" quantum="0.001"/>
        <prismaticJoint id="lift" axis="y" quantum="5"/>
        </innerModel>"#;
    let mut world = world(text);
    let to = |target| MotorGoal::Position { target, speed: 0.0 };
    let limited = world.command(&[("pan", to(0.5)), ("lift", to(52.0))]);
    assert_eq!(limited.expect("joints"), [false, false]);
    world.run(10).expect("steps");
    let exact = world.tree().node("pan").expect("a joint").position();
    assert_eq!(exact, Some(0.5));
    assert_eq!(world.motor("lift").expect("a joint").position, 50.0);
    let (mut sum, mut squares) = (0.0, 0.0);
    let count = 100_000;
    for _ in 0..count {
        world.step().expect("a step");
        let read = world.motor("pan").expect("a joint").position;
        assert_eq!(world.motor("pan").expect("a joint").position, read);
        assert!((read * 1000.0 - (read * 1000.0).round()).abs() < 1e-9);
        sum += read - 0.5;
        squares += (read - 0.5).powi(2);
    }
    let mean = sum / f64::from(count);
    let sigma = (squares / f64::from(count) - mean * mean).sqrt();
    assert!(
        mean.abs() < 2e-4 && (sigma / 0.01 - 1.0).abs() < 0.03,
        "{mean} {sigma}"
    );
}
