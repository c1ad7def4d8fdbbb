//! Rotations of bodies whose axes are others than those around them.

use crate::library;
use rc_plans::Network;
use rc_prototypes::model::Library;

/// A robot's pose with a heading from x, which points to the right, and poses as ROS has them.
fn text() -> String {
    let part = |name: &str, meaning: &str, coord: &str, more: &str| {
        format!(
            "dproto {name} :: geometry {{ semantic = {meaning} coord = {coord} algebraic = v3
                 ddr = :: c99{{double[3]}} dr = {{ 0 = 0, 1 = 1, 2 = 2 }} {more} }}\n"
        )
    };
    let whole = |name: &str, parts: [&str; 4], more: &str| {
        let [place, turn, speed, spin] = parts;
        format!(
            "dproto {name} :: geometry {{ semantic = KinematicState
                 composes = {{ Position = {place}, Orientation = {turn}, LinearVelocity = {speed}, AngularVelocity = {spin} }}
                 {more} }}\n"
        )
    };
    let sure = |name: &str, axes: &str, rotation: &str| {
        format!(
            "dproto {name} :: geometry {{ semantic = Orientation coord = quaternion algebraic = v4
                 ddr = :: c99{{double[4]}} dr = {{ 0 = 0, 1 = 1, 2 = 2, 3 = 3 }} {axes}
                 covariance = {{ member c, rotation = {rotation} }} }}\n"
        )
    };
    let around = "axes = robocomp body = ros";
    [
        "axes ros :: ahead, left, up
         axes robocomp :: right, ahead, up
         axes innermodel :: right, up, ahead
         algebraic v3 :: Vector{3}
         algebraic v4 :: Vector{4}
         units millimetres :: qudt, v3 { 0 = mm, 1 = mm, 2 = mm }\n"
            .to_owned(),
        part("small", "Position", "cartesian", "units = millimetres"),
        part("place", "Position", "cartesian", ""),
        part("angles", "Orientation", "rpy", ""),
        part("speed", "LinearVelocity", "cartesian", ""),
        part("spin", "AngularVelocity", "cartesian", ""),
        "dproto turn :: geometry { semantic = Orientation coord = quaternion algebraic = v4
             ddr = :: c99{double[4]} dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3 } }\n"
            .to_owned(),
        whole("robot", ["small", "angles", "speed", "spin"], around),
        whole("odometry", ["place", "turn", "speed", "spin"], "axes = ros"),
        whole(
            "tree",
            ["small", "angles", "speed", "spin"],
            "axes = innermodel",
        ),
        sure("fixed", around, "fixed"),
        sure("moving", around, "moving"),
        sure("ros_fixed", "axes = ros", "fixed"),
        sure("ros_moving", "axes = ros", "moving"),
    ]
    .concat()
}

fn run(library: &Library, from: &str, to: &str, values: &[f64]) -> Vec<f64> {
    let plan = Network::new(library).plan(from, to).expect("a plan");
    plan.program.run(values).expect("values")
}

#[track_caller]
fn near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    let mut both = found.iter().zip(expected);
    let is_near = both.all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(is_near, "{found:?} {expected:?}");
}

/// A heading of 0 is along x, which is to the right: in the axes of ROS, a quarter to the right.
#[test]
fn a_heading_may_count_from_another_axis() {
    let library = library(&text());
    let (sin, cos) = std::f64::consts::FRAC_PI_4.sin_cos();
    let right = [
        1000.0, 2000.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.25, 0.0, 0.0, 0.0, 0.1,
    ];
    let found = run(&library, "robot", "odometry", &right);
    let expected = [
        2.0, -1.0, 0.0, 0.0, 0.0, -sin, cos, 0.25, -0.5, 0.0, 0.0, 0.0, 0.1,
    ];
    near(&found, &expected);
    near(&run(&library, "odometry", "robot", &found), &right);
    // Ahead, the heading is a quarter, and the rotation none.
    let mut ahead = right;
    ahead[5] = std::f64::consts::FRAC_PI_2;
    let found = run(&library, "robot", "odometry", &ahead);
    near(&found[3..7], &[0.0, 0.0, 0.0, 1.0]);
    // In a left-handed tree, a turn to the left is one about y, and negative.
    let mut left = ahead;
    left[5] += 0.3;
    let in_tree = run(&library, "robot", "tree", &left);
    near(&in_tree[..6], &[1000.0, 0.0, 2000.0, 0.0, -0.3, 0.0]);
    near(&run(&library, "tree", "robot", &in_tree), &left);
}

/// A covariance about the moving axes is along those of the body, one about the fixed axes along
/// those around it.
#[test]
fn a_covariance_is_along_the_axes_that_it_is_about() {
    let library = library(&text());
    let (sin, cos) = std::f64::consts::FRAC_PI_4.sin_cos();
    // The body looks ahead: about x, y and z, which are the roll, the pitch and the yaw of the body.
    let ahead = [0.0, 0.0, sin, cos];
    let of = |a: f64, b: f64, c: f64| [a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c];
    let given = [&ahead[..], &of(1.0, 4.0, 9.0)].concat();
    let moving = run(&library, "moving", "ros_moving", &given);
    near(
        &moving,
        &[&[0.0, 0.0, 0.0, 1.0][..], &of(1.0, 4.0, 9.0)].concat(),
    );
    // About the fixed axes, x is to the right: a pitch.
    let fixed = run(&library, "fixed", "ros_fixed", &given);
    near(
        &fixed,
        &[&[0.0, 0.0, 0.0, 1.0][..], &of(4.0, 1.0, 9.0)].concat(),
    );
    near(&run(&library, "fixed", "ros_moving", &given), &fixed);
    near(&run(&library, "moving", "ros_fixed", &given), &moving);
    let back = run(&library, "ros_moving", "fixed", &moving);
    near(&back, &[&ahead[..], &of(4.0, 1.0, 9.0)].concat());
}

/// The velocity of a point that moves with its body has no part from the origin of another frame.
#[test]
fn velocities_beside_a_position_are_those_of_the_point() {
    let own = |frame: &str| {
        let text = text().replace(
            "axes = ros }",
            &format!("axes = ros frames = {{ with_respect_to = {frame} }} }}"),
        );
        library(&text)
    };
    let (from, to) = (own("odom"), own("map"));
    let plan = rc_plans::moving((&from, "odometry"), (&to, "odometry")).expect("a plan");
    let state = [
        1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.25, 0.0, 0.0, 0.0, 0.1,
    ];
    // A quarter to the left, and a translation.
    let transform = [
        0.0, -1.0, 0.0, 10.0, 1.0, 0.0, 0.0, 20.0, 0.0, 0.0, 1.0, 30.0,
    ];
    let found = plan.program.run(&[&state[..], &transform].concat());
    let (sin, cos) = std::f64::consts::FRAC_PI_4.sin_cos();
    let expected = [
        8.0, 21.0, 33.0, 0.0, 0.0, sin, cos, -0.25, 0.5, 0.0, 0.0, 0.0, 0.1,
    ];
    near(&found.expect("values"), &expected);
}
