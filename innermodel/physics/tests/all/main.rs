//! Forces in simulated worlds.

use innermodel::{InnerModel, Pose, Vector};
use innermodel_physics::Physics;
use innermodel_simulation::{MotorGoal, Speed, World};
use std::time::Duration;

const STEP: Duration = Duration::from_millis(10);

fn world(text: &str) -> World {
    let text = format!("<innerModel>{text}</innerModel>");
    let model = InnerModel::parse(&text).expect("a right text");
    let mut world = World::new(model, STEP, 1).expect("a world");
    world.set_dynamics(Some(Box::new(Physics::new())));
    world
}

fn place(world: &World, id: &str) -> [f64; 3] {
    world.tree().pose("root", id).expect("a node").translation
}

const FLOOR: &str = r#"<plane id="floor" ny="1" py="-50" size="20000,20000,100" collide="1"/>"#;

fn block(id: &str, x: f64, y: f64, mass: f64) -> String {
    format!(
        r#"<transform id="{id}" tx="{x}" ty="{y}" engine="bullet" mass="{mass}">
            <plane id="{id}_body" size="200,200,200" collide="1"/></transform>"#
    )
}

#[test]
fn free_fall_is_half_of_g_times_the_square_of_time() {
    for step in [1, 10, 50] {
        let text = format!(
            "<innerModel>{}</innerModel>",
            block("stone", 0.0, 50_000.0, 3.0)
        );
        let model = InnerModel::parse(&text).expect("a right text");
        let mut world = World::new(model, Duration::from_millis(step), 1).expect("a world");
        world.set_dynamics(Some(Box::new(Physics::new())));
        world.run(2000 / step).expect("steps");
        let fallen = 50_000.0 - place(&world, "stone")[1];
        let expected = 0.5 * 9.81 * 4.0 * 1000.0;
        assert!(
            (fallen / expected - 1.0).abs() < 1e-3,
            "{step} ms: {fallen}"
        );
    }
}

#[test]
fn blocks_stay_on_each_other() {
    let stack: String = (0..4)
        .map(|at| block(&format!("b{at}"), 0.0, 100.0 + 200.0 * f64::from(at), 1.0))
        .collect();
    let mut world = world(&format!("{FLOOR}{stack}"));
    world.run(300).expect("steps");
    for at in 0..4 {
        let [x, y, z] = place(&world, &format!("b{at}"));
        let height = 100.0 + 200.0 * f64::from(at);
        assert!(
            x.abs() < 3.0 && z.abs() < 3.0 && (y - height).abs() < 5.0,
            "{at}: {x} {y} {z}"
        );
    }
}

#[test]
fn a_push_moves_and_friction_stops() {
    let mut world = world(&format!("{FLOOR}{}", block("crate", 0.0, 100.0, 2.0)));
    world.run(50).expect("steps");
    // 2 kg at 2 m/s.
    world
        .push("crate", Vector::new(4.0, 0.0, 0.0))
        .expect("a body");
    world.run(300).expect("steps");
    // v²/(2 µ g), with rapier's friction of 0.5.
    let expected = 2.0 * 2.0 / (2.0 * 0.5 * 9.81) * 1000.0;
    let way = place(&world, "crate")[0];
    assert!((way / expected - 1.0).abs() < 0.05, "{way} {expected}");
    world.run(50).expect("steps");
    assert!((place(&world, "crate")[0] - way).abs() < 0.5);
    let error = world.push("floor", Vector::x()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the body that forces move `floor` is not there"
    );
    assert!(
        world
            .push("crate", Vector::new(f64::NAN, 0.0, 0.0))
            .is_err()
    );
}

