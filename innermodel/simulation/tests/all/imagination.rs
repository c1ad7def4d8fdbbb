//! Worlds that are imagined: plans on clones, and a second world that detections keep current.

use crate::{room, world};
use innermodel::Pose;
use innermodel_simulation::{Speed, World};
use std::time::{Duration, Instant};

/// The time of a plan in steps of 10 ms.
const HORIZON: u32 = 150;
/// A plan is given up where the world is so far from its clone, in mm.
const BOUND: f64 = 30.0;
const GOAL: [f64; 2] = [0.0, 1500.0];

fn to_goal(world: &World) -> f64 {
    let place = world.place("base").expect("a base");
    (place.x - GOAL[0]).hypot(place.z - GOAL[1])
}

/// Tries ten motions on clones. Returns the one that comes nearest to the goal without a contact.
fn plan(world: &World) -> Speed {
    let before = world.digest();
    let turns = (-4..=4).map(|turn| (600.0, 0.3 * f64::from(turn)));
    let plans = turns.chain([(0.0, 1.0)]).map(|(advance, turn)| {
        let speed = Speed {
            advance,
            turn,
            ..Speed::default()
        };
        let mut clone = world.clone();
        clone.drive("base", speed).expect("a base");
        let touches = (0..HORIZON).any(|_| {
            clone.step().expect("a step");
            let base = clone.base("base").expect("a base");
            base.stopped_by.is_some()
        });
        let distance = if touches {
            f64::INFINITY
        } else {
            to_goal(&clone)
        };
        (distance, speed)
    });
    let best = plans.min_by(|a, b| a.0.total_cmp(&b.0)).expect("plans");
    assert!(best.0.is_finite(), "each plan ends at a body");
    assert_eq!(world.digest(), before, "plans change no other world");
    best.1
}

#[test]
fn the_best_of_many_plans_is_followed_until_the_world_is_another_one() {
    let mut world = world(&room(
        r#"<differentialrobot id="base" tz="-1500" collide="1">
            <cylinder id="body" ty="200" radius="200" length="300" collide="1" allowed="floor"/>
        </differentialrobot>
        <transform id="stand" tx="60"><cylinder id="post" ty="300" radius="150" length="600" collide="1"/></transform>"#,
    ));
    let started = Instant::now();
    let (mut plans, mut surprises) = (0, 0);
    while to_goal(&world) > 250.0 {
        assert!(plans < 30, "{:?}", world.place("base"));
        plans += 1;
        let speed = plan(&world);
        let mut expected = world.clone();
        for world in [&mut expected, &mut world] {
            world.drive("base", speed).expect("a base");
        }
        for _ in 0..HORIZON / 3 {
            expected.step().expect("a step");
            world.step().expect("a step");
            if world.steps() == 40 {
                // Somebody pushes the robot.
                let mut pose = world.tree().pose("root", "base").expect("a base");
                pose.translation[0] -= 120.0;
                world.teleport("base", "root", pose).expect("a base");
            }
            let (is, should) = (world.place("base"), expected.place("base"));
            let (is, should) = (is.expect("a base"), should.expect("a base"));
            if (is.x - should.x).hypot(is.z - should.z) > BOUND {
                surprises += 1;
                break;
            }
        }
    }
    assert_eq!(surprises, 1, "without a push, a plan goes as its clone");
    // Ten motions of 1.5 s each time.
    let imagined = Duration::from_millis(10) * HORIZON * 10 * plans;
    assert!(started.elapsed() < imagined, "{:?}", started.elapsed());
}

#[test]
fn a_second_world_that_detections_keep_current_measures_the_same() {
    let scene = room(
        r#"<differentialrobot id="base" tz="-1000">
            <cylinder id="body" ty="200" radius="200" length="300"/>
            <transform id="mast" ty="400"><laser id="front" max="9000" angle="4" measures="201" noise="10"/></transform>
        </differentialrobot>
        <transform id="crate" tx="-600"><plane id="side" py="300" size="500,600,500"/></transform>"#,
    );
    let mut first = world(&scene);
    let other = scene
        .replace(r#"tz="-1000""#, r#"tz="-300" tx="500""#)
        .replace(r#"tx="-600""#, r#"tx="1000" tz="700""#);
    let model = innermodel::InnerModel::parse(&other).expect("a right text");
    let mut second = World::new(model, first.step_time(), 2).expect("a right step");
    let speed = Speed {
        advance: 300.0,
        turn: 0.4,
        ..Speed::default()
    };
    first.drive("base", speed).expect("a base");
    for step in 1..=100_u32 {
        let x = -600.0 + 5.0 * f64::from(step);
        let pose = Pose::new(x, 0.0, 0.0, 0.0, 0.01 * f64::from(step), 0.0);
        first.teleport("crate", "root", pose).expect("a crate");
        first.step().expect("a step");
        // Ten times a second, a detector tells where both are.
        if step % 10 == 0 {
            for id in ["base", "crate"] {
                let seen = first.tree().pose("root", id).expect("a node");
                second.teleport(id, "root", seen).expect("a node");
            }
        }
        second.step().expect("a step");
        if step == 9 {
            assert!(deviation(&mut first, &mut second) > 100.0);
        }
    }
    // Each scan has errors of 10 mm of its own.
    let deviation = deviation(&mut first, &mut second);
    assert!(
        (deviation / 200.0_f64.sqrt() - 1.0).abs() < 0.2,
        "{deviation}"
    );
}

/// The root mean square of the differences of two scans, in mm.
fn deviation(a: &mut World, b: &mut World) -> f64 {
    let (a, b) = (a.scan("front"), b.scan("front"));
    let (a, b) = (a.expect("a scan"), b.expect("a scan"));
    let pairs = a.ranges.iter().zip(&b.ranges);
    let squares = pairs.map(|(a, b)| (a.distance - b.distance).powi(2));
    (squares.sum::<f64>() / a.ranges.len() as f64).sqrt()
}
