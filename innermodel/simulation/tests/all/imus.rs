//! Inertial sensors.

use crate::world;
use innermodel::{Pose, Vector};
use innermodel_simulation::{MotorGoal, Speed};

#[test]
fn at_rest_the_acceleration_is_upwards() {
    let mut world = world(
        r#"<innerModel><transform id="a" rx="0.3" ry="1" rz="-0.8"><imu id="imu"/></transform></innerModel>"#,
    );
    for _ in 0..3 {
        let inertia = world.imu("imu").expect("values");
        let place = world.tree().between("root", "imu").expect("a node");
        let up = place.vector(&inertia.acceleration);
        assert!((up - Vector::new(0.0, 9.81, 0.0)).norm() < 1e-9, "{up}");
        assert_eq!(inertia.turning, Vector::zeros());
        world.step().expect("a step");
    }
}

#[test]
fn on_an_arc_it_has_what_the_motion_has() {
    let mut world = world(
        r#"<innerModel><differentialrobot id="base">
            <transform id="arm" tx="500"><imu id="imu"/></transform>
        </differentialrobot></innerModel>"#,
    );
    let speed = Speed {
        advance: 600.0,
        turn: 1.5,
        ..Speed::default()
    };
    world.drive("base", speed).expect("a robot");
    world.run(50).expect("steps");
    let inertia = world.imu("imu").expect("values");
    // The base turns to the left about a point 400 mm to its left; the sensor is 900 mm from it.
    let expected = Vector::new(-1.5 * 1.5 * 0.9, 9.81, 0.0);
    assert!(
        (inertia.acceleration - expected).norm() < 1e-3,
        "{}",
        inertia.acceleration
    );
    // y is upwards in a left-handed frame: a turn to the left is negative.
    assert!((inertia.turning - Vector::new(0.0, -1.5, 0.0)).norm() < 1e-9);
}