#[test]
fn a_robot_pushes_what_is_in_its_way() {
    let text = format!(
        r#"{FLOOR}{}<differentialrobot id="base"><plane id="plate" py="100" size="300,150,300" collide="1"/></differentialrobot>"#,
        block("crate", 0.0, 100.0, 1.0).replace(r#"ty="100""#, r#"ty="100" tz="600""#)
    );
    let mut world = world(&text);
    let speed = Speed {
        advance: 300.0,
        ..Speed::default()
    };
    world.drive("base", speed).expect("a robot");
    world.run(300).expect("steps");
    // 900 mm, 150 mm of the robot and 100 mm of the crate.
    let z = place(&world, "crate")[2];
    assert!((z - 1150.0).abs() < 15.0, "{z}");
}

#[test]
fn a_motor_lifts_a_pendulum() {
    let text = r#"<transform id="top" ty="2000"><joint id="hinge" axis="z" min="-2" max="2">
        <transform id="rod" engine="bullet" mass="1">
            <plane id="bar" py="-500" size="60,1000,60" collide="1"/><transform id="weight" ty="-1000"/>
        </transform></joint></transform>"#;
    let mut world = world(text);
    world.run(10).expect("steps");
    let to = |target| MotorGoal::Position { target, speed: 0.0 };
    world.command(&[("hinge", to(0.8))]).expect("a joint");
    world.run(300).expect("steps");
    let motor = world.motor("hinge").expect("a joint");
    assert!((motor.position - 0.8).abs() < 0.02, "{motor:?}");
    let [x, y, _] = place(&world, "weight");
    let (sin, cos) = motor.position.sin_cos();
    assert!(
        (x - 1000.0 * sin).abs() < 1.0 && (y - 2000.0 + 1000.0 * cos).abs() < 1.0,
        "{x} {y}"
    );
    // Faster and to the limit.
    let turn = MotorGoal::Velocity {
        velocity: -1.0,
        acceleration: 0.0,
    };
    world.command(&[("hinge", turn)]).expect("a joint");
    world.run(100).expect("steps");
    let motor = world.motor("hinge").expect("a joint");
    assert!(
        (motor.velocity + 1.0).abs() < 0.05 && motor.position < 0.0,
        "{motor:?}"
    );
    world.run(400).expect("steps");
    assert!((world.motor("hinge").expect("a joint").position + 2.0).abs() < 0.05);
}

#[test]
fn forces_are_switched_while_the_world_runs() {
    let mut world = world(&block("stone", 0.0, 5000.0, 1.0));
    world.run(50).expect("steps");
    let fallen = place(&world, "stone")[1];
    assert!(fallen < 4000.0);
    world.set_dynamics(None);
    world.run(50).expect("steps");
    assert_eq!(place(&world, "stone")[1], fallen);
    assert!(!world.has_dynamics());
    world.set_dynamics(Some(Box::new(Physics::new())));
    world.run(10).expect("steps");
    let more = fallen - place(&world, "stone")[1];
    assert!((more - 49.05).abs() < 2.0, "it starts at rest: {more}");
}

#[test]
fn scenes_change_while_bodies_fall() {
    let mut world = world(&format!(
        "{}{}",
        block("a", 0.0, 9000.0, 1.0),
        block("b", 900.0, 9000.0, 1.0)
    ));
    world.run(30).expect("steps");
    let speed_before = place(&world, "b")[1];
    world.edit(|edit| edit.remove("a")).expect("a node");
    world.run(10).expect("steps");
    // It goes on with its speed: 2.94 m/s for 0.1 s, and 49 mm.
    let way = speed_before - place(&world, "b")[1];
    assert!((way - 343.0).abs() < 10.0, "{way}");
    world
        .teleport("b", "root", Pose::new(0.0, 9000.0, 0.0, 0.0, 0.0, 0.0))
        .expect("a place");
    world.run(10).expect("steps");
    let fallen = 9000.0 - place(&world, "b")[1];
    assert!((fallen - 49.05).abs() < 2.0, "it starts at rest: {fallen}");
}

#[test]
fn a_clone_falls_on_and_a_run_repeats() {
    let run = || {
        let mut world = world(&format!(
            "{FLOOR}{}{}",
            block("a", 0.0, 900.0, 1.0),
            block("b", 50.0, 1300.0, 1.0)
        ));
        world.run(40).expect("steps");
        let mut second = world.clone();
        let before = world.digest();
        second.run(20).expect("steps");
        assert_eq!(world.digest(), before);
        world.run(20).expect("steps");
        let (a, b) = (place(&world, "b"), place(&second, "b"));
        assert!((a[1] - b[1]).abs() < 5.0, "{a:?} {b:?}");
        world.digest()
    };
    assert_eq!(run(), run());
}

#[test]
fn a_push_has_a_bound_and_needs_no_step_before() {
    let mut world = world(&block("stone", 0.0, 5000.0, 1.0));
    let push = |world: &mut World, x| world.push("stone", Vector::new(x, 0.0, 0.0));
    push(&mut world, 1.0).expect("a body, before the first step");
    let mut clone = world.clone();
    push(&mut clone, 1.0).expect("a body, before the first step of a clone");
    for impulse in [1e4, 1e300] {
        let error = push(&mut world, impulse).unwrap_err();
        assert_eq!(error.to_string(), "`stone` would be faster than 1 km/s");
    }
    world.run(100).expect("steps");
    clone.run(100).expect("steps");
    let [x, twice] = [&world, &clone].map(|world| place(world, "stone")[0]);
    assert!(
        (x - 1000.0).abs() < 1.0 && (twice - 2000.0).abs() < 1.0,
        "{x} {twice}"
    );
}

#[test]
fn what_is_teleported_pushes_nothing_in_between() {
    let text = format!(
        r#"{FLOOR}{}<differentialrobot id="base"><plane id="plate" py="100" size="300,150,300" collide="1"/></differentialrobot>"#,
        block("crate", 0.0, 100.0, 1.0).replace(r#"ty="100""#, r#"ty="100" tz="600""#)
    );
    let mut world = world(&text);
    world.run(50).expect("steps");
    let before = place(&world, "crate");
    let there = Pose::new(0.0, 0.0, 1200.0, 0.0, 0.0, 0.0);
    world.teleport("base", "root", there).expect("a place");
    world.run(50).expect("steps");
    let after = place(&world, "crate");
    let way = (0..3).map(|at| (after[at] - before[at]).abs());
    assert!(way.into_iter().all(|way| way < 1.0), "{before:?} {after:?}");
}

#[test]
fn a_joint_rides_on_a_base_that_drives() {
    let text = format!(
        r#"{FLOOR}<differentialrobot id="base"><transform id="mast" ty="500"><joint id="hinge" axis="y" min="-3" max="3">
        <transform id="link" engine="bullet" mass="1"><plane id="bar" pz="200" size="60,60,400" collide="1"/></transform>
        </joint></transform></differentialrobot>"#
    );
    let mut world = world(&text);
    let to = |target| MotorGoal::Position { target, speed: 0.0 };
    world.command(&[("hinge", to(0.5))]).expect("a joint");
    world.run(200).expect("steps");
    let speed = Speed {
        advance: 500.0,
        turn: 0.5,
        ..Speed::default()
    };
    world.drive("base", speed).expect("a robot");
    world.run(200).expect("steps");
    world.drive("base", Speed::default()).expect("a robot");
    world.run(100).expect("steps");
    let base = world.tree().pose("root", "base").expect("a base");
    assert!(base.rotation[1].abs() > 0.9, "{base:?}");
    let position = world.motor("hinge").expect("a joint").position;
    assert!((position - 0.5).abs() < 0.02, "{position}");
    let [x, y, z] = world
        .tree()
        .pose("mast", "link")
        .expect("a link")
        .translation;
    assert!(
        x.abs() < 5.0 && y.abs() < 5.0 && z.abs() < 5.0,
        "{x} {y} {z}"
    );
}

#[test]
fn a_body_below_a_base_that_drives_falls_freely() {
    let text = format!(
        r#"<differentialrobot id="base">{}</differentialrobot>"#,
        block("cup", 0.0, 20_000.0, 1.0)
    );
    let mut world = world(&text);
    let speed = Speed {
        advance: 300.0,
        ..Speed::default()
    };
    world.drive("base", speed).expect("a robot");
    world.run(100).expect("steps");
    let [x, y, z] = place(&world, "cup");
    assert!((20_000.0 - y - 4905.0).abs() < 5.0, "{y}");
    assert!(
        x.abs() < 0.01 && z.abs() < 0.01,
        "the base does not carry it: {x} {z}"
    );
}

#[test]
fn a_world_that_is_set_back_falls_with_its_old_speed() {
    let mut world = world(&block("stone", 0.0, 9000.0, 1.0));
    world.run(30).expect("steps");
    let kept = world.snapshot();
    let digest = world.digest();
    world.run(1).expect("a step");
    let next = place(&world, "stone")[1];
    world
        .push("stone", Vector::new(0.0, 9.0, 0.0))
        .expect("a body");
    assert_ne!(world.digest(), digest);
    world.restore(&kept);
    world.run(1).expect("a step");
    let again = place(&world, "stone")[1];
    assert!((again - next).abs() < 0.1, "{next} {again}");
}

#[test]
fn a_joint_may_have_one_limit() {
    let text = r#"<transform id="top" ty="2000"><joint id="hinge" axis="z" max="1">
        <transform id="rod" engine="bullet" mass="1"><plane id="bar" py="-500" size="60,1000,60" collide="1"/></transform>
        </joint></transform>"#;
    let mut world = world(text);
    let turn = |velocity| MotorGoal::Velocity {
        velocity,
        acceleration: 0.0,
    };
    world.command(&[("hinge", turn(1.0))]).expect("a joint");
    world.run(200).expect("steps");
    let motor = world.motor("hinge").expect("a joint");
    assert!((motor.position - 1.0).abs() < 0.05, "{motor:?}");
    world.command(&[("hinge", turn(-1.0))]).expect("a joint");
    world.run(200).expect("steps");
    let motor = world.motor("hinge").expect("a joint");
    assert!((motor.position + 1.0).abs() < 0.05, "{motor:?}");
}

fn speed_of(world: &mut World, joint: &str) -> f64 {
    world.motor(joint).expect("a joint").velocity
}

/// A rod of 1 m below a hinge about z, 60 mm thick.
fn rod(inner: &str) -> String {
    format!(
        r#"<transform id="top" ty="2000"><joint id="hinge" axis="z">
        <transform id="rod" engine="bullet" mass="1">
            <plane id="bar" py="-500" size="60,1000,60" collide="1"/>{inner}
        </transform></joint></transform>"#
    )
}

#[test]
fn a_free_pendulum_keeps_its_energy() {
    let mut world = world(&rod(""));
    world
        .edit(|edit| edit.set_joint("hinge", 1.0).map(drop))
        .expect("a joint");
    world
        .command(&[("hinge", MotorGoal::Free)])
        .expect("a joint");
    // A rod: its moment is m (L² + b²) / 12 about its middle, and m L² / 4 more about the hinge.
    let moment = (1.0 + 0.06_f64.powi(2)) / 12.0 + 0.25;
    let energy = |world: &mut World| {
        let motor = world.motor("hinge").expect("a joint");
        let (angle, speed) = (motor.position, motor.velocity);
        9.81 * 0.5 * (1.0 - angle.cos()) + 0.5 * moment * speed * speed
    };
    let start = energy(&mut world);
    let (mut least, mut lowest) = (f64::INFINITY, f64::INFINITY);
    let mut fastest = 0.0_f64;
    for _ in 0..200 {
        world.step().expect("a step");
        let now = energy(&mut world);
        assert!((now / start - 1.0).abs() < 0.05, "{now} {start}");
        let motor = world.motor("hinge").expect("a joint");
        lowest = lowest.min(motor.position);
        least = least.min(motor.position.abs());
        fastest = fastest.max(motor.velocity.abs());
    }
    // It swings through, and as far to the other side.
    assert!(least < 0.05 && (lowest + 1.0).abs() < 0.05, "{lowest}");
    let expected = (2.0 * start / moment).sqrt();
    assert!((fastest / expected - 1.0).abs() < 0.03, "{fastest}");
}

#[test]
fn a_wheel_turns_on_and_on() {
    let mut world = world(&rod(""));
    let turn = MotorGoal::Velocity {
        velocity: 5.0,
        acceleration: 10.0,
    };
    world.command(&[("hinge", turn)]).expect("a joint");
    world.run(25).expect("steps");
    let half = speed_of(&mut world, "hinge");
    assert!((half - 2.5).abs() < 0.3, "{half}");
    world.run(75).expect("steps");
    for _ in 0..200 {
        world.step().expect("a step");
        let speed = speed_of(&mut world, "hinge");
        assert!((speed - 5.0).abs() < 0.3, "{speed}");
    }
    let position = world.motor("hinge").expect("a joint").position;
    assert!((position - (15.0 - 1.25)).abs() < 0.3, "{position}");
    // Back by more than a turn, at a speed.
    let back = MotorGoal::Position {
        target: position - 8.0,
        speed: 4.0,
    };
    world.command(&[("hinge", back)]).expect("a joint");
    world.run(100).expect("steps");
    let speed = speed_of(&mut world, "hinge");
    assert!((speed + 4.0).abs() < 0.2, "{speed}");
    world.run(200).expect("steps");
    let there = world.motor("hinge").expect("a joint").position;
    assert!((there - position + 8.0).abs() < 0.02, "{there} {position}");
}

#[test]
fn changes_of_other_nodes_disturb_nothing() {
    let stack: String = (0..4)
        .map(|at| {
            block(
                &format!("b{at}"),
                3000.0,
                100.0 + 200.0 * f64::from(at),
                1.0,
            )
        })
        .collect();
    let text = format!(
        r#"{FLOOR}{stack}{}<laser id="eye" max="1000"/>"#,
        rod("").replace(
            "<transform id=\"top\"",
            "<transform id=\"top\" tx=\"-3000\""
        )
    );
    let out = MotorGoal::Position {
        target: 1.5,
        speed: 0.0,
    };
    let run = |edits: bool| {
        let mut world = world(&text);
        world.command(&[("hinge", out)]).expect("a joint");
        for step in 0..200 {
            if edits {
                let (mut signal, id) = (world.signal("eye").expect("a sensor"), "eye");
                signal.noise = f64::from(step);
                world.set_signal(id, signal).expect("a sensor");
                let lamp = format!("lamp{step}");
                let lamp = innermodel::NewNode::transform(lamp, Pose::default());
                world.edit(|edit| edit.add("root", lamp)).expect("a node");
            }
            world.step().expect("a step");
        }
        ["b0", "b1", "b2", "b3", "rod"].map(|id| world.tree().pose("root", id).expect("a body"))
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn a_part_of_a_body_is_moved() {
    let text = format!(
        r#"{FLOOR}<transform id="box" ty="1000" engine="bullet">
            <plane id="side" size="200,200,200" collide="1"/></transform>"#
    );
    let mut world = world(&text);
    world.run(1).expect("a step");
    let lower = Pose::new(0.0, -300.0, 0.0, 0.0, 0.0, 0.0);
    world
        .edit(|edit| {
            let kind = edit.snapshot().node("side")?.kind().clone();
            let innermodel::Kind::Plane(mut plane) = kind else {
                panic!("a plane");
            };
            plane.point = lower.translation;
            edit.set_kind("side", innermodel::Kind::Plane(plane))
        })
        .expect("a change");
    world.run(200).expect("steps");
    let y = place(&world, "box")[1];
    assert!((y - 400.0).abs() < 5.0, "{y}");
    // Below a node that is moved.
    let text = format!(
        r#"{FLOOR}<transform id="box" ty="1000" engine="bullet"><transform id="inner">
            <plane id="side" size="200,200,200" collide="1"/></transform></transform>"#
    );
    let mut world = self::world(&text);
    world.run(1).expect("a step");
    world
        .edit(|edit| edit.set_pose("inner", lower))
        .expect("a change");
    world.run(200).expect("steps");
    let y = place(&world, "box")[1];
    assert!((y - 400.0).abs() < 5.0, "{y}");
}

#[test]
fn a_robot_that_collides_pushes_what_can_give_way() {
    let wall = r#"<plane id="wall" pz="2050" py="500" size="4000,1000,100" collide="1"/>"#;
    for (speed, at_wall) in [(300.0, 500), (1000.0, 200)] {
        let text = format!(
            r#"{FLOOR}{wall}{}<differentialrobot id="base" collide="1"><plane id="plate" py="100" size="300,150,300" collide="1"/></differentialrobot>"#,
            block("crate", 0.0, 100.0, 1.0).replace(r#"ty="100""#, r#"ty="100" tz="600""#)
        );
        let mut world = world(&text);
        let speed = Speed {
            advance: speed,
            ..Speed::default()
        };
        world.drive("base", speed).expect("a robot");
        world.run(90_000 / speed.advance as u64).expect("steps");
        // 900 mm, 150 mm of the robot and 100 mm of the crate.
        let z = place(&world, "crate")[2];
        assert!((z - 1150.0).abs() < 25.0, "{z}");
        // The wall is at 2000 mm: there, crate and robot stop.
        world.run(at_wall).expect("steps");
        let (z, robot) = (place(&world, "crate")[2], place(&world, "base")[2]);
        assert!((z - 1900.0).abs() < 25.0, "{z} {robot}");
        assert!((robot - 1650.0).abs() < 45.0, "{z} {robot}");
        let stopped_by = world.base("base").expect("a robot").stopped_by;
        let by = stopped_by.and_then(|(_, other)| world.id_of(other));
        assert_eq!(by.as_deref(), Some("crate_body"));
    }
}

#[test]
fn the_body_of_an_arm_that_jumps_is_put_there() {
    let mut world = world(&rod(""));
    world.run(10).expect("steps");
    world
        .edit(|edit| edit.set_joint("hinge", 2.0).map(drop))
        .expect("a joint");
    world.run(100).expect("steps");
    let position = world.motor("hinge").expect("a joint").position;
    assert!((position - 2.0).abs() < 0.01, "{position}");
    // The joint is moved in what carries it.
    world
        .edit(|edit| edit.set_pose("hinge", Pose::new(500.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
        .expect("a joint");
    world.run(100).expect("steps");
    let [x, y, _] = world.tree().pose("top", "rod").expect("a body").translation;
    assert!((x - 500.0).abs() < 1.0 && y.abs() < 1.0, "{x} {y}");
}
