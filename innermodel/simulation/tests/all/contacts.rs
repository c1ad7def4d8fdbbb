//! Bases and what they touch.

use crate::{room, world};
use innermodel::{NewNode, Pose};
use innermodel_simulation::{Speed, World};

const RUNNER: &str = r#"<differentialrobot id="base" ty="160" collide="1">
        <cylinder id="hull" radius="200" length="300" collide="1"/>
    </differentialrobot>"#;

fn drive(world: &mut World, advance: f64, turn: f64) {
    let speed = Speed {
        advance,
        turn,
        ..Speed::default()
    };
    world.drive("base", speed).expect("a robot");
}

fn z(world: &World) -> f64 {
    world.place("base").expect("a robot").z
}

/// A floor at the height 0 and a wall at z = 2000, as one mesh.
const HOUSE: &str = "v -3000 0 3000\nv 3000 0 3000\nv 3000 0 -3000\nv -3000 0 -3000\n\
    v -3000 0 -2000\nv 3000 0 -2000\nv 3000 2000 -2000\nv -3000 2000 -2000\n\
    f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n";

#[test]
fn a_floor_and_a_wall_of_one_mesh_stop_a_base_that_stands_in_the_floor() {
    let folder = tempfile::tempdir().expect("a folder");
    let (house, hull) = (
        folder.path().join("house.obj"),
        folder.path().join("hull.obj"),
    );
    std::fs::write(&house, HOUSE).expect("a file");
    // A box of 200 mm with its bottom at 0.
    let corners = [(-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1)];
    let mut text = String::new();
    for side in [1, -1] {
        for (x, y, z) in corners {
            text += &format!("v {} {} {}\n", x * 100, y * 100, z * side * 100);
        }
    }
    text += "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    std::fs::write(&hull, text).expect("a file");
    let bodies = [
        r#"<cylinder id="hull" ty="150" radius="100" length="300" collide="1"/>"#.to_owned(),
        format!(r#"<mesh id="hull" file="{}" collide="1"/>"#, hull.display()),
    ];
    for body in bodies {
        let mut world = world(&format!(
            r#"<innerModel>
                <mesh id="house" file="{}" collide="1"/>
                <differentialrobot id="base" ty="-0.1" collide="1">{body}</differentialrobot>
            </innerModel>"#,
            house.display()
        ));
        assert_eq!(world.problems(), Vec::<String>::new());
        assert!(world.collide("hull", "house").expect("two nodes"));
        drive(&mut world, 900.0, 0.0);
        world.run(300).expect("steps");
        assert!((z(&world) - 1900.0).abs() < 0.2, "{body}: {}", z(&world));
        drive(&mut world, -900.0, 0.0);
        world.run(100).expect("steps");
        assert!(z(&world) < 1100.0, "{body}: the way back is free");
    }
}

#[test]
fn a_box_that_is_put_into_the_hull_stops_the_base() {
    let mut world = world(&room(RUNNER));
    let kind =
        crate::world(r#"<innerModel><plane id="p" size="400,400,400" collide="1"/></innerModel>"#);
    let kind = kind.tree().node("p").expect("a node").kind().clone();
    let place = NewNode::transform("stand", Pose::new(0.0, 300.0, 399.0, 0.0, 0.0, 0.0));
    world
        .edit(|edit| {
            edit.add("root", place)?;
            edit.add("stand", NewNode::new("box", kind, Pose::default()))
        })
        .expect("a change");
    assert!(world.collide("hull", "box").expect("two nodes"));
    drive(&mut world, 500.0, 0.0);
    world.run(100).expect("steps");
    assert!(z(&world) < 0.02, "{}", z(&world));
    drive(&mut world, -500.0, 0.0);
    world.run(100).expect("steps");
    assert!((z(&world) + 500.0).abs() < 1.0, "the way out is free");
}

#[test]
fn a_base_that_is_pressed_against_a_wall_for_long_does_not_pass() {
    let mut world = world(&room(
        &RUNNER.replace(r#"ty="160""#, r#"ty="160" tz="1799""#),
    ));
    for step in 0..10_000 {
        let place = world.place("base").expect("a robot");
        // Always towards the wall, while it turns to and fro.
        let turn = if place.alpha > 1.6 { -1.0 } else { 1.0 };
        drive(&mut world, 1.0, turn);
        world.step().expect("a step");
        assert!(z(&world) < 1800.02, "in step {step}: {}", z(&world));
    }
    assert!(z(&world) > 1799.9);
}

/// A base that drives fast, with a thin mast, jumps over no post, and over no wall.
#[test]
fn a_fast_base_jumps_over_nothing() {
    let mast = r#"<differentialrobot id="base" ty="160" maxspeed="1000000" collide="1">
        <cylinder id="hull" radius="200" length="300" collide="1"/>
        <cylinder id="mast" ty="700" radius="2" length="1000" collide="1"/>
    </differentialrobot>"#;
    // Over the hull, in the way of the mast only.
    let bar = r#"<cylinder id="bar" tz="1500" ty="1000" rz="1.5707963267948966" radius="2" length="2000" collide="1"/>"#;
    for speed in [500.0, 20_000.0, 900_000.0] {
        let mut world = world(&room(&format!("{mast}{bar}")));
        drive(&mut world, speed, 0.0);
        world.run(400).expect("steps");
        let there = z(&world);
        assert!((there - 1496.0).abs() < 0.1, "{speed}: {there}");
        let problems = world.problems();
        let is_too_fast = problems.iter().any(|text| {
            text == "`base` is too fast for steps of 10ms: its bodies move by at most 2000 mm in one"
        });
        assert_eq!(is_too_fast, speed > 200_000.0, "{problems:?}");
    }
}

/// An arm that a robot turns sweeps over no post.
#[test]
fn a_fast_turn_sweeps_over_nothing() {
    let arm = r#"<differentialrobot id="base" ty="160" maxturn="1000" collide="1">
        <cylinder id="hull" radius="100" length="300" collide="1"/>
        <plane id="arm" pz="900" py="300" size="20,20,1700" collide="1"/>
    </differentialrobot>"#;
    let post = r#"<cylinder id="post" tx="1200" ty="500" radius="5" length="1000" collide="1"/>"#;
    let mut world = world(&room(&format!("{arm}{post}")));
    // Clockwise, to x.
    drive(&mut world, 0.0, -100.0);
    world.run(100).expect("steps");
    let turned = world.place("base").expect("a robot").alpha;
    // The side of the arm is at the post: a quarter turn less 15 mm of 1200 mm.
    assert!((turned - 0.0125).abs() < 1e-3, "{turned}");
}
