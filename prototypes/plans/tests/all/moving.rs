//! Changes between frames that move.

use crate::functions::written;
use crate::library;
use rc_conversion::{Frame, Item, Move};
use rc_plans::{Plan, TRANSFORM};
use rc_quantity::rotation::{EulerOrder, Quaternion};
use rc_vocabulary::Primitive;
use std::fmt::Write;
use std::process::Command;

/// Prototypes of a point and a pose with these axes and unit.
fn text(axes: &str, unit: &str, frame: &str, more: &str) -> String {
    format!(
        "axes own :: {axes}
         algebraic xyz :: Scalar{{x, y, z}}
         algebraic xy :: Scalar{{x, y}}
         algebraic one :: Scalar{{distance}}
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
         dproto flat :: geometry {{ semantic = LinearVelocity coord = cartesian algebraic = xy
             ddr = :: ROS{{a/P}} dr = {{ x = x, y = y }} axes = own }}
         dproto range :: geometry {{ semantic = Range coord = distance algebraic = one
             ddr = :: ROS{{a/R}} dr = {{ range = distance }} }}
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
    let expected = Quaternion::of_matrix(&EulerOrder::XYZ_MOVING.matrix([
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

/// The covariance of a part turns as that of a value alone does.
#[test]
fn covariances_of_parts_turn() {
    let own = "covariance = { member covariance }";
    let sure = |frame: &str, axes: &str, unit: &str| {
        let text = text(axes, unit, frame, "");
        let place = "units = u axes = own }\n         dproto turn";
        assert!(text.contains(place));
        let text = text.replace(
            place,
            &format!("units = u axes = own {own} }}\n         dproto turn"),
        );
        library(&(text + &twist(own, frame)))
    };
    let (from, to) = (sure("lidar", LIDAR, "mm"), sure("map", ROS, "m"));
    let plan = |name: &str| rc_plans::moving((&from, name), (&to, name));
    let of_pose = plan("pose").expect("a plan");
    assert!(of_pose.lost.is_empty(), "{of_pose}");
    let part = ("Position".to_owned(), 9);
    assert_eq!(of_pose.covariances, [vec![part.clone()], vec![part]]);
    let pose = [1000.0, 2000.0, 500.0, 0.0, 0.0, 0.0, 1.0];
    // Of x, y and z: to the right, ahead, up.
    let spread = [4.0, 1.0, 0.0, 1.0, 9.0, 0.0, 0.0, 0.0, 16.0];
    let input = [&pose[..], &spread].concat();
    let input: Vec<f64> = input.into_iter().chain(transform()).collect();
    let found = of_pose.program.run(&input).expect("values");
    // Ahead, left, up are (y, -x, z), and after the quarter to the left (x, y, z).
    let expected = [4e-6, 1e-6, 0.0, 1e-6, 9e-6, 0.0, 0.0, 0.0, 16e-6];
    let near = found[7..].iter().zip(expected);
    assert!(
        near.clone().all(|(a, b)| (a - b).abs() < 1e-15),
        "{found:?}"
    );
    let both = plan("both").expect("a plan");
    let names = both.covariances[0].iter().map(|(part, _)| part.as_str());
    assert_eq!(
        names.collect::<Vec<_>>(),
        ["Obj1.Position", "Obj2.Position"]
    );
    // The velocity in the new frame depends on the angular one, so their errors do.
    let refused = plan("speeds").expect_err("refused").to_string();
    let reason = "and no covariance of `LinearVelocity`";
    assert!(refused.ends_with(reason), "{refused}");
}

/// A twist whose linear part has a covariance of its own.
fn twist(own: &str, frame: &str) -> String {
    let part = |name: &str, meaning: &str, more: &str| {
        format!(
            "dproto {name} :: geometry {{ semantic = {meaning} coord = cartesian algebraic = xyz
                 ddr = :: ROS{{a/P}} dr = {{ x = x, y = y, z = z }} axes = own {more} }}\n"
        )
    };
    let parts = part("speed", "LinearVelocity", own) + &part("spin", "AngularVelocity", "");
    format!(
        "{parts} dproto speeds :: geometry {{ semantic = Twist
             composes = {{ LinearVelocity = speed, AngularVelocity = spin }}
             frames = {{ with_respect_to = {frame} }} }}"
    )
}

#[test]
fn what_does_not_move_is_refused() {
    let refused = |name: &str| plan(name).map(drop).expect_err("refused");
    assert!(
        refused("range").ends_with(", and no Range"),
        "{}",
        refused("range")
    );
    let expected = "no-conversion: the first one has no value `z`";
    assert_eq!(refused("flat"), expected);
    let expected = "no-conversion: a change of frames needs the axes of both ends, and the Position of one of them has none";
    assert_eq!(refused("bare"), expected);
}

/// A meaning at one end: its name, the units of its vectors, and what its covariance says.
struct End {
    name: &'static str,
    axes: &'static str,
    units: [&'static str; 2],
    rotation: &'static str,
}

/// Prototypes of all that moves, each with a covariance.
fn all(end: &End) -> String {
    let End {
        name,
        axes,
        units: [one, other],
        rotation,
    } = end;
    let three = "algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 }";
    let leaf = |name: &str, semantic: &str, more: &str| {
        format!(
            "dproto {name} :: geometry {{ semantic = {semantic} coord = cartesian {three} axes = own {more} }}\n"
        )
    };
    let sure = "covariance = { member c }";
    let mut out = format!(
        "axes own :: {}\nalgebraic v3 :: Vector{{3}}\nalgebraic v4 :: Vector{{4}}\n\
         units one :: qudt, v3 {{ 0 = \"{one}\", 1 = \"{one}\", 2 = \"{one}\" }}\n\
         units other :: qudt, v3 {{ 0 = \"{other}\", 1 = \"{other}\", 2 = \"{other}\" }}\n",
        axes.replace(' ', ", ")
    );
    let single = |semantic: &str| leaf(name, semantic, &format!("units = one {sure}"));
    out += &match *name {
        "point" => single("Position"),
        "speed" => single("LinearVelocity"),
        "spin" => single("AngularVelocity"),
        "push" => single("Acceleration"),
        "force" => single("Force"),
        "torque" => single("Torque"),
        "twist" | "wrench" => {
            let parts = if *name == "twist" {
                ["LinearVelocity", "AngularVelocity"]
            } else {
                ["Force", "Torque"]
            };
            format!(
                "{}{}dproto {name} :: geometry {{ semantic = {} composes = {{ {} = linear, {} = angular }} {sure} }}\n",
                leaf("linear", parts[0], "units = one"),
                leaf("angular", parts[1], "units = other"),
                if *name == "twist" { "Twist" } else { "Wrench" },
                parts[0],
                parts[1],
            )
        }
        _ => format!(
            "{}dproto turn :: geometry {{ semantic = Orientation coord = quaternion algebraic = v4 \
             ddr = :: c99{{double[4]}} dr = {{ 0 = 0, 1 = 1, 2 = 2, 3 = 3 }} axes = own }}\n\
             dproto pose :: geometry {{ semantic = Pose composes = {{ Position = place, Orientation = turn }} \
             covariance = {{ member c, order = xyz_rpy, rotation = {rotation} }} }}\n",
            leaf("place", "Position", "units = one")
        ),
    };
    out
}

/// The prototype of an inertia along these axes.
fn inertia(axes: &str, mass: &str, length: &str) -> String {
    let names = ["mass", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz"];
    let pairs = names.map(|name| format!("{name} = {name}")).join(", ");
    format!(
        "axes own :: {axes}\nalgebraic ten :: Scalar{{{}}}\n\
         units u :: qudt, ten {{ mass = {mass}, x = {length}, y = {length}, z = {length}, {} }}\n\
         dproto body :: geometry {{ semantic = Inertia coord = inertia algebraic = ten \
         ddr = :: ROS{{geometry_msgs/Inertia}} dr = {{ {pairs} }} units = u axes = own }}\n",
        names.join(", "),
        ["xx", "xy", "xz", "yy", "yz", "zz"]
            .map(|name| format!("{name} = \"kg*m^2\""))
            .join(", ")
    )
}

/// The numbers of a message behind a connection.
fn in_a_message(plan: &Plan, numbers: &[f64], transform: [f64; TRANSFORM]) -> Vec<f64> {
    let places: Vec<Option<u32>> = (0..).map(Some).take(numbers.len()).collect();
    let marks = u32::try_from(numbers.len()).expect("few");
    let items = [Item::Group {
        items: vec![Item::Marked(marks, Primitive::F64)],
        formula: plan.formula((&places, &places), numbers.len(), 0),
    }];
    let change = Move {
        from: Frame::Named("lidar".to_owned()),
        to: "map".to_owned(),
        stamp: Vec::new(),
    };
    let program = rc_conversion::Program::new(&items).with_moves(&[change], &items);
    let mut bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    let ran = program.run_with(&mut bytes, 0, &[transform]);
    ran.expect("in range");
    let (numbers, _) = bytes.as_chunks::<8>();
    numbers
        .iter()
        .map(|bytes| f64::from_le_bytes(*bytes))
        .collect()
}

/// Values with their covariances, from left-handed axes in other units: as pinocchio moves them.
#[test]
fn all_that_moves_equals_pinocchio() {
    let test = "all_that_moves_equals_pinocchio";
    let Some(python) = rc_test_support::python::packages("pinocchio", "pin==4.1.0\n", test) else {
        return;
    };
    let mut random = fastrand::Rng::with_seed(38);
    let mut number = move || random.f64() * 2.0 - 1.0;
    let units = [
        ("point", ["mm", ""], ["m", ""]),
        ("speed", ["mm/s", ""], ["m/s", ""]),
        ("spin", ["deg/s", ""], ["rad/s", ""]),
        ("push", ["m/s^2", ""], ["m/s^2", ""]),
        ("force", ["kN", ""], ["N", ""]),
        ("torque", ["N*m", ""], ["N*m", ""]),
        ("twist", ["mm/s", "deg/s"], ["m/s", "rad/s"]),
        ("wrench", ["kN", "N*m"], ["N", "N*m"]),
        ("pose_fixed_fixed", ["mm", ""], ["m", ""]),
        ("pose_fixed_moving", ["mm", ""], ["m", ""]),
        ("pose_moving_fixed", ["mm", ""], ["m", ""]),
        ("pose_moving_moving", ["mm", ""], ["m", ""]),
    ];
    let (mut lines, mut count) = (String::new(), 0);
    for (kind, own, wanted) in units {
        let mut rotations = kind.split('_').skip(1);
        let mut end = |axes, units: [&'static str; 2]| End {
            name: kind.split('_').next().expect("a name"),
            axes,
            units: units.map(|unit| if unit.is_empty() { "m" } else { unit }),
            rotation: rotations.next().unwrap_or("fixed"),
        };
        let (from, to) = (end("right up ahead", own), end("right ahead up", wanted));
        let (sender, receiver) = (library(&all(&from)), library(&all(&to)));
        let plan = rc_plans::moving((&sender, from.name), (&receiver, to.name)).expect("a plan");
        assert!(plan.lost.is_empty(), "{plan}");
        for _ in 0..50 {
            let rotation = EulerOrder::RPY.matrix([3.0 * number(), 1.5 * number(), 3.0 * number()]);
            let transform = rotation.map(|[x, y, z]| [x, y, z, 5.0 * number()]).concat();
            let mut value: Vec<f64> = (0..3).map(|_| number()).collect();
            match from.name {
                "twist" | "wrench" => value.extend((0..3).map(|_| number())),
                "pose" => {
                    let angles = [3.0 * number(), 1.5 * number(), 3.0 * number()];
                    let turn = Quaternion::of_matrix(&EulerOrder::RPY.matrix(angles));
                    value.extend(turn.to_xyzw());
                }
                _ => {}
            }
            let side = if value.len() == 3 { 3 } else { 6 };
            let root: Vec<f64> = (0..side * side).map(|_| number()).collect();
            let cell = |row: usize, column: usize| -> f64 {
                let row = &root[side * row..][..side];
                row.iter()
                    .zip(&root[side * column..])
                    .map(|(a, b)| a * b)
                    .sum()
            };
            let cells = (0..side * side).map(|at| cell(at / side, at % side));
            value.extend(cells);
            let given = [&value[..], &transform].concat();
            let found = plan.program.run(&given).expect("in range");
            let transform = transform.try_into().expect("twelve");
            assert_eq!(in_a_message(&plan, &value, transform), found, "{plan}");
            let words = |end: &End| format!("{}|{}|{}", end.axes, end.units[0], end.units[1]);
            write!(lines, "{kind},{},{}", words(&from), words(&to)).expect("a text");
            for number in given[value.len()..].iter().chain(&value).chain(&found) {
                write!(lines, ",{number:e}").expect("a text");
            }
            lines.push('\n');
            count += 1;
        }
    }
    let [sender, receiver] = [
        ("right, up, ahead", "g", "mm"),
        ("right, ahead, up", "kg", "m"),
    ]
    .map(|(axes, mass, length)| library(&inertia(axes, mass, length)));
    let plan = rc_plans::moving((&sender, "body"), (&receiver, "body")).expect("a plan");
    for _ in 0..50 {
        let rotation = EulerOrder::RPY.matrix([3.0 * number(), 1.5 * number(), 3.0 * number()]);
        let transform = rotation.map(|[x, y, z]| [x, y, z, 5.0 * number()]).concat();
        // A tensor of a body: a sum of squares.
        let root: Vec<f64> = (0..9).map(|_| number()).collect();
        let cell = |(a, b): (usize, usize)| -> f64 {
            (0..3).map(|k| root[3 * a + k] * root[3 * b + k]).sum()
        };
        let mut value = vec![1000.0 * (number() + 1.5)];
        value.extend((0..3).map(|_| 1000.0 * number()));
        value.extend([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(cell));
        let given = [&value[..], &transform].concat();
        let found = plan.program.run(&given).expect("in range");
        let transform = transform.try_into().expect("twelve");
        assert_eq!(in_a_message(&plan, &value, transform), found, "{plan}");
        write!(lines, "inertia,right up ahead||,right ahead up||").expect("a text");
        for number in given[value.len()..].iter().chain(&value).chain(&found) {
            write!(lines, ",{number:e}").expect("a text");
        }
        lines.push('\n');
        count += 1;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let list = written(folder.path(), "moving.csv", &lines);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/moving.py");
    let output = Command::new(python)
        .arg(script)
        .arg(&list)
        .output()
        .expect("Python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert_eq!(
        String::from_utf8_lossy(&output.stdout).trim(),
        count.to_string()
    );
}
