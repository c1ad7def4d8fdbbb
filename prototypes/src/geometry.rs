//! The domain `geometry`: what values mean, and the coordinates that each meaning has.

use rc_quantity::rotation::EulerOrder;

/// A meaning of the domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Semantic {
    /// The name: `Position`.
    pub name: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// The unit of its cartesian coordinates, and of a distance among its coordinates.
    pub unit: &'static str,
    /// The coordinates that it has.
    pub coordinates: &'static [&'static str],
    /// The parts of a composite with their meanings.
    pub parts: &'static [(&'static str, &'static str)],
}

/// Coordinates: the values of a meaning in one representation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinate {
    /// The name: `cartesian`.
    pub name: &'static str,
    /// The convention.
    pub convention: &'static str,
    /// The values, in the order of a `Vector`, each with its unit: `None` for that of the meaning.
    pub values: &'static [(&'static str, Option<&'static str>)],
}

const SPACE: &[&str] = &["cartesian", "polar", "cylindrical", "spherical"];
const CARTESIAN: &[&str] = &["cartesian"];
const ROTATION: &[&str] = &[
    "quaternion",
    "quaternion_wxyz",
    "rot_matrix",
    "rpy",
    "axis_angle",
    "rotation_vector",
];
const HOMOGENEOUS: &[&str] = &["homogeneous_transformation", "homogeneous_row_vectors"];

const fn semantic_of(
    name: &'static str,
    meaning: &'static str,
    unit: &'static str,
    coordinates: &'static [&'static str],
) -> Semantic {
    Semantic {
        name,
        meaning,
        unit,
        coordinates,
        parts: &[],
    }
}

const fn composite(
    name: &'static str,
    meaning: &'static str,
    coordinates: &'static [&'static str],
    parts: &'static [(&'static str, &'static str)],
) -> Semantic {
    Semantic {
        name,
        meaning,
        unit: "m",
        coordinates,
        parts,
    }
}

/// The meanings of the domain `geometry`.
pub const GEOMETRY: [Semantic; 17] = [
    semantic_of("Position", "a point in a frame", "m", SPACE),
    semantic_of("Orientation", "a rotation of a frame", "1", ROTATION),
    composite(
        "Pose",
        "position and orientation of a frame",
        HOMOGENEOUS,
        &[("Position", "Position"), ("Orientation", "Orientation")],
    ),
    composite(
        "PairPose",
        "two poses",
        &[],
        &[("Obj1", "Pose"), ("Obj2", "Pose")],
    ),
    semantic_of("LinearVelocity", "velocity of a point", "m/s", CARTESIAN),
    semantic_of(
        "AngularVelocity",
        "velocity of a rotation",
        "rad/s",
        CARTESIAN,
    ),
    composite(
        "Twist",
        "velocities of a body",
        &[],
        &[
            ("LinearVelocity", "LinearVelocity"),
            ("AngularVelocity", "AngularVelocity"),
        ],
    ),
    composite(
        "KinematicState",
        "pose of a frame, and its velocities along the same axes",
        &[],
        &[
            ("Position", "Position"),
            ("Orientation", "Orientation"),
            ("LinearVelocity", "LinearVelocity"),
            ("AngularVelocity", "AngularVelocity"),
        ],
    ),
    semantic_of(
        "Acceleration",
        "acceleration of a point",
        "m/s^2",
        CARTESIAN,
    ),
    semantic_of("Force", "a force", "N", CARTESIAN),
    semantic_of("Torque", "a torque", "N*m", CARTESIAN),
    composite(
        "Wrench",
        "force and torque on a body",
        &[],
        &[("Force", "Force"), ("Torque", "Torque")],
    ),
    semantic_of(
        "Inertia",
        "mass, centre of mass, and tensor about it, of a body",
        "kg",
        &["inertia"],
    ),
    semantic_of("JointState", "state of a revolute joint", "rad", &["joint"]),
    semantic_of("Range", "a distance that was measured", "m", &["distance"]),
    semantic_of(
        "PointSet",
        "points in a frame; needs `sequence`",
        "m",
        SPACE,
    ),
    semantic_of(
        "TimeStamp",
        "a time since 1970",
        "s",
        &["seconds", "seconds_nanoseconds"],
    ),
];

const ANGLE: Option<&str> = Some("rad");
const PURE: Option<&str> = Some("1");
const TENSOR: Option<&str> = Some("kg*m^2");

