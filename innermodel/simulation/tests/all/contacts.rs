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
