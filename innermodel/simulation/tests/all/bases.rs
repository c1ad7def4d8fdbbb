//! Bases, joints and batteries.

use crate::{room, world};
use innermodel::InnerModel;
use innermodel_simulation::{MotorGoal, Pose2D, Speed, World};
use std::f64::consts::{FRAC_PI_2, PI};

fn robot(tag: &str, attributes: &str) -> World {
    world(&format!(
        r#"<innerModel><{tag} id="base" tx="100" tz="200" maxspeed="2000" {attributes}/></innerModel>"#
    ))
}

/// Where a constant speed in the frame of a base leads: the motion about its fixed point.
fn closed_form(start: Pose2D, speed: Speed, time: f64) -> Pose2D {
    let (v, s, w) = (speed.advance, speed.side, speed.turn);
    // The fixed point c: c = p + R(alpha)·(forwards, to the left) with v = w·left, −s =
    // −w·forwards.
    let (forwards, left) = (s / w, v / w);
    let (sin, cos) = start.alpha.sin_cos();
    let centre = (
        start.x + forwards * cos - left * sin,
        start.z + forwards * sin + left * cos,
    );
    let alpha = start.alpha + w * time;
    let (sin, cos) = alpha.sin_cos();
    Pose2D {
        x: centre.0 - forwards * cos + left * sin,
        z: centre.1 - forwards * sin - left * cos,
        alpha,
    }
}

fn assert_near(found: Pose2D, expected: Pose2D, error: f64) {
    let turn = (found.alpha - expected.alpha + PI).rem_euclid(2.0 * PI) - PI;
    let apart = (found.x - expected.x).hypot(found.z - expected.z);
    assert!(
        apart < error && turn.abs() < error / 1000.0,
        "{found:?}, not {expected:?}"
    );
}

