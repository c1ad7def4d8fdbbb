//! Arms whose positions for a pose have a closed form.

use crate::load_with;
use rc_kinematics::{Cell, Inverse, Question};
use rc_robot::closed::{Closed, Kind, SOLUTIONS};
use rc_robot::{Robot, State};
use std::fmt::Write as _;

/// The axis, the origin and the turns of each joint, in the frame before it.
type Joints = [([f64; 3], [f64; 3], [f64; 3]); 6];

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const NONE: [f64; 3] = [0.0; 3];

/// Those of a KUKA KR 6 R700, with an offset of the elbow.
const INDUSTRIAL: Joints = [
    (Z, [0.0, 0.0, 0.4], NONE),
    (Y, [0.025, 0.01, 0.0], NONE),
    (Y, [0.0, 0.0, 0.315], NONE),
    (X, [0.1, 0.0, 0.035], NONE),
    (Y, [0.265, 0.0, 0.0], NONE),
    (X, [0.08, 0.0, 0.0], NONE),
];

/// The first two axes meet, the second and the third one are not parallel. No axis is along one of the base.
const CROSSING: Joints = [
    (Z, [0.1, 0.2, 0.4], [0.3, 0.2, 0.1]),
    (Y, [0.0, 0.0, 0.2], [0.1, 0.0, 0.3]),
    ([0.6, 0.8, 0.0], [0.1, 0.05, 0.3], [0.0, 0.2, 0.0]),
    (Z, [0.05, 0.02, 0.3], [0.5, 0.0, 0.0]),
    (X, [0.0, 0.0, 0.0], [0.0, 0.0, 0.4]),
    (Z, [0.0, 0.0, 0.0], [0.2, 0.1, 0.0]),
];

fn urdf(joints: &Joints) -> String {
    let mut out = String::from("<robot name=\"arm\">\n<link name=\"base\"/>\n");
    let words = |of: [f64; 3]| format!("{} {} {}", of[0], of[1], of[2]);
    let mut parent = "base".to_owned();
    for (at, (axis, origin, turns)) in joints.iter().enumerate() {
        let link = if at == 5 {
            "tool".to_owned()
        } else {
            format!("link_{at}")
        };
        writeln!(
            out,
            "<link name=\"{link}\"/><joint name=\"joint_{at}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{link}\"/>\
            <origin xyz=\"{}\" rpy=\"{}\"/><axis xyz=\"{}\"/><limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"1\"/></joint>",
            words(*origin),
            words(*turns),
            words(*axis)
        )
        .expect("a text");
        parent = link;
    }
    out + "</robot>\n"
}

const SOLVERS: &str = "import \"arm.urdf\"; Kinematics arm {
    solver reach { inverse pose tool in base; within limits; };
    solver alone { inverse pose tool in base; restarts 0; tolerance 1e-9 m 1e-9 rad; };
};";

fn cell(robot: &str) -> Cell {
    let (cell, found) = load_with(SOLVERS, robot);
    assert!(!found.contains("error["), "{found}");
    cell.expect("a cell")
}

fn closed(robot: &Robot) -> Option<Closed> {
    let place = |name| robot.body(name).expect("a link");
    let chain = robot.chain(place("base"), place("tool")).expect("a chain");
    chain.closed(robot.coordinates.len())
}

fn pose(robot: &Robot, positions: &[f64]) -> rc_quantity::Transform {
    let place = |name| robot.body(name).expect("a link");
    let chain = robot.chain(place("base"), place("tool")).expect("a chain");
    chain.moved(&State::still(positions.to_vec())).pose
}

