//! Changes between frames that move.

use crate::library;
use rc_plans::{Plan, TRANSFORM};
use rc_quantity::rotation::EulerOrder;

/// Prototypes of a point and a pose with these axes and unit.
fn text(axes: &str, unit: &str, frame: &str, more: &str) -> String {
    format!(
        "axes own :: {axes}
         algebraic xyz :: Scalar{{x, y, z}}
         algebraic quat :: Scalar{{x, y, z, w}}
         units u :: qudt, xyz {{ x = {unit}, y = {unit}, z = {unit} }}
         dproto point :: geometry {{ semantic = Position coord = cartesian algebraic = xyz
             ddr = :: ROS{{a/P}} dr = {{ x = x, y = y, z = z }} units = u axes = own
             frames = {{ with_respect_to = {frame} }} {more} }}
         dproto place :: geometry {{ semantic = Position coord = cartesian algebraic = xyz
             ddr = :: ROS{{a/P}} dr = {{ x = x, y = y, z = z }} units = u axes = own }}
         dproto turn :: geometry {{ semantic = Orientation coord = quaternion algebraic = quat
             ddr = :: ROS{{a/Q}} dr = {{ x = x, y = y, z = z, w = w }} axes = own }}
         dproto pose :: geometry {{ semantic = Pose
             composes = {{ Position = place, Orientation = turn }}
             frames = {{ of = hand, with_respect_to = {frame} }} }}
         dproto inner :: geometry {{ semantic = Pose
             composes = {{ Position = place, Orientation = turn }} }}
         dproto both :: geometry {{ semantic = PairPose composes = {{ Obj1 = inner, Obj2 = inner }}
             frames = {{ with_respect_to = {frame} }} }}
         dproto speed :: geometry {{ semantic = LinearVelocity coord = cartesian algebraic = xyz
             ddr = :: ROS{{a/P}} dr = {{ x = x, y = y, z = z }} axes = own }}
         dproto bare :: geometry {{ semantic = Position coord = cartesian algebraic = xyz
             ddr = :: ROS{{a/P}} dr = {{ x = x, y = y, z = z }} units = u }}"
    )
}

const ROS: &str = "ahead, left, up";
const LIDAR: &str = "right, ahead, up";

fn plan(name: &str) -> Result<Plan, String> {
    let (from, to) = (
        library(&text(LIDAR, "mm", "lidar", "")),
        library(&text(ROS, "m", "map", "")),
    );
    let plan = rc_plans::moving((&from, name), (&to, name));
    plan.map_err(|refusal| format!("{}: {refusal}", refusal.code()))
}

/// A quarter to the left, and a translation: of the axes of ROS, in metres.
fn transform() -> [f64; TRANSFORM] {
    [
        0.0, -1.0, 0.0, 10.0, 1.0, 0.0, 0.0, 20.0, 0.0, 0.0, 1.0, 30.0,
    ]
}

#[track_caller]
fn gives(plan: &Plan, values: &[f64], expected: &[f64]) {
    let input: Vec<f64> = values.iter().copied().chain(transform()).collect();
    let found = plan.program.run(&input).expect("values");
    let near = found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(
        found.len() == expected.len() && near,
        "{found:?} {expected:?}"
    );
}

#[test]
fn points_and_poses_move_with_their_units_and_axes() {
    let of_point = plan("point").expect("a plan");
    assert_eq!(
        of_point.to_string().lines().nth(1),
        Some("type      frames")
    );
    // 1 m to the right and 2 m ahead are (2, -1) in the axes of ROS, and (1, 2) after the turn.
    gives(&of_point, &[1000.0, 2000.0, 500.0], &[11.0, 22.0, 30.5]);
    let of_pose = plan("pose").expect("a plan");
    // A turn about the axis to the right, in the axes of ROS about -y; then a quarter about z.
    let angle = 0.3_f64;
    let turn = [(angle / 2.0).sin(), 0.0, 0.0, (angle / 2.0).cos()];
    let input = [&[1000.0, 2000.0, 500.0][..], &turn].concat();
    let expected = rc_quantity::rotation::Quaternion::of_matrix(&EulerOrder::XYZ_MOVING.matrix([
        angle,
        0.0,
        std::f64::consts::FRAC_PI_2,
    ]));
    gives(
        &of_pose,
        &input,
        &[&[11.0, 22.0, 30.5][..], &expected.to_xyzw()].concat(),
    );
}

#[test]
fn each_pose_of_two_moves_by_itself() {
    let (of_pose, of_both) = (plan("pose").expect("a plan"), plan("both").expect("a plan"));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let first = [1000.0, 2000.0, 500.0, 0.0, 0.0, 0.0, 1.0];
    let second = [-4000.0, 0.0, 7000.0, half, 0.0, 0.0, half];
    let alone = [first, second].map(|pose| {
        let input: Vec<f64> = pose.into_iter().chain(transform()).collect();
        of_pose.program.run(&input).expect("values")
    });
    assert_ne!(alone[0], alone[1]);
    gives(&of_both, &[first, second].concat(), &alone.concat());
}

#[test]
fn a_covariance_of_a_part_is_refused() {
    let own = "covariance = { member covariance }";
    let sure = |frame: &str| {
        let text = text(ROS, "m", frame, "");
        let place = "units = u axes = own }\n         dproto turn";
        assert!(text.contains(place));
        library(&text.replace(
            place,
            &format!("units = u axes = own {own} }}\n         dproto turn"),
        ))
    };
    let (from, to) = (sure("lidar"), sure("map"));
    for name in ["pose", "both"] {
        let refused = rc_plans::moving((&from, name), (&to, name)).map(drop);
        let reason = refused.map_err(|refusal| refusal.to_string());
        assert!(reason.is_err_and(|reason| reason.ends_with("and no covariance")));
    }
}

#[test]
fn what_does_not_move_is_refused() {
    let expected = "no-conversion: a change of frames converts positions, orientations and poses, and no LinearVelocity";
    assert_eq!(plan("speed").map(drop), Err(expected.to_owned()));
    let expected = "no-conversion: a change of frames needs the axes of both ends, and the Position of one of them has none";
    assert_eq!(plan("bare").map(drop), Err(expected.to_owned()));
    let sure = library(&text(ROS, "m", "map", "covariance = { member covariance }"));
    let refused = rc_plans::moving((&sure, "point"), (&sure, "point"));
    assert!(refused.is_err_and(|refusal| refusal.to_string().ends_with("and no covariance")));
}