#[test]
fn a_joint_that_accelerates_and_a_jump() {
    let mut world = world(
        r#"<innerModel><prismaticJoint id="slide" axis="x"><imu id="imu"/></prismaticJoint>
            <transform id="free" tx="1"><imu id="jumper"/></transform></innerModel>"#,
    );
    let goal = MotorGoal::Velocity {
        velocity: 1e6,
        acceleration: 2000.0,
    };
    world.command(&[("slide", goal)]).expect("a joint");
    world.run(20).expect("steps");
    let inertia = world.imu("imu").expect("values");
    assert!((inertia.acceleration - Vector::new(2.0, 9.81, 0.0)).norm() < 1e-9);
    let far = Pose::new(9000.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    world.teleport("free", "root", far).expect("a place");
    world.step().expect("a step");
    let jumped = world.imu("jumper").expect("values");
    assert!((jumped.acceleration - Vector::new(0.0, 9.81, 0.0)).norm() < 1e-9);
}

/// Accelerations of a base that drives on, read in each of the next steps.
fn next_accelerations(world: &mut innermodel_simulation::World) -> Vec<f64> {
    (0..4)
        .map(|_| {
            world.step().expect("a step");
            world.imu("imu").expect("values").acceleration.z
        })
        .collect()
}

#[test]
fn a_change_of_the_scene_is_no_jolt_for_a_sensor_that_drives() {
    let mut world = world(
        r#"<innerModel><differentialrobot id="base"><imu id="imu"/></differentialrobot>
            <transform id="cup" tx="5000"/></innerModel>"#,
    );
    let speed = Speed {
        advance: 1000.0,
        ..Speed::default()
    };
    world.drive("base", speed).expect("a robot");
    world.run(20).expect("steps");
    let is_calm = |values: Vec<f64>| values.iter().all(|a| a.abs() < 1e-6);
    let kept = world.snapshot();
    world.edit(|edit| edit.remove("cup")).expect("a change");
    assert!(is_calm(next_accelerations(&mut world)), "after an edit");
    let far = Pose::new(0.0, 0.0, 9000.0, 0.0, 1.0, 0.0);
    world.teleport("base", "root", far).expect("a place");
    assert!(is_calm(next_accelerations(&mut world)), "after a jump");
    world.restore(&kept);
    assert!(is_calm(next_accelerations(&mut world)), "after a way back");
    // A sensor measures the motion of its base after an edit.
    world
        .edit(|edit| {
            edit.add(
                "root",
                innermodel::NewNode::transform("new", Pose::default()),
            )
        })
        .expect("a change");
    world.drive("base", Speed::default()).expect("a robot");
    assert!((next_accelerations(&mut world)[0] + 100.0).abs() < 1e-6);
}

#[test]
fn slow_turns_are_right() {
    for turn in [1e-5, 1e-4, 1e-3, -0.1, 3.0] {
        let text = r#"<innerModel><joint id="yaw" axis="y" maxspeed="9">
            <transform id="tilt" rx="0.7" rz="-0.4"><imu id="imu"/></transform></joint></innerModel>"#;
        let model = innermodel::InnerModel::parse(text).expect("a right text");
        let step = std::time::Duration::from_millis(1);
        let mut world = innermodel_simulation::World::new(model, step, 1).expect("a world");
        let goal = MotorGoal::Velocity {
            velocity: turn,
            acceleration: 0.0,
        };
        world.command(&[("yaw", goal)]).expect("a joint");
        for _ in 0..2000 {
            world.step().expect("a step");
            let turning = world.imu("imu").expect("values").turning.norm();
            let error = (turning - turn.abs()).abs();
            assert!(error < 1e-6 * turn.abs() + 1e-12, "{turn}: {turning}");
        }
    }
}

#[test]
fn values_of_one_frame_belong_together() {
    // An IMU that tilts fast about its own origin: free fall is in the axes of `orientation`.
    let mut world = world(
        r#"<innerModel><joint id="tilt" axis="x" maxspeed="9"><imu id="imu"/></joint></innerModel>"#,
    );
    let goal = MotorGoal::Velocity {
        velocity: 3.0,
        acceleration: 0.0,
    };
    world.command(&[("tilt", goal)]).expect("a joint");
    world.run(30).expect("steps");
    let inertia = world.imu("imu").expect("values");
    let [rx, ry, rz] = inertia.orientation;
    let to_root = innermodel::Transform::of(&Pose::new(0.0, 0.0, 0.0, rx, ry, rz));
    let up = to_root.vector(&inertia.acceleration);
    assert!((up - Vector::new(0.0, 9.81, 0.0)).norm() < 1e-9, "{up}");
}

#[test]
fn the_sum_of_the_readings_is_the_speed_whatever_the_rate() {
    for start in 0..5 {
        let mut world = world(
            r#"<innerModel><differentialrobot id="base"><imu id="imu" rate="20"/></differentialrobot></innerModel>"#,
        );
        world.run(start).expect("steps");
        let speed = Speed {
            advance: 1000.0,
            turn: 0.0,
            ..Speed::default()
        };
        world.drive("base", speed).expect("a robot");
        let (mut last, mut sum) = (0, 0.0);
        for _ in 0..20 {
            world.step().expect("a step");
            let inertia = world.imu("imu").expect("values");
            if inertia.number != last {
                last = inertia.number;
                sum += inertia.acceleration.z * 0.05;
            }
        }
        assert!((sum - 1.0).abs() < 1e-9, "{start}: {sum}");
    }
}

#[test]
fn errors_of_an_inertial_sensor() {
    let imu =
        |attributes: &str| format!(r#"<innerModel><imu id="imu" {attributes}/></innerModel>"#);
    let mut drifting = world(&imu(r#"drift="1""#));
    drifting.run(100).expect("steps");
    let a = drifting.imu("imu").expect("values").acceleration - Vector::new(0.0, 9.81, 0.0);
    assert!(a.x != a.y && a.y != a.z && a.x != a.z, "{a}");
    let mut lossy = world(&imu(r#"dropout="0.3" noise="0.1" gyronoise="0.1""#));
    let mut lost = 0;
    for _ in 0..1000 {
        lossy.step().expect("a step");
        let inertia = lossy.imu("imu").expect("values");
        let values = inertia.acceleration.iter().chain(&inertia.turning);
        let zeros = values.filter(|value| **value == 0.0).count();
        assert!(zeros == 0 || zeros == 6, "{inertia:?}");
        lost += zeros / 6;
    }
    assert!((200..400).contains(&lost), "{lost}");
}
