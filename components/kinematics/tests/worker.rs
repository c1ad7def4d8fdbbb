//! The worker without processes.

use kinematics::SpecificWorker;
use kinematics_generated::testing::{TestContext, WorldSample};
use kinematics_generated::{
    Header, InverseError, JointState, Joints, Kinematics, Quaternion, Transform, Vector3, Worker,
    WorkerError,
};
use std::path::Path;
use std::time::Duration;

fn started(robot: &str) -> (SpecificWorker, TestContext) {
    let mut test = TestContext::configured().expect("a configuration");
    test.params.robot = Path::new(env!("CARGO_MANIFEST_DIR")).join(robot);
    let worker = SpecificWorker::initialize(&mut test).expect("a robot");
    (worker, test)
}

/// Two arms of a `.kdsl`, one of which stands on the other one's base.
#[test]
fn links_of_several_robots_are_known() {
    let folder = tempfile::tempdir().expect("a folder");
    let arm = include_str!("../../../kinematics/examples/arm.urdf");
    std::fs::write(folder.path().join("arm.urdf"), arm).expect("a file");
    let text = "import \"arm.urdf\" as left; import \"arm.urdf\" as right;
        Kinematics two { planar left.base in floor; fixed right.base in left.base at 0, 800 mm, 0; };";
    std::fs::write(folder.path().join("two.kdsl"), text).expect("a file");
    let file = folder.path().join("two.kdsl");
    let (mut worker, mut test) = started(file.to_str().expect("a name in UTF-8"));
    let links = worker.get_links(&mut test);
    assert!(links.contains(&"right.wrist".to_owned()) && links.contains(&"floor".to_owned()));
    let joints = worker.get_joints(&mut test).len();
    let mut at = vec![0.0; joints];
    let base = ["right.base".to_owned(), "floor".to_owned()];
    let names: Vec<String> = worker
        .get_joints(&mut test)
        .into_iter()
        .map(|one| one.name)
        .collect();
    let x = names
        .iter()
        .position(|name| name == "left.base.x")
        .expect("a coordinate");
    at[x] = 2.0;
    let place = worker
        .forward(&mut test, base[0].clone(), base[1].clone(), at)
        .expect("two links");
    assert_eq!([place.translation.x, place.translation.y], [2.0, 0.8]);
    // The frames of all links, each in the one above it: no body inside the base is one.
    let state = JointState {
        name: vec!["left.base.x".into()],
        position: vec![2.0],
        ..JointState::default()
    };
    worker.joint_states(&mut test, state);
    let samples = test.frames.take_samples();
    let frames = format!("{samples:?}");
    assert!(
        frames.contains("\"left.base\"") && frames.contains("\"floor\""),
        "{frames}"
    );
    assert!(!frames.contains("child_frame_id: \"\""), "{frames}");
}

#[test]
fn wrong_messages_and_requests_change_nothing() {
    let (mut worker, mut test) = started("../../kinematics/examples/six.urdf");
    let before = worker.get_positions(&mut test);
    for position in [vec![1.0], vec![f64::NAN, 0.0]] {
        let name = vec!["elbow".into(), "wrist_1".into()];
        let state = JointState {
            header: Header::default(),
            name,
            position,
            ..JointState::default()
        };
        worker.joint_states(&mut test, state);
    }
    assert_eq!(worker.get_positions(&mut test), before);
    let refused = |worker: &mut SpecificWorker, test: &mut TestContext, pose: Transform| {
        match worker.inverse(test, "tool".into(), "base".into(), pose, Vec::new()) {
            Err(InverseError::KinematicsError(error)) => error.what,
            other => panic!("{other:?}"),
        }
    };
    assert!(refused(&mut worker, &mut test, Transform::default()).contains("quaternion"));
    let rotation = Quaternion {
        w: 1.0,
        ..Quaternion::default()
    };
    let translation = Vector3 {
        x: f64::INFINITY,
        ..Vector3::default()
    };
    let pose = Transform {
        translation,
        rotation,
    };
    assert!(refused(&mut worker, &mut test, pose).contains("not finite"));
    let translation = Vector3 {
        x: 1e300,
        ..Vector3::default()
    };
    let pose = Transform {
        translation,
        rotation: Quaternion {
            w: 1.0,
            ..Quaternion::default()
        },
    };
    let told = refused(&mut worker, &mut test, pose);
    assert!(told.contains("greater than 1e9 m"), "{told}");
    let far = worker.forward(&mut test, "tool".into(), "base".into(), vec![1e300; 6]);
    assert!(format!("{far:?}").contains("greater than 1e9"), "{far:?}");
}