/// The coordinates, without the 24 Euler orders: see [`coordinate`].
pub const COORDINATES: [Coordinate; 17] = [
    coordinate_of(
        "cartesian",
        "along the axes",
        &[("x", None), ("y", None), ("z", None)],
    ),
    coordinate_of(
        "polar",
        "in the plane of x and y; the angle counts from x to y",
        &[("distance", None), ("angle", ANGLE)],
    ),
    coordinate_of(
        "cylindrical",
        "polar, and z",
        &[("distance", None), ("angle", ANGLE), ("z", None)],
    ),
    coordinate_of(
        "spherical",
        "the azimuth counts from x to y, the elevation from their plane to z",
        &[("distance", None), ("azimuth", ANGLE), ("elevation", ANGLE)],
    ),
    coordinate_of(
        "quaternion",
        "Hamilton's, the real part last, as in messages of ROS",
        &[("x", PURE), ("y", PURE), ("z", PURE), ("w", PURE)],
    ),
    coordinate_of(
        "quaternion_wxyz",
        "Hamilton's, the real part first",
        &[("w", PURE), ("x", PURE), ("y", PURE), ("z", PURE)],
    ),
    coordinate_of(
        "rot_matrix",
        "one row after the other, for column vectors",
        &MATRIX,
    ),
    coordinate_of(
        "rpy",
        "roll, pitch, yaw: turns about the fixed axes x, y, z",
        &ANGLES,
    ),
    coordinate_of(
        "axis_angle",
        "an axis of length 1, and an angle",
        &[("x", PURE), ("y", PURE), ("z", PURE), ("angle", ANGLE)],
    ),
    coordinate_of(
        "rotation_vector",
        "the axis, as long as the angle",
        &[("x", ANGLE), ("y", ANGLE), ("z", ANGLE)],
    ),
    coordinate_of(
        "homogeneous_transformation",
        "a matrix for column vectors: the translation is in the last column",
        &HOMOGENEOUS_COLUMN,
    ),
    coordinate_of(
        "homogeneous_row_vectors",
        "a matrix for row vectors: the translation is in the last row",
        &HOMOGENEOUS_ROW,
    ),
    coordinate_of(
        "inertia",
        "the mass, the centre of mass along the axes, and the tensor about it",
        &[
            ("mass", Some("kg")),
            ("x", Some("m")),
            ("y", Some("m")),
            ("z", Some("m")),
            ("xx", TENSOR),
            ("xy", TENSOR),
            ("xz", TENSOR),
            ("yy", TENSOR),
            ("yz", TENSOR),
            ("zz", TENSOR),
        ],
    ),
    coordinate_of("distance", "a number", &[("distance", None)]),
    coordinate_of("seconds", "a number", &[("seconds", Some("s"))]),
    coordinate_of(
        "seconds_nanoseconds",
        "whole seconds, and the nanoseconds after them",
        &[("seconds", Some("s")), ("nanoseconds", Some("ns"))],
    ),
    coordinate_of(
        "joint",
        "angle, velocity and torque",
        &[
            ("position", ANGLE),
            ("velocity", Some("rad/s")),
            ("effort", Some("N*m")),
        ],
    ),
];

const ANGLES: [(&str, Option<&str>); 3] = [("roll", ANGLE), ("pitch", ANGLE), ("yaw", ANGLE)];
const MATRIX: [(&str, Option<&str>); 9] = [("", PURE); 9];
const HOMOGENEOUS_COLUMN: [(&str, Option<&str>); 16] = homogeneous([3, 7, 11]);
const HOMOGENEOUS_ROW: [(&str, Option<&str>); 16] = homogeneous([12, 13, 14]);

const fn homogeneous(lengths: [usize; 3]) -> [(&'static str, Option<&'static str>); 16] {
    let mut values = [("", PURE); 16];
    let mut at = 0;
    while at < 3 {
        values[lengths[at]].1 = None;
        at += 1;
    }
    values
}

const fn coordinate_of(
    name: &'static str,
    convention: &'static str,
    values: &'static [(&'static str, Option<&'static str>)],
) -> Coordinate {
    Coordinate {
        name,
        convention,
        values,
    }
}

const EULER: Coordinate = coordinate_of(
    "euler_ORDER",
    "three turns about fixed or moving axes, as in `euler_zyx_moving`",
    &[("first", ANGLE), ("second", ANGLE), ("third", ANGLE)],
);

/// The meaning with this name.
pub fn semantic(name: &str) -> Option<&'static Semantic> {
    GEOMETRY.iter().find(|semantic| semantic.name == name)
}

/// The coordinates with this name. All 24 Euler orders have a name, as `euler_zyx_moving`.
pub fn coordinate(name: &str) -> Option<Coordinate> {
    if let Some(order) = name.strip_prefix("euler_") {
        let (axes, turns) = order.split_once('_')?;
        let order: Result<EulerOrder, _> = format!("{axes} {turns}").parse();
        return order.ok().map(|_| EULER);
    }
    COORDINATES.into_iter().find(|known| known.name == name)
}

impl Semantic {
    /// Whether it has these coordinates.
    pub fn has(&self, coordinate: &str) -> bool {
        self.coordinates.contains(&coordinate)
            || self.coordinates == ROTATION && self::coordinate(coordinate) == Some(EULER)
    }

    /// The names of its coordinates. The Euler orders are one of them.
    pub fn coordinate_names(&self) -> impl Iterator<Item = &'static str> {
        let euler = (self.coordinates == ROTATION).then_some(EULER.name);
        self.coordinates.iter().copied().chain(euler)
    }
}

/// The domain as a text: each meaning with its parts and coordinates, then each coordinate with its
/// convention.
pub fn listing() -> String {
    let mut out = String::from("geometry\n");
    for semantic in &GEOMETRY {
        let parts: Vec<&str> = semantic.parts.iter().map(|(name, _)| *name).collect();
        let mut line = format!("    {:16} {}", semantic.name, semantic.meaning);
        if !parts.is_empty() {
            line += &format!("; composes {}", parts.join(", "));
        }
        let coordinates: Vec<&str> = semantic.coordinate_names().collect();
        if !coordinates.is_empty() {
            line += &format!("; coord {}", coordinates.join(", "));
        }
        out += &line;
        out.push('\n');
    }
    out += "coordinates\n";
    for coordinate in COORDINATES.iter().chain([&EULER]) {
        let names: Vec<&str> = coordinate.values.iter().map(|(name, _)| *name).collect();
        let values = if names.first() == Some(&"") {
            format!("{} numbers", names.len())
        } else {
            names.join(", ")
        };
        out += &format!(
            "    {:27} {values}: {}\n",
            coordinate.name, coordinate.convention
        );
    }
    out
}
