//! A library with all coordinates, and numbers for it.

use rc_plans::Network;
use rc_prototypes::model::Library;
use rc_quantity::rotation::{EulerOrder, Quaternion, Turns};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write;

/// The prototype of rotations that samples are made of.
pub(crate) const TURN: &str = "turn";
/// That of points.
pub(crate) const POINT: &str = "point";

/// The name of the coordinates of an order: `euler_zyx_moving`.
pub(crate) fn euler(order: EulerOrder) -> String {
    format!("euler_{}", order.to_string().replace(' ', "_"))
}

fn leaf(out: &mut String, name: &str, semantic: &str, coordinate: &str, count: usize, more: &str) {
    let places: Vec<String> = (0..count).map(|at| format!("{at} = {at}")).collect();
    let places = places.join(", ");
    writeln!(
        out,
        "dproto {name} :: geometry {{ semantic = {semantic} coord = {coordinate} algebraic = v{count} \
         ddr = :: c99{{double[{count}]}} dr = {{ {places} }} {more} }}"
    )
    .expect("a text");
}

/// Prototypes of positions, rotations, poses, velocities and times.
pub(crate) fn text() -> String {
    let mut out = String::from(
        r#"import "Lidar.idsl";
axes robocomp :: right, ahead, up
axes ros :: ahead, left, up
axes innermodel :: right, up, ahead
algebraic named :: Scalar{x, y, z}
units millimetres :: qudt, v3 { 0 = mm, 1 = mm, 2 = mm }
units degrees :: qudt, v3 { 0 = deg, 1 = deg, 2 = deg }
dproto scan :: geometry { semantic = Position coord = cartesian algebraic = named ddr = :: IDSL{Lidar::Point} dr = { X = x, Y = y, Z = z } axes = robocomp }
dproto cell :: geometry { semantic = Position coord = cartesian algebraic = named ddr = :: IDSL{Lidar::Cell} dr = { X = x, Y = y, Z = z } axes = innermodel }
"#,
    );
    for count in [1, 2, 3, 4, 9, 16] {
        writeln!(out, "algebraic v{count} :: Vector{{{count}}}").expect("a text");
    }
    let mut put = |name: &str, semantic: &str, coordinate: &str, count, more: &str| {
        leaf(&mut out, name, semantic, coordinate, count, more);
    };
    put(POINT, "Position", "cartesian", 3, "axes = ros");
    put(
        "small",
        "Position",
        "cartesian",
        3,
        "units = millimetres axes = innermodel",
    );
    put("round", "Position", "spherical", 3, "axes = ros");
    put("tube", "Position", "cylindrical", 3, "axes = robocomp");
    put(TURN, "Orientation", "quaternion", 4, "axes = ros");
    put(
        "real_first",
        "Orientation",
        "quaternion_wxyz",
        4,
        "axes = robocomp",
    );
    put("matrix", "Orientation", "rot_matrix", 9, "axes = ros");
    put(
        "mirrored",
        "Orientation",
        "rot_matrix",
        9,
        "axes = innermodel",
    );
    put("rpy", "Orientation", "rpy", 3, "axes = ros");
    put(
        "rpy_degrees",
        "Orientation",
        "rpy",
        3,
        "units = degrees axes = ros",
    );
    put("axis", "Orientation", "axis_angle", 4, "axes = ros");
    put("vector", "Orientation", "rotation_vector", 3, "axes = ros");
    for order in EulerOrder::all() {
        put(&euler(order), "Orientation", &euler(order), 3, "axes = ros");
    }
    put(
        "columns",
        "Pose",
        "homogeneous_transformation",
        16,
        "axes = ros",
    );
    put(
        "rows",
        "Pose",
        "homogeneous_row_vectors",
        16,
        "axes = robocomp",
    );
    put("spin", "AngularVelocity", "cartesian", 3, "axes = ros");
    put(
        "spin_degrees",
        "AngularVelocity",
        "cartesian",
        3,
        "axes = innermodel",
    );
    put("stamp", "TimeStamp", "seconds", 1, "");
    put("parts_of_stamp", "TimeStamp", "seconds_nanoseconds", 2, "");
    out.push_str(
        "dproto pose :: geometry { semantic = Pose composes = { Position = point, Orientation = turn } }
dproto small_pose :: geometry { semantic = Pose composes = { Orientation = rpy_degrees, Position = small } }
",
    );
    out
}

/// Unit quaternions, x first: random ones, and some near each singularity of each representation.
pub(crate) fn turns() -> Vec<[f64; 4]> {
    let mut random = fastrand::Rng::with_seed(38);
    let mut angle = move || (random.f64() * 2.0 - 1.0) * PI;
    let mut all = vec![
        [0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.6, 0.8, 0.0],
    ];
    for _ in 0..12 {
        let parts = Quaternion::xyzw([angle(), angle(), angle(), angle()]);
        let norm = parts.norm();
        all.push(parts.to_xyzw().map(|part| part / norm));
    }
    for order in EulerOrder::all().filter(|order| order.turns() == Turns::Moving) {
        let name = order.to_string();
        let singular = if name.as_bytes()[0] == name.as_bytes()[2] {
            [0.0, PI]
        } else {
            [FRAC_PI_2, -FRAC_PI_2]
        };
        for middle in singular {
            for exponent in [0, -9, -16] {
                let distance = if exponent == 0 {
                    0.0
                } else {
                    10_f64.powi(exponent)
                };
                let matrix = order.matrix([angle(), middle + distance, angle()]);
                all.push(Quaternion::of_matrix(&matrix).to_xyzw());
            }
        }
    }
    all
}

/// Points: random ones, and some on the axes.
fn points() -> Vec<[f64; 3]> {
    let mut random = fastrand::Rng::with_seed(3);
    let mut number = move || (random.f64() * 2.0 - 1.0) * 8.0;
    let mut all = vec![
        [1.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [0.0, 0.0, 3.0],
        [0.0, 0.0, 0.0],
    ];
    all.extend((0..40).map(|_| [number(), number(), number()]));
    all
}

/// A prototype of each meaning from which the samples of all others are made.
pub(crate) fn source(semantic: &str) -> &'static str {
    match semantic {
        "Position" => POINT,
        "Orientation" => TURN,
        "Pose" => "pose",
        "AngularVelocity" => "spin",
        _ => "stamp",
    }
}

/// Numbers of a prototype.
pub(crate) fn samples(network: &Network<'_>, library: &Library, name: &str) -> Vec<Vec<f64>> {
    let semantic = &library.prototype(name).expect("it").semantic;
    let of_source: Vec<Vec<f64>> = match semantic.as_str() {
        "Position" | "AngularVelocity" => points().into_iter().map(Vec::from).collect(),
        "Orientation" => turns().into_iter().map(Vec::from).collect(),
        "Pose" => {
            let turns = turns().into_iter().zip(points().into_iter().cycle());
            turns
                .map(|(turn, point)| [&point[..], &turn].concat())
                .collect()
        }
        _ => [0.0, 0.25, 1.999_999_999_9, 1_786_000_000.123_456_7, -1.5]
            .map(|at| vec![at])
            .into(),
    };
    let source = source(semantic);
    if source == name {
        return of_source;
    }
    let plan = network.plan(source, name).expect("a plan");
    let converted = of_source.iter().map(|sample| plan.program.run(sample));
    converted.map(|sample| sample.expect("in range")).collect()
}