/// Poses all over the workspace need searches; a path of them ends before the other requests wait long.
#[test]
fn a_path_has_a_bound_on_its_computations() {
    let (mut worker, mut test) = started("../../kinematics/tests/robots/seven.urdf");
    let joints = worker.get_joints(&mut test);
    let links = worker.get_links(&mut test);
    let (base, tip) = (links[0].clone(), links[links.len() - 1].clone());
    let mut poses = Vec::new();
    for pose in 0..1_000_u32 {
        let part = |joint: usize| {
            let at = f64::from(pose) * 0.618_034 + (joint as f64) * 0.754_878 * f64::from(pose);
            at.fract()
        };
        let at = joints.iter().enumerate();
        let at = at.map(|(place, joint)| {
            let (lower, upper) = (joint.lower.max(-3.0), joint.upper.min(3.0));
            lower + part(place) * (upper - lower)
        });
        let at = at.collect();
        let place = worker.forward(&mut test, tip.clone(), base.clone(), at);
        poses.push(place.expect("a pose"));
    }
    let near = vec![poses[0].clone(); 1_000];
    let along = worker.path(&mut test, tip.clone(), base.clone(), near, Vec::new());
    assert_eq!(along.expect("one place").len(), 1_000);
    let jumps = worker.path(&mut test, tip, base, poses, Vec::new());
    let told = format!("{:?}", jumps.map(|found| found.len()));
    assert!(told.contains("ask for parts of the path"), "{told}");
}

#[test]
fn a_robot_in_millimetres_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let arm = include_str!("../../../kinematics/examples/arm.urdf");
    std::fs::write(folder.path().join("arm.urdf"), arm).expect("a file");
    let text = "import \"arm.urdf\"; Kinematics one { lengths mm; };";
    std::fs::write(folder.path().join("one.kdsl"), text).expect("a file");
    let mut test = TestContext::configured().expect("a configuration");
    test.params.robot = folder.path().join("one.kdsl");
    match SpecificWorker::initialize(&mut test) {
        Err(WorkerError::Fatal(what)) => assert!(what.contains("remove `lengths`"), "{what}"),
        _ => panic!("it starts"),
    }
}

#[test]
fn a_robot_that_is_not_there_ends_the_component_with_its_reason() {
    let mut test = TestContext::configured().expect("a configuration");
    test.params.robot = "no_such.urdf".into();
    match SpecificWorker::initialize(&mut test) {
        Err(WorkerError::Fatal(what)) => assert!(what.contains("no_such.urdf"), "{what}"),
        _ => panic!("it starts"),
    }
}

/// A frame of the file is used, so those of the robot come later. A file that nobody reads delays them for a
/// while.
#[test]
fn frames_wait_for_the_start_of_a_world_that_has_a_file() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (start, wait) in [("", 4), ("home.graph", 30)] {
        let mut test = TestContext::configured().expect("a configuration");
        test.params.robot = here.join("../../kinematics/examples/six.urdf");
        test.params.schema = here.join("../interfaces/home.gdsl");
        test.params.start = start.into();
        let mut worker = SpecificWorker::initialize(&mut test).expect("a robot");
        let mut has_frames = |seconds| {
            let ran = test.run(&mut worker, Duration::from_secs(seconds));
            ran.expect("it goes on");
            let samples = test.world.take_samples();
            assert!(!samples.is_empty(), "it announces itself each second");
            samples
                .iter()
                .any(|sample| matches!(sample, WorldSample::Change { .. }))
        };
        assert!(!has_frames(wait - 1), "{start}");
        assert!(has_frames(2), "{start}");
    }
}

/// A worker in a world of its own that has joined, and one of its joints.
fn joined() -> (SpecificWorker, TestContext, String) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut test = TestContext::configured().expect("a configuration");
    test.params.robot = here.join("../../kinematics/examples/six.urdf");
    test.params.schema = here.join("../interfaces/home.gdsl");
    let mut worker = SpecificWorker::initialize(&mut test).expect("a robot");
    let ran = test.run(&mut worker, Duration::from_secs(6));
    ran.expect("it goes on");
    let joint = worker.get_joints(&mut test).swap_remove(0).name;
    test.world_stream.take_samples();
    (worker, test, joint)
}

/// A joint moves, and the time goes on.
fn step(
    (worker, test): (&mut SpecificWorker, &mut TestContext),
    joint: &str,
    position: f64,
    pause: Duration,
) {
    let state = JointState {
        name: vec![joint.to_owned()],
        position: vec![position],
        ..JointState::default()
    };
    worker.joint_states(test, state);
    test.run(worker, pause).expect("it goes on");
}

/// The poses of a moving link are sent when they change, not with the next announcement of the replica.
#[test]
fn a_link_that_moves_is_in_the_world_at_once() {
    let (mut worker, mut test, joint) = joined();
    for count in 1..=5 {
        let pause = Duration::from_millis(200);
        let position = 0.1 * f64::from(count);
        step((&mut worker, &mut test), &joint, position, pause);
        let samples = test.world_stream.take_samples();
        assert!(!samples.is_empty(), "step {count}");
    }
}

/// They are sent once in 20 ms at most, however often they change, and the last one arrives.
#[test]
fn a_link_that_moves_ten_thousand_times_a_second_is_sent_fifty_times() {
    let (mut worker, mut test, joint) = joined();
    for count in 1..=2_000 {
        let pause = Duration::from_micros(100);
        let position = 1e-4 * f64::from(count);
        step((&mut worker, &mut test), &joint, position, pause);
    }
    let count = test.world_stream.take_samples().len();
    assert!((10..=11).contains(&count), "{count}");
    let ran = test.run(&mut worker, Duration::from_millis(100));
    ran.expect("it goes on");
    assert_eq!(test.world_stream.take_samples().len(), 1);
}
