//! People who walk.

use crate::{room, world};
use innermodel::Point;
use innermodel_simulation::{Speed, World};

const ANN: &str =
    r#"<human id="ann" path="-1500,-1200 1500,-1200 1500,1200 -1500,1200" height="1700"/>"#;

fn head(world: &World) -> Point {
    let joints = world.skeleton("ann").expect("a person");
    joints
        .into_iter()
        .find(|(name, _)| *name == "head")
        .expect("a head")
        .1
}

#[test]
fn a_person_walks_the_path_again_and_again() {
    let mut world = world(&room(ANN));
    world.run(300).expect("steps");
    // 3 m at 1 m/s: the first corner.
    let there = head(&world);
    assert!(
        (there - Point::new(1500.0, 0.93 * 1700.0, -1200.0)).norm() < 1.0,
        "{there}"
    );
    let round = (3.0 + 2.4) * 2.0 * 100.0;
    world.run(round as u64).expect("steps");
    assert!((head(&world) - there).norm() < 1.0);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for _ in 0..200 {
        world.step().expect("a step");
        let joints = world.skeleton("ann").expect("a person");
        let of = |name| joints.iter().find(|(n, _)| *n == name).expect("a joint").1;
        let (left, right, hips) = (of("left_foot"), of("right_foot"), of("hips"));
        let apart = (left - right).norm();
        (least, most) = (least.min(apart), most.max(apart));
        assert!(left.y > -100.0 && left.y < 300.0 && (hips.y - 901.0).abs() < 1e-6);
        assert!(((of("left_knee") - left).norm() - 425.0).abs() < 1e-6);
    }
    assert!(most - least > 300.0, "the feet move: {least} {most}");
}

/// No part of a body moves by more than a person can walk, aside and on; nor does the person turn
/// at once.
#[test]
fn a_person_goes_and_turns_without_jumps() {
    let line = r#"<human id="ann" path="-1500,-1200 1500,-1200"/>"#;
    for path in [ANN, line] {
        // A robot that is in the way at each end keeps the person beside the path.
        let robots: String = ["-1300", "1300"]
            .map(|x| format!(r#"<omnirobot id="r{x}" tx="{x}" tz="-1000"/>"#))
            .concat();
        let mut world = world(&room(&format!("{path}{robots}")));
        // The first step is to the path.
        world.step().expect("a step");
        let pose = |world: &World| world.tree().pose("root", "ann").expect("a person");
        let mut before = pose(&world);
        let (mut walked, mut turned) = (0.0, 0.0);
        for _ in 0..3000 {
            world.step().expect("a step");
            let now = pose(&world);
            let [x, _, z] = [0, 1, 2].map(|at| now.translation[at] - before.translation[at]);
            let way = x.hypot(z);
            assert!(way < 20.0 + 1e-9, "{way}: {before:?} {now:?}");
            let turn = (now.rotation[1] - before.rotation[1]).abs();
            let turn = turn.min(std::f64::consts::TAU - turn);
            assert!(turn < 0.04 + 1e-9, "{turn}: {before:?} {now:?}");
            (walked, turned) = (walked + way, turned + turn);
            before = now;
        }
        assert!(walked > 15_000.0 && turned > 6.0, "{walked} {turned}");
    }
}

#[test]
fn one_impossible_person_does_not_stop_the_others() {
    let fast = r#"<human id="bob" path="0,0 1e308,1e308" speed="1e308"/>"#;
    let mut world = world(&room(&format!("{ANN}{fast}")));
    world.run(300).expect("steps");
    assert!((head(&world) - Point::new(1500.0, 0.93 * 1700.0, -1200.0)).norm() < 1.0);
}

#[test]
fn a_person_walks_around_a_robot_and_is_seen() {
    let inside = format!(
        r#"{ANN}<differentialrobot id="base" tx="0" tz="-1200" ry="-1.5707963267948966">
            <cylinder id="hull" ty="150" radius="200" length="300" collide="1"/>
            <translation id="top" ty="900"><laser id="scanner" max="9000" measures="1"/></translation>
        </differentialrobot>"#
    );
    let mut world = world(&room(&inside));
    let range = world.scan("scanner").expect("a scan").ranges[0].distance;
    assert!(
        range < 3000.0,
        "the person stands between robot and wall: {range}"
    );
    let mut nearest = f64::INFINITY;
    for _ in 0..400 {
        world.step().expect("a step");
        let there = head(&world);
        nearest = nearest.min((there.x).hypot(there.z + 1200.0));
        assert!(!world.collide("ann", "hull").expect("two nodes"));
    }
    assert!(nearest > 600.0, "{nearest}");
    assert!(head(&world).x > 1000.0, "the person came past");
    assert!(world.skeleton("base").is_err());
}

#[test]
fn a_robot_stops_before_a_person() {
    let inside = r#"<human id="ann" tx="0" tz="1000"/><differentialrobot id="base" collide="1">
            <cylinder id="hull" ty="250" radius="200" length="300" collide="1"/></differentialrobot>"#;
    let mut world = world(&room(inside));
    let speed = Speed {
        advance: 1000.0,
        ..Speed::default()
    };
    world.drive("base", speed).expect("a robot");
    world.run(200).expect("steps");
    let z = world.place("base").expect("a robot").z;
    assert!(z > 600.0 && z < 800.0, "{z}");
}

#[test]
fn a_scene_with_people_prints_and_loads_again() {
    let mut world = world(&room(ANN));
    world.run(10).expect("steps");
    let again = crate::world(&world.tree().print());
    assert_eq!(again.tree().len(), world.tree().len());
}
