//! The interface `Simulation`.

use crate::{house, member};
use rcis_generated::interfaces::simulation as calls;
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{
    Attribute, Context, Direction, IdImage, Lasers, Pose, Signal, Simulation, WorkerError,
};
use std::fmt::Debug;
use std::time::Duration;

/// The reason of an exception.
fn reason<T: Debug>(call: Result<T, calls::SimulationErrorOrCall>) -> Reason {
    match call {
        Err(calls::SimulationErrorOrCall::SimulationError(error)) => {
            assert!(!error.what.is_empty());
            error.reason
        }
        other => panic!("{other:?}"),
    }
}

fn world() -> String {
    String::new()
}

fn pose(x: f64, y: f64, z: f64) -> Pose {
    Pose {
        x,
        y,
        z,
        ..Pose::default()
    }
}

#[test]
fn a_client_steps_a_paused_world() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    worker.set_paused(&mut test, true);
    test.run(&mut worker, Duration::from_secs(1))?;
    let clock = worker.get_clock(&mut test, world()).expect("a clock");
    assert_eq!((clock.time, clock.steps, clock.step), (0, 0, 10_000_000));
    let clock = Simulation::step(&mut worker, &mut test, world(), 25).expect("steps");
    assert_eq!(
        (clock.time, clock.steps, clock.pending),
        (250_000_000, 25, 0)
    );
    worker.set_paused(&mut test, false);
    test.run(&mut worker, Duration::from_millis(50))?;
    assert_eq!(
        worker.get_clock(&mut test, world()).expect("a clock").steps,
        30
    );
    let ctx: &mut Context = &mut test;
    for count in [-1, 100_001] {
        let refused = Simulation::step(&mut worker, ctx, world(), count);
        assert_eq!(reason(refused), Reason::WrongValue);
    }
    let refused = Simulation::step(&mut worker, ctx, "dream".into(), 1);
    assert_eq!(reason(refused), Reason::UnknownName);
    Ok(())
}

#[test]
fn a_change_is_in_the_next_frame() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    let front = member(test.lasers.get("front"));
    let ahead = |worker: &mut rcis::SpecificWorker, test: &mut Context| {
        // The next frame of a laser of 20 Hz.
        Simulation::step(worker, test, world(), 5).expect("steps");
        worker.get_laser_data(test, &front)[90].dist
    };
    let ctx: &mut Context = &mut test;
    let free = ahead(&mut worker, ctx);
    assert!(free > 1500.0);
    let post = r##"<transform id="post" tz="-600" tx="2000"><cylinder id="pole" ty="300" radius="100" length="600" collide="1"/></transform>"##;
    worker
        .add(ctx, world(), "furniture".into(), post.into())
        .expect("an element");
    assert!((ahead(&mut worker, ctx) - 800.0).abs() < 60.0);
    let larger = r##"<cylinder id="pole" radius="300" length="600" collide="1"/>"##;
    worker
        .set(ctx, world(), "pole".into(), larger.into())
        .expect("an element");
    assert!((ahead(&mut worker, ctx) - 600.0).abs() < 60.0);
    worker
        .teleport(
            ctx,
            world(),
            "post".into(),
            "root".into(),
            pose(2000.0, 0.0, 0.0),
        )
        .expect("a place");
    assert!((ahead(&mut worker, ctx) - 1200.0).abs() < 60.0);
    worker
        .re_parent(ctx, world(), "post".into(), "base".into())
        .expect("a parent");
    let there = Simulation::get_pose(&mut worker, ctx, world(), "post".into(), "root".into())
        .expect("a pose");
    assert!((there.z).abs() < 1e-6);
    worker
        .move_to(ctx, world(), "post".into(), "lamp".into())
        .expect("a parent");
    let there = Simulation::get_pose(&mut worker, ctx, world(), "post".into(), "lamp".into())
        .expect("a pose");
    assert!((there.z - 1500.0).abs() < 1e-6);
    let touch = Simulation::collide(&mut worker, ctx, world(), "post".into(), "wall_east".into());
    assert!(!touch.expect("two nodes"));
    let touch = Simulation::collide(
        &mut worker,
        ctx,
        world(),
        "lamp_pole".into(),
        "lamp_shade".into(),
    );
    assert!(touch.expect("two nodes"));
    worker.remove(ctx, world(), "post".into()).expect("a node");
    assert!((ahead(&mut worker, ctx) - free).abs() < 60.0);
    let mut signal = worker
        .get_signal(ctx, world(), "front".into())
        .expect("a sensor");
    signal.dropout = 1.0;
    worker
        .set_signal(ctx, world(), "front".into(), signal)
        .expect("a sensor");
    assert_eq!(ahead(&mut worker, ctx), 5000.0);
    let attribute = Attribute {
        name: "colour".to_owned(),
        type_: "string".to_owned(),
        value: "red".to_owned(),
    };
    for _ in 0..2 {
        Simulation::set_attribute(&mut worker, ctx, world(), "lamp".into(), attribute.clone())
            .expect("an attribute");
    }
    Simulation::remove_attribute(&mut worker, ctx, world(), "lamp".into(), "colour".into())
        .expect("an attribute");
    assert!(
        worker
            .print(ctx, world())
            .expect("a file")
            .contains("lamp_shade")
    );
    Ok(())
}