#[test]
fn arcs_equal_closed_forms() {
    let speeds = [
        (0.0, 500.0, 0.7),
        (0.0, -300.0, -1.1),
        (250.0, 400.0, 0.9),
        (-100.0, 0.0, 2.0),
    ];
    for (side, advance, turn) in speeds {
        let tag = if side == 0.0 {
            "differentialrobot"
        } else {
            "omnirobot"
        };
        let mut world = robot(tag, r#"ry="0.4""#);
        let start = world.place("base").expect("a robot");
        assert!((start.alpha - (FRAC_PI_2 - 0.4)).abs() < 1e-12);
        let speed = Speed {
            side,
            advance,
            turn,
        };
        assert_eq!(world.drive("base", speed).expect("a robot"), speed);
        world.run(1000).expect("steps");
        let expected = closed_form(start, speed, 10.0);
        assert_near(world.place("base").expect("a robot"), expected, 1e-6);
        assert_near(
            world.base("base").expect("a robot").odometer,
            expected,
            1e-6,
        );
    }
}

#[test]
fn straight_ways_go_where_the_base_looks() {
    let mut world = robot("omnirobot", "");
    let speed = Speed {
        side: 300.0,
        advance: 400.0,
        turn: 0.0,
    };
    world.drive("base", speed).expect("a robot");
    world.run(100).expect("steps");
    let pose = world.tree().pose("root", "base").expect("a node");
    assert_eq!(pose.translation.map(f64::round), [400.0, 0.0, 600.0]);
}

#[test]
fn speeds_are_limited_and_nonsense_is_refused() {
    let mut world = robot("differentialrobot", r#"maxturn="1""#);
    let speed = |side, advance, turn| Speed {
        side,
        advance,
        turn,
    };
    assert_eq!(
        world
            .drive("base", speed(50.0, -1e9, 7.0))
            .expect("a robot"),
        speed(0.0, -2000.0, 1.0)
    );
    let error = world.drive("base", speed(0.0, f64::NAN, 0.0)).unwrap_err();
    assert_eq!(error.to_string(), "a speed for `base` is not finite");
    assert_eq!(
        world.base("base").expect("a robot").wanted,
        speed(0.0, -2000.0, 1.0)
    );
    let mut omni = robot("omnirobot", "");
    let taken = omni
        .drive("base", speed(3000.0, 4000.0, 0.0))
        .expect("a robot");
    assert!((taken.side - 1200.0).abs() < 1e-9 && (taken.advance - 1600.0).abs() < 1e-9);
}

#[test]
fn odometry_is_set_and_slips_and_errs() {
    let mut world = robot("differentialrobot", r#"slip="0.1""#);
    let straight = Speed {
        advance: 1000.0,
        ..Speed::default()
    };
    let home = Pose2D {
        x: 5.0,
        z: 6.0,
        alpha: 0.0,
    };
    world
        .set_odometer("base", Some(Pose2D::default()), Some(home))
        .expect("a robot");
    world.drive("base", straight).expect("a robot");
    world.run(100).expect("steps");
    let base = world.base("base").expect("a robot").clone();
    assert_near(
        base.odometer,
        Pose2D {
            x: 1000.0,
            z: 0.0,
            alpha: 0.0,
        },
        1e-6,
    );
    assert_near(
        base.corrected,
        Pose2D {
            x: 1005.0,
            z: 6.0,
            alpha: 0.0,
        },
        1e-6,
    );
    let place = world.place("base").expect("a robot");
    assert_near(
        place,
        Pose2D {
            x: 100.0,
            z: 1100.0,
            alpha: FRAC_PI_2,
        },
        1e-6,
    );
}

/// After 1 m, the odometer errs by a part of the way, whatever the length of a step.
#[test]
fn odometry_errs_as_its_noise_says() {
    let text = r#"<innerModel><differentialrobot id="base" noise="0.05"/></innerModel>"#;
    for (step, steps) in [(10, 100), (100, 10)] {
        let errors = (0..1000).map(|seed| {
            let step = std::time::Duration::from_millis(step);
            let model = InnerModel::parse(text).expect("a text");
            let mut world = World::new(model, step, seed).expect("a world");
            let arc = Speed {
                advance: 1000.0,
                turn: 0.5,
                ..Speed::default()
            };
            world.drive("base", arc).expect("a robot");
            world.run(steps).expect("steps");
            let odometer = world.base("base").expect("a robot").odometer;
            let place = world.place("base").expect("a robot");
            // The length of the way and the turn: the arc of the odometer has both.
            let turn = odometer.alpha - place.alpha;
            let (true_chord, chord) = (place.x.hypot(place.z), odometer.x.hypot(odometer.z));
            [chord - true_chord, turn]
        });
        let errors: Vec<[f64; 2]> = errors.collect();
        let deviation = |at: usize| {
            let squares: f64 = errors.iter().map(|error| error[at].powi(2)).sum();
            (squares / errors.len() as f64).sqrt()
        };
        // 5 % of 1 m, and of the root of 0.5 rad.
        let (along, about) = (deviation(0), deviation(1));
        assert!((along / 50.0 - 1.0).abs() < 0.1, "{step} ms: {along}");
        let expected = 0.05 * 0.5_f64.sqrt();
        assert!((about / expected - 1.0).abs() < 0.1, "{step} ms: {about}");
    }
}

const RUNNER: &str = r#"<differentialrobot id="base" ty="160" collide="1">
        <cylinder id="hull" radius="200" length="300" collide="1"/>
        <touchsensor id="bumper">
            <cylinder id="skirt" radius="205" length="100" collide="1"/>
        </touchsensor>
    </differentialrobot>"#;

#[test]
fn an_obstacle_stops_the_base_and_is_felt() {
    let mut world = world(&room(RUNNER));
    world
        .drive(
            "base",
            Speed {
                advance: 900.0,
                ..Speed::default()
            },
        )
        .expect("a robot");
    world.run(150).expect("steps");
    assert_eq!(world.touch("bumper").expect("a sensor").node, None);
    world.run(150).expect("steps");
    let place = world.place("base").expect("a robot");
    assert!((place.z - 1800.0).abs() < 0.02, "{place:?}");
    let base = world.base("base").expect("a robot").clone();
    let (body, wall) = base.stopped_by.expect("a wall");
    assert_eq!(
        (world.id_of(body).as_deref(), world.id_of(wall).as_deref()),
        (Some("hull"), Some("north"))
    );
    assert!(base.actual.advance < 1.0);
    let touched = world
        .touch("bumper")
        .expect("a sensor")
        .node
        .expect("a contact");
    assert_eq!(world.id_of(touched).as_deref(), Some("north"));
    // A turn is free, and so is the way back.
    let back = Speed {
        advance: -500.0,
        turn: 1.0,
        ..Speed::default()
    };
    world.drive("base", back).expect("a robot");
    world.run(20).expect("steps");
    let place = world.place("base").expect("a robot");
    assert!(
        place.z < 1750.0 && (place.alpha - FRAC_PI_2 - 0.2).abs() < 1e-9,
        "{place:?}"
    );
}

#[test]
fn a_fast_base_jumps_over_no_wall() {
    let text = room(&RUNNER.replace(r#"collide="1">"#, r#"collide="1" maxspeed="1000000">"#));
    let model = innermodel::InnerModel::parse(&text).expect("a right text");
    let mut world = World::new(model, std::time::Duration::from_secs(1), 1).expect("a world");
    world
        .drive(
            "base",
            Speed {
                advance: 50_000.0,
                ..Speed::default()
            },
        )
        .expect("a robot");
    world.step().expect("a step");
    let place = world.place("base").expect("a robot");
    assert!((place.z - 1800.0).abs() < 0.02, "{place:?}");
}

#[test]
fn joints_move_within_their_limits() {
    let mut world = world(
        r#"<innerModel><joint id="j" min="-1" max="2" maxspeed="0.5"><joint id="k"/></joint></innerModel>"#,
    );
    let to = |target, speed| MotorGoal::Position { target, speed };
    assert_eq!(
        world
            .command(&[("j", to(1.0, 0.0)), ("k", to(3.0, 1.0))])
            .expect("joints"),
        [false, false]
    );
    world.run(100).expect("steps");
    let (j, k) = (
        world.motor("j").expect("a joint"),
        world.motor("k").expect("a joint"),
    );
    assert!(
        (j.position - 0.5).abs() < 1e-9 && (j.velocity - 0.5).abs() < 1e-9,
        "{j:?}"
    );
    assert!((k.position - 1.0).abs() < 1e-9);
    world.run(400).expect("steps");
    assert_eq!(world.motor("j").expect("a joint").position, 1.0);
    assert_eq!(world.motor("j").expect("a joint").velocity, 0.0);
    let turn = |velocity| MotorGoal::Velocity {
        velocity,
        acceleration: 0.0,
    };
    assert_eq!(world.command(&[("j", turn(9.0))]).expect("a joint"), [true]);
    world.run(1000).expect("steps");
    assert_eq!(world.motor("j").expect("a joint").position, 2.0);
    assert_eq!(
        world.command(&[("j", to(5.0, 0.0))]).expect("a joint"),
        [true]
    );
    // One wrong goal, and none holds.
    let refused = world.command(&[("j", to(0.0, 0.0)), ("k", to(f64::INFINITY, 0.0))]);
    assert_eq!(
        refused.unwrap_err().to_string(),
        "a goal for `k` is not finite"
    );
    world.run(10).expect("steps");
    assert_eq!(world.motor("j").expect("a joint").position, 2.0);
}

#[test]
fn a_base_without_charge_stands() {
    let mut world = world(
        r#"<innerModel><differentialrobot id="base"><battery id="battery" endurance="1" charging="4" level="0.5"/></differentialrobot></innerModel>"#,
    );
    world
        .drive(
            "base",
            Speed {
                advance: 1000.0,
                ..Speed::default()
            },
        )
        .expect("a robot");
    world.run(80).expect("steps");
    assert_eq!(world.battery("battery").expect("a battery").level, 0.0);
    let z = world.place("base").expect("a robot").z;
    assert!((z - 500.0).abs() < 11.0, "{z}");
    world.drive("base", Speed::default()).expect("a robot");
    world.run(100).expect("steps");
    let charged = world.battery("battery").expect("a battery");
    assert!((charged.level - 0.25).abs() < 1e-9 && charged.is_connected);
}

#[test]
fn a_base_on_a_slope_goes_along_it() {
    let mut world = robot("differentialrobot", r#"rx="-0.5""#);
    world
        .drive(
            "base",
            Speed {
                advance: 1000.0,
                ..Speed::default()
            },
        )
        .expect("a robot");
    world.run(100).expect("steps");
    let [_, y, z] = world
        .tree()
        .pose("root", "base")
        .expect("a node")
        .translation;
    assert!(
        (y - 1000.0 * 0.5_f64.sin()).abs() < 1e-6
            && (z - 200.0 - 1000.0 * 0.5_f64.cos()).abs() < 1e-6
    );
}

#[test]
fn no_finite_command_stops_the_world() {
    let mut world = world(
        r#"<innerModel>
            <joint id="j"><prismaticJoint id="k"/></joint>
            <omnirobot id="base" maxspeed="1e300" maxturn="1e300"/>
            <human id="ann" path="-1e308,0 1e308,0"/>
        </innerModel>"#,
    );
    let fastest = |velocity| MotorGoal::Velocity {
        velocity,
        acceleration: 0.0,
    };
    let farthest = MotorGoal::Position {
        target: 1.7e308,
        speed: 0.0,
    };
    let taken = world.command(&[("j", fastest(1.7e308)), ("k", farthest)]);
    assert_eq!(taken, Ok(vec![true, true]));
    let speed = Speed {
        side: 1.7e308,
        advance: -1.7e308,
        turn: 1.7e308,
    };
    let taken = world.drive("base", speed).expect("a robot");
    assert!((taken.side.hypot(taken.advance) - 1e6).abs() < 1e-3);
    for _ in 0..300 {
        world.step().expect("a step");
    }
    assert_eq!((world.steps(), world.time().as_millis()), (300, 3000));
    world
        .command(&[("k", fastest(-1.0)), ("j", farthest)])
        .expect("joints");
    world.run(10).expect("steps");
    let (j, k) = (world.motor("j"), world.motor("k"));
    for motor in [j.expect("a joint"), k.expect("a joint")] {
        assert!(
            motor.position.is_finite() && motor.velocity.is_finite(),
            "{motor:?}"
        );
    }
    assert!(world.place("base").expect("a robot").x.is_finite());
    // A place that cannot be is told once, and the others go on.
    let problems = world.problems();
    assert!(problems.len() <= 1, "{problems:?}");
}