/// How far two poses are from each other, in m or as a part of a rotation matrix.
fn apart(one: &rc_quantity::Transform, other: &rc_quantity::Transform) -> f64 {
    let rows = one.rotation.iter().chain([&one.translation]);
    let others = other.rotation.iter().chain([&other.translation]);
    let parts = rows.flatten().zip(others.flatten());
    parts.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn rows(pose: &rc_quantity::Transform) -> [[f64; 4]; 4] {
    let mut out = [[0.0, 0.0, 0.0, 1.0]; 4];
    let parts = pose.rotation.iter().zip(pose.translation);
    for (row, (turn, place)) in out.iter_mut().zip(parts) {
        row[..3].copy_from_slice(turn);
        row[3] = place;
    }
    out
}

fn arms() -> [(String, Kind); 3] {
    let six = include_str!("../../examples/six.urdf").to_owned();
    [
        (six, Kind::ThreeParallel),
        (urdf(&INDUSTRIAL), Kind::ParallelAndWrist),
        (urdf(&CROSSING), Kind::CrossingAndWrist),
    ]
}

/// One of the positions is where the pose is from, and others are no worse.
#[test]
fn positions_of_the_closed_form_have_the_pose() {
    for (text, kind) in arms() {
        let robot = cell(&text).robot;
        let closed = closed(&robot).expect("a closed form");
        assert_eq!(closed.kind, kind);
        let mut random = fastrand::Rng::with_seed(44);
        let mut good = 0;
        for _ in 0..300 {
            let from: Vec<f64> = (0..6).map(|_| random.f64() * 6.0 - 3.0).collect();
            let target = pose(&robot, &from);
            let found = closed.positions(&target.rotation, target.translation);
            assert_eq!(found.len(), SOLUTIONS);
            let is_origin = found.iter().any(|positions| {
                let ways = positions
                    .iter()
                    .zip(&from)
                    .map(|(a, b)| (a - b).sin().abs());
                ways.fold(0.0, f64::max) < 1e-6
            });
            assert!(is_origin, "{kind:?} {from:?} {found:?}");
            for one in found
                .iter()
                .filter(|one| one.iter().all(|at| at.is_finite()))
            {
                let far = apart(&pose(&robot, &one[..]), &target);
                assert!(far < 1e-6, "{kind:?} {from:?} {one:?} {far}");
                good += 1;
            }
        }
        assert!(good >= 300 * 2, "{kind:?}: {good}");
    }
}

/// The search ends at its first beginning; without a closed form, it seldom does.
#[test]
fn a_search_begins_with_the_closed_form() {
    for (text, kind) in arms() {
        let cell = cell(&text);
        let mut random = fastrand::Rng::with_seed(7);
        let mut computations = Vec::new();
        for round in 0..200 {
            let mut some = || -> Vec<f64> { (0..6).map(|_| random.f64() * 6.0 - 3.0).collect() };
            let (from, last) = (some(), some());
            let target = pose(&cell.robot, &from);
            let inverse: &Inverse = &cell.inverses[round % 2];
            let (positions, found) = inverse.positions(&rows(&target), &last).expect("a pose");
            assert!(found.reached, "{kind:?} {from:?} {found:?}");
            assert!(apart(&pose(&cell.robot, &positions), &target) < 2e-6);
            let way =
                |one: &[f64]| -> f64 { one.iter().zip(&last).map(|(a, b)| (a - b).powi(2)).sum() };
            if round % 2 == 0 {
                let limits = cell.robot.limits().into_iter().flatten();
                let mut kept = positions.iter().zip(limits);
                assert!(kept.all(|(at, limits)| *at >= limits.lower && *at <= limits.upper));
                // The nearest positions are the answer.
                assert!(way(&positions) <= way(&from) + 1e-9, "{kind:?}");
            }
            computations.push(found.iterations);
        }
        computations.sort_unstable();
        assert_eq!(computations[180], 1, "{kind:?} {computations:?}");
    }
}

/// A singular position, in which two joints turn about one axis, and the middle of a wrist.
#[test]
fn singular_poses_are_found() {
    for (text, kind) in arms() {
        let cell = cell(&text);
        for from in [
            [0.0; 6],
            [0.4, -0.9, 1.1, 0.3, 0.0, 0.7],
            [0.3, 0.2, 0.0, 0.1, 0.5, -0.2],
        ] {
            let target = rows(&pose(&cell.robot, &from));
            let last = [0.1, -0.2, 0.3, 0.1, 0.2, 0.3];
            let (positions, found) = cell.inverses[0].positions(&target, &last).expect("a pose");
            assert!(found.reached, "{kind:?} {from:?} {found:?} {positions:?}");
        }
    }
}

/// Other arms have none: a wrist that is a millimetre apart, an axis that leans, a joint that slides, a joint too many.
#[test]
fn arms_without_a_closed_form_are_told_apart() {
    let is_closed = |text: &str| match &cell(text).inverses[0].asked {
        Question::Pose(search) => search.closed.is_some(),
        Question::Velocity(_) => false,
    };
    let changed = |change: fn(&mut Joints)| {
        let mut joints = INDUSTRIAL;
        change(&mut joints);
        urdf(&joints)
    };
    assert!(is_closed(&urdf(&INDUSTRIAL)));
    assert!(is_closed(
        &changed(|joints| joints[5].1 = [0.05, 0.0, 1e-9])
    ));
    assert!(!is_closed(&changed(
        |joints| joints[5].1 = [0.05, 0.0, 1e-3]
    )));
    assert!(!is_closed(
        &changed(|joints| joints[2].2 = [1e-3, 0.0, 0.0])
    ));
    let slides = urdf(&INDUSTRIAL).replacen("revolute", "prismatic", 1);
    assert!(!is_closed(&slides));
    assert!(!is_closed(include_str!("../robots/seven.urdf")));
    // The solver says so.
    let text = rc_kinematics::rust(&cell(&urdf(&INDUSTRIAL)));
    assert!(text.contains("axes 2 and 3 are parallel"), "{text}");
}
