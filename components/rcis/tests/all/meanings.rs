//! The prototypes of the simulator say what its values are.

use crate::{house, member, start};
use rc_diagnostics::{Format, SourceMap, render};
use rc_plans::Network;
use rc_prototypes::model::Library;
use rc_quantity::Axes;
use rc_syntax::MemoryLoader;
use rcis_generated::testing::PoseTopicsSample;
use rcis_generated::{Bases, Imus, WorkerError};
use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

const OWN: &str = include_str!("../../rcis.dproto");
const FULL: &str = include_str!("../../../interfaces/full_pose.dproto");

/// What a client in the axes of ROS expects.
const CLIENT: &str = "import \"rcis.dproto\";
    algebraic v3 :: Vector{3}
    algebraic v9 :: Vector{9}
    dproto place :: geometry { semantic = Position coord = cartesian algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } }
    dproto turn :: geometry { semantic = Orientation coord = rpy algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } axes = ros }
    dproto speed :: geometry { semantic = LinearVelocity coord = cartesian algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } }
    dproto spin :: geometry { semantic = AngularVelocity coord = cartesian algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } }
    dproto state :: geometry { semantic = KinematicState axes = ros
        composes = { Position = place, Orientation = turn, LinearVelocity = speed, AngularVelocity = spin } }
    dproto matrix :: geometry { semantic = Orientation coord = rot_matrix algebraic = v9 ddr = :: c99{double[9]} axes = ros
        dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3, 4 = 4, 5 = 5, 6 = 6, 7 = 7, 8 = 8 } }
    dproto acceleration :: geometry { semantic = Acceleration coord = cartesian algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } axes = ros }
";

fn library() -> Library {
    let mut sources = SourceMap::new();
    let source = sources.add("client.dproto", CLIENT);
    let interface = |name: &str| {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../interfaces/");
        std::fs::read_to_string(format!("{folder}{name}")).expect("an interface")
    };
    let names = [
        "Lidar3D.idsl",
        "IMU.idsl",
        "FullPoseEstimation.idsl",
        "cartesian.dproto",
        "full_pose.dproto",
    ];
    let texts = names.map(interface);
    let files = names.into_iter().zip(texts.iter().map(String::as_str));
    let loader = MemoryLoader::new(files.chain([("rcis.dproto", OWN)]));
    let (library, found) = rc_prototypes::load(&mut sources, &loader, &[source]);
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    library
}

fn converted(library: &Library, from: &str, to: &str, values: &[f32]) -> Vec<f64> {
    let plan = Network::new(library).plan(from, to).expect("a plan");
    let values: Vec<f64> = values.iter().copied().map(f64::from).collect();
    plan.program.run(&values).expect("values")
}

/// Connections and the simulator use the same axes.
#[test]
fn prototypes_have_the_axes_of_the_simulator() {
    let text = format!("{OWN}{FULL}");
    for (name, axes) in [
        ("robocomp", Axes::ROBOCOMP),
        ("innermodel", Axes::INNER_MODEL),
    ] {
        assert!(text.contains(&format!("axes {name} :: {axes}\n")), "{name}");
    }
}

/// A robot that drives forwards and to the left moves along its own x, wherever it looks.
#[test]
fn a_full_pose_is_the_state_of_a_body() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    let base = member(test.bases.get("base"));
    Bases::set_speed_base(&mut worker, &mut test, &base, 400.0, 0.5);
    test.run(&mut worker, Duration::from_secs(1))?;
    let poses: Vec<_> = test.pose_topics.member("base").samples();
    let PoseTopicsSample::NewFullPose { pose } = poses.last().expect("a pose");
    let values = [
        pose.x, pose.y, pose.z, pose.rx, pose.ry, pose.rz, pose.vx, pose.vy, pose.vz, pose.vrx,
        pose.vry, pose.vrz,
    ];
    let found = converted(&library(), "full_pose", "state", &values);
    let [x, y, yaw] = [found[0], found[1], found[5]];
    let near = |one: f64, other: f64, by: f64| (one - other).abs() < by;
    // It began 1.5 m behind and 2 m to the right of the middle, and looked ahead.
    let expected = (
        -1.5 + 0.8 * 0.5_f64.sin(),
        -2.0 + 0.8 * (1.0 - 0.5_f64.cos()),
    );
    assert!(
        near(x, expected.0, 0.01) && near(y, expected.1, 0.01),
        "{found:?}"
    );
    assert!(near(yaw, 0.5, 0.01), "{found:?}");
    assert!(near(found[6], 0.4 * yaw.cos(), 1e-5), "{found:?}");
    assert!(near(found[7], 0.4 * yaw.sin(), 1e-5), "{found:?}");
    assert!(near(found[11], 0.5, 1e-6), "{found:?}");
    Ok(())
}

/// At rest, the acceleration points up and the magnetic field ahead, however the sensor leans.
#[test]
fn the_turns_of_a_sensor_are_a_rotation() -> Result<(), WorkerError> {
    const SCENE: &str = r#"<innerModel><transform id="a" rx="0.3" ry="-0.7" rz="0.2"><transform id="b" ry="0.4" rz="-0.5"><imu id="imu"/></transform></transform></innerModel>"#;
    let (mut worker, mut test) = start(SCENE);
    test.run(&mut worker, Duration::from_millis(100))?;
    let imu = member(test.imus.get("imu"));
    let turns = worker.get_orientation(&mut test, &imu);
    let library = library();
    let turns = [turns.pich, turns.yaw, turns.roll];
    let matrix = converted(&library, "leaning", "matrix", &turns);
    let turned = |own: [f32; 3]| {
        let own = converted(&library, "accelerated", "acceleration", &own);
        let row = |row: usize| (0..3).map(|at| matrix[3 * row + at] * own[at]).sum::<f64>();
        [row(0), row(1), row(2)]
    };
    let up = worker.get_acceleration(&mut test, &imu);
    let up = turned([up.x_acc, up.y_acc, up.z_acc]);
    let north = worker.get_magneticfields(&mut test, &imu);
    let north = turned([north.x_mag, north.y_mag, north.z_mag]);
    for (found, expected) in [(up, [0.0, 0.0, 9.81]), (north, [1.0, 0.0, 0.0])] {
        for (one, other) in found.iter().zip(expected) {
            assert!((one - other).abs() < 1e-4, "{found:?} {expected:?}");
        }
    }
    assert!(turns[0].abs() > 0.1 && f64::from(turns[1].abs()) < FRAC_PI_2);
    Ok(())
}