#[test]
fn what_is_refused_changes_nothing() {
    let (mut worker, mut test) = house();
    let ctx: &mut Context = &mut test;
    let before = worker.get_digest(ctx, world()).expect("a digest");
    let add = |worker: &mut rcis::SpecificWorker, ctx: &mut Context, parent: &str, text: &str| {
        worker.add(ctx, world(), parent.into(), text.into())
    };
    let cases = [
        ("nothing", r#"<transform id="a"/>"#, Reason::UnknownNode),
        ("lamp", r#"<transform id="bed"/>"#, Reason::DuplicateNode),
        ("lamp_pole", r#"<transform id="a"/>"#, Reason::WrongKind),
        ("lamp", r#"<transfrom id="a"/>"#, Reason::WrongText),
        ("lamp", r#"<imu id="a"/><imu id="b"/>"#, Reason::WrongText),
        ("lamp", "", Reason::WrongText),
    ];
    for (parent, text, expected) in cases {
        let refused = add(&mut worker, ctx, parent, text);
        assert_eq!(reason(refused), expected, "{text}");
    }
    let other = worker.set(
        ctx,
        world(),
        "lamp".into(),
        r#"<transform id="bed"/>"#.into(),
    );
    assert_eq!(reason(other), Reason::WrongText);
    let gone = worker.remove(ctx, world(), "lamb".into());
    assert_eq!(reason(gone), Reason::UnknownNode);
    let nowhere = worker.teleport(
        ctx,
        world(),
        "lamp".into(),
        "root".into(),
        pose(f64::NAN, 0.0, 0.0),
    );
    assert_eq!(reason(nowhere), Reason::WrongValue);
    let circle = worker.move_to(ctx, world(), "furniture".into(), "lamp".into());
    assert_eq!(reason(circle), Reason::WrongKind);
    let circle = worker.re_parent(ctx, world(), "front".into(), "lamp".into());
    assert_eq!(reason(circle), Reason::WrongKind);
    let attribute =
        Simulation::remove_attribute(&mut worker, ctx, world(), "lamp".into(), "colour".into());
    assert_eq!(reason(attribute), Reason::UnknownAttribute);
    let attribute = Simulation::set_attribute(
        &mut worker,
        ctx,
        world(),
        "lamb".into(),
        Attribute::default(),
    );
    assert_eq!(reason(attribute), Reason::UnknownNode);
    let wrong = Signal {
        noise: -1.0,
        ..Signal::default()
    };
    let signal = worker.set_signal(ctx, world(), "front".into(), wrong);
    assert_eq!(reason(signal), Reason::WrongValue);
    let signal = worker.get_signal(ctx, world(), "lamp".into());
    assert_eq!(reason(signal), Reason::WrongKind);
    let touch = Simulation::collide(&mut worker, ctx, world(), "lamp".into(), "lamb".into());
    assert_eq!(reason(touch), Reason::UnknownNode);
    let person = worker.get_skeleton(ctx, world(), "lamp".into());
    assert_eq!(reason(person), Reason::WrongKind);
    let fast = Simulation::drive(&mut worker, ctx, world(), "base".into(), 0.0, f64::NAN, 0.0);
    assert_eq!(reason(fast), Reason::WrongValue);
    let long = worker.predict(ctx, world(), "base".into(), 0.0, 1.0, 0.0, f64::INFINITY);
    assert_eq!(reason(long), Reason::WrongValue);
    assert_eq!(worker.get_digest(ctx, world()).expect("a digest"), before);
}

#[test]
fn snapshots_and_clones_have_names() {
    let (mut worker, mut test) = house();
    let ctx: &mut Context = &mut test;
    let empty = worker.snapshot(ctx, world(), String::new());
    assert_eq!(reason(empty), Reason::WrongValue);
    for name in ["a", "b", "c"] {
        worker
            .snapshot(ctx, world(), name.into())
            .expect("a snapshot");
        Simulation::clone(&mut worker, ctx, world(), name.into()).expect("a clone");
    }
    let again = worker.snapshot(ctx, world(), "a".into());
    assert_eq!(reason(again), Reason::DuplicateName);
    let more = worker.snapshot(ctx, world(), "d".into());
    assert_eq!(reason(more), Reason::TooMany);
    let again = Simulation::clone(&mut worker, ctx, world(), "a".into());
    assert_eq!(reason(again), Reason::DuplicateName);
    let more = Simulation::clone(&mut worker, ctx, world(), "d".into());
    assert_eq!(reason(more), Reason::TooMany);
    worker.forget_snapshot(ctx, "a".into()).expect("a snapshot");
    worker.remove_clone(ctx, "a".into()).expect("a clone");
    assert_eq!(worker.get_snapshots(ctx), ["b", "c"]);
    assert_eq!(worker.get_clones(ctx), ["b", "c"]);
    let gone = Simulation::restore(&mut worker, ctx, world(), "a".into());
    assert_eq!(reason(gone), Reason::UnknownName);
    let gone = worker.forget_snapshot(ctx, "a".into());
    assert_eq!(reason(gone), Reason::UnknownName);
    let gone = worker.remove_clone(ctx, "a".into());
    assert_eq!(reason(gone), Reason::UnknownName);
    let before = worker.get_digest(ctx, world()).expect("a digest");
    Simulation::drive(&mut worker, ctx, "b".into(), "base".into(), 0.0, 300.0, 0.0)
        .expect("a base");
    Simulation::step(&mut worker, ctx, "b".into(), 100).expect("steps");
    worker
        .remove(ctx, "b".into(), "lamp".into())
        .expect("a node");
    assert_eq!(worker.get_digest(ctx, world()).expect("a digest"), before);
    let there = Simulation::get_pose(&mut worker, ctx, "b".into(), "base".into(), "root".into())
        .expect("a pose");
    assert!((there.z + 1200.0).abs() < 1e-6, "{there:?}");
    Simulation::restore(&mut worker, ctx, "b".into(), "c".into()).expect("a snapshot");
    let back = Simulation::get_pose(&mut worker, ctx, "b".into(), "base".into(), "root".into())
        .expect("a pose");
    assert_eq!(back.z, -1500.0);
}

#[test]
fn a_long_prediction_takes_several_short_requests() {
    let (mut worker, mut test) = house();
    let ctx: &mut Context = &mut test;
    let predict = |worker: &mut rcis::SpecificWorker, ctx: &mut Context, turn: f64| {
        worker.predict(ctx, world(), "base".into(), 0.0, 800.0, turn, 2.0)
    };
    let whole = predict(&mut worker, ctx, 0.1).expect("a prediction");
    // After so little work, 200 steps are not over.
    ctx.params.work = Duration::from_nanos(1);
    let refused =
        |worker: &mut rcis::SpecificWorker, ctx: &mut Context, turn: f64, least: usize| {
            let mut count = 0;
            loop {
                match predict(worker, ctx, turn) {
                    Ok(found) if count >= least => return found,
                    Ok(_) => panic!("it was over after {count} requests"),
                    refused => assert_eq!(reason(refused), Reason::Busy),
                }
                count += 1;
            }
        };
    let parts = refused(&mut worker, ctx, 0.1, 199);
    assert_eq!(parts, whole);
    // Another motion, and another world, begin again.
    for _ in 0..100 {
        assert_eq!(reason(predict(&mut worker, ctx, 0.2)), Reason::Busy);
    }
    Simulation::step(&mut worker, ctx, world(), 1).expect("a step");
    refused(&mut worker, ctx, 0.2, 199);
    // A clone makes one step in each request.
    Simulation::clone(&mut worker, ctx, world(), "dream".into()).expect("a clone");
    let clock = Simulation::step(&mut worker, ctx, "dream".into(), 10).expect("steps");
    assert_eq!(clock.pending, 9);
}

#[test]
fn a_prediction_is_what_a_clone_does() {
    let (mut worker, mut test) = house();
    let ctx: &mut Context = &mut test;
    let found = worker
        .predict(ctx, world(), "base".into(), 0.0, 800.0, 0.1, 8.0)
        .expect("a base");
    let stopped = found.collision.expect("the table or the wall");
    Simulation::clone(&mut worker, ctx, world(), "dream".into()).expect("a clone");
    let part = Simulation::drive(
        &mut worker,
        ctx,
        "dream".into(),
        "base".into(),
        0.0,
        800.0,
        0.1,
    )
    .expect("a base");
    assert_eq!(part, 1.0);
    Simulation::step(&mut worker, ctx, "dream".into(), 800).expect("steps");
    let there = Simulation::get_pose(
        &mut worker,
        ctx,
        "dream".into(),
        "base".into(),
        "root".into(),
    )
    .expect("a pose");
    assert_eq!(there, found.pose);
    assert!(
        stopped.after > 1.0 && stopped.body == "base_body",
        "{stopped:?}"
    );
    let limited = Simulation::drive(
        &mut worker,
        ctx,
        "dream".into(),
        "base".into(),
        0.0,
        4000.0,
        0.0,
    )
    .expect("a base");
    assert_eq!(limited, 0.25);
    // A base with two wheels drives at 500 mm/s, whatever is asked of it to the side.
    let mut drive = |side, advance| {
        let (world, base) = ("dream".into(), "base".into());
        Simulation::drive(&mut worker, ctx, world, base, side, advance, 0.0)
    };
    assert_eq!(drive(1.0, 500.0).expect("a base"), 1.0);
    assert_eq!(drive(1.0, 0.0).expect("a base"), 0.0);
}

#[test]
fn people_have_a_skeleton() {
    let (mut worker, mut test) = house();
    let ctx: &mut Context = &mut test;
    let person = r#"<human id="ann" path="-2000,0 -2000,-2000"/>"#;
    worker
        .add(ctx, world(), "root".into(), person.into())
        .expect("an element");
    Simulation::step(&mut worker, ctx, world(), 100).expect("steps");
    let joints = worker
        .get_skeleton(ctx, world(), "ann".into())
        .expect("a person");
    let head = joints
        .iter()
        .find(|joint| joint.name == "head")
        .expect("a head");
    assert!(
        (head.place.z + 1000.0).abs() < 1.0 && head.place.y > 1500.0,
        "{head:?}"
    );
    // A person has all parts, or none.
    let neck = worker.remove(ctx, world(), "ann_neck".into());
    assert_eq!(reason(neck), Reason::DuplicateNode);
    let head = r#"<transform id="bob_head"/>"#;
    worker
        .add(ctx, world(), "root".into(), head.into())
        .expect("an element");
    let bob = r#"<human id="bob" path="-2000,0 -2000,-2000"/>"#;
    let refused = worker.add(ctx, world(), "root".into(), bob.into());
    assert_eq!(reason(refused), Reason::DuplicateNode);
}

#[test]
fn an_id_image_names_the_node_of_each_pixel() {
    let (mut worker, mut test) = house();
    let ctx: &mut Context = &mut test;
    // The number of the pixel that shows the middle of a body.
    let pixel = |worker: &mut rcis::SpecificWorker, ctx: &mut Context, world: &str, id: &str| {
        let (world, camera) = (world.to_owned(), "camera".to_owned());
        let at = Simulation::get_pose(worker, ctx, world, id.into(), camera).expect("a pose");
        let (u, v) = (160.0 + 280.0 * at.x / at.z, 120.0 - 280.0 * at.y / at.z);
        320 * v as usize + u as usize
    };
    let image = |worker: &mut rcis::SpecificWorker, ctx: &mut Context, world: &str| {
        let image = worker.get_id_image(ctx, world.into(), "camera".into());
        image.expect("a camera")
    };
    let shown = |image: &IdImage, pixel: usize| {
        let number = usize::try_from(image.pixels[pixel]).expect("a node");
        image.ids[number].clone()
    };
    let before = image(&mut worker, ctx, "");
    assert_eq!((before.width, before.height), (320, 240));
    assert_eq!((before.pixels.len(), before.time), (320 * 240, 0));
    let old = pixel(&mut worker, ctx, "", "bowl_body");
    assert_eq!(shown(&before, old), "bowl_body");
    for (number, id) in (0..).zip(&before.ids) {
        let count = before.ids.iter().filter(|other| *other == id).count();
        assert!(count == 1 && before.pixels.contains(&number), "{id}");
    }
    // A clone has pictures of its own.
    Simulation::clone(&mut worker, ctx, world(), "dream".into()).expect("a clone");
    let moved = worker.teleport(
        ctx,
        "dream".into(),
        "bowl".into(),
        "root".into(),
        pose(1600.0, 750.0, 1000.0),
    );
    moved.expect("a place");
    for world in ["", "dream"] {
        Simulation::step(&mut worker, ctx, world.into(), 10).expect("steps");
    }
    let after = image(&mut worker, ctx, "dream");
    let new = pixel(&mut worker, ctx, "dream", "bowl_body");
    assert_eq!(shown(&after, new), "bowl_body");
    assert_ne!(shown(&after, old), "bowl_body");
    let same = image(&mut worker, ctx, "");
    assert!(same.time > 0 && same.pixels == before.pixels);

    let laser = worker.get_id_image(ctx, world(), "front".into());
    assert_eq!(reason(laser), Reason::WrongKind);
    let nothing = worker.get_id_image(ctx, world(), "eye".into());
    assert_eq!(reason(nothing), Reason::UnknownNode);
}

#[test]
fn nothing_in_the_picture_is_no_node() {
    let scene = r#"<innerModel><transform id="stand"><camera id="eye" width="4" height="3" focal="4"/>
        </transform></innerModel>"#;
    let (mut worker, mut test) = crate::start(scene);
    let image = worker.get_id_image(&mut test, world(), "eye".into());
    let image = image.expect("a camera");
    assert_eq!((image.pixels, image.ids), (vec![-1; 12], Vec::new()));
}

#[test]
fn steps_wait_for_those_who_follow_the_time() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    test.params.wait = true;
    worker.set_paused(&mut test, true);
    let clock = Simulation::step(&mut worker, &mut test, world(), 3).expect("steps");
    assert_eq!((clock.steps, clock.pending), (0, 3));
    let early = Simulation::step(&mut worker, &mut test, world(), 1);
    assert_eq!(reason(early), Reason::Busy);
    test.run(&mut worker, Duration::from_millis(100))?;
    let clock = worker.get_clock(&mut test, world()).expect("a clock");
    assert_eq!((clock.steps, clock.pending, test.time.tick()), (3, 0, 3));
    Ok(())
}

#[test]
fn forces_are_switched_and_push() {
    let (mut worker, mut test) = house();
    let ctx: &mut Context = &mut test;
    let text = r#"<transform id="box" tx="1500" ty="600" engine="bullet" mass="2"><plane id="side" size="200,200,200" collide="1"/></transform>"#;
    worker
        .add(ctx, world(), "root".into(), text.into())
        .expect("an element");
    let height = |worker: &mut rcis::SpecificWorker, ctx: &mut Context| {
        Simulation::step(worker, ctx, world(), 100).expect("steps");
        let there = Simulation::get_pose(worker, ctx, world(), "box".into(), "root".into());
        there.expect("a pose")
    };
    assert_eq!(height(&mut worker, ctx).y, 600.0);
    let push = Direction {
        x: 2.0,
        ..Direction::default()
    };
    let refused = worker.push(ctx, world(), "box".into(), push.clone());
    assert_eq!(reason(refused), Reason::WrongKind);
    worker.set_physics(ctx, world(), true).expect("forces");
    assert!((height(&mut worker, ctx).y - 100.0).abs() < 5.0);
    worker
        .push(ctx, world(), "box".into(), push)
        .expect("a body");
    assert!(height(&mut worker, ctx).x > 1550.0);
    // A motor holds its joint until it is switched off.
    let arm = r#"<transform id="stand" tx="-1500" ty="1500"><joint id="hinge" axis="z" max="2">
        <transform id="rod" engine="bullet"><plane id="bar" px="300" size="600,50,50" collide="1"/></transform>
    </joint></transform>"#;
    worker
        .add(ctx, world(), "root".into(), arm.into())
        .expect("an element");
    let hangs = |worker: &mut rcis::SpecificWorker, ctx: &mut Context| {
        Simulation::step(worker, ctx, world(), 25).expect("steps");
        let there = Simulation::get_pose(worker, ctx, world(), "rod".into(), "stand".into());
        there.expect("a pose").rz
    };
    let held = hangs(&mut worker, ctx);
    assert!(held.abs() < 0.01, "{held}");
    worker
        .release(ctx, world(), "hinge".into())
        .expect("a joint");
    let free = hangs(&mut worker, ctx);
    assert!(free.abs() > 0.3, "{free}");
    let refused = worker.release(ctx, world(), "box".into());
    assert_eq!(reason(refused), Reason::WrongKind);
    worker.set_physics(ctx, world(), false).expect("no forces");
    let gone = worker.set_physics(ctx, "dream".into(), true);
    assert_eq!(reason(gone), Reason::UnknownName);
}
