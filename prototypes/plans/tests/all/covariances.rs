//! Covariances beside those of samples.

use crate::{library, samples::TURN};
use rc_plans::{Network, Program};
use rc_prototypes::model::Library;
use rc_quantity::rotation::{
    EulerOrder, Matrix, Quaternion, from_rotation_vector, product, to_rotation_vector, transposed,
};

/// Poses, twists and points with covariances, in units and axes of several kinds.
fn text() -> String {
    let mut out = String::from(
        r#"
axes ros :: ahead, left, up
axes robocomp :: right, ahead, up
axes innermodel :: right, up, ahead
algebraic v3 :: Vector{3}
algebraic v4 :: Vector{4}
algebraic v9 :: Vector{9}
algebraic v16 :: Vector{16}
units millimetres :: qudt, v3 { 0 = mm, 1 = mm, 2 = mm }
units degrees :: qudt, v3 { 0 = deg, 1 = deg, 2 = deg }
units turns :: qudt, v3 { 0 = "deg/s", 1 = "deg/s", 2 = "deg/s" }
"#,
    );
    let three = "algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 }";
    let leaves = [
        ("point", "Position", "cartesian", ""),
        ("small", "Position", "cartesian", "units = millimetres"),
        ("round", "Position", "spherical", ""),
        ("rpy", "Orientation", "rpy", "units = degrees"),
        ("flow", "LinearVelocity", "cartesian", ""),
        ("spin", "AngularVelocity", "cartesian", ""),
        ("degrees", "AngularVelocity", "cartesian", "units = turns"),
    ];
    for (name, semantic, coordinate, more) in leaves {
        out += &format!(
            "dproto {name} :: geometry {{ semantic = {semantic} coord = {coordinate} {three} {more} }}\n"
        );
        let axes = if name == "small" { "innermodel" } else { "ros" };
        if semantic == "Position" {
            out += &format!(
                "dproto {name}_spread :: geometry {{ semantic = Position coord = {coordinate} {three} {more} \
                 axes = {axes} covariance = {{ member c }} }}\n"
            );
        }
    }
    out += &format!(
        "dproto {TURN} :: geometry {{ semantic = Orientation coord = quaternion algebraic = v4 \
         ddr = :: c99{{double[4]}} dr = {{ 0 = 0, 1 = 1, 2 = 2, 3 = 3 }} }}\n"
    );
    let places: Vec<String> = (0..16).map(|at| format!("{at} = {at}")).collect();
    out += &format!(
        "dproto matrix :: geometry {{ semantic = Pose coord = homogeneous_transformation algebraic = v16 \
         ddr = :: c99{{double[16]}} dr = {{ {} }} axes = ros covariance = {{ member c, order = rpy_xyz }} }}\n",
        places.join(", ")
    );
    let composites = [
        (
            "fixed",
            "Position = point, Orientation = turn",
            "ros",
            "order = xyz_rpy, rotation = fixed",
        ),
        (
            "moving",
            "Position = point, Orientation = turn",
            "ros",
            "rotation = moving",
        ),
        (
            "turned",
            "Orientation = rpy, Position = small",
            "innermodel",
            "order = rpy_xyz, rotation = moving",
        ),
        (
            "other",
            "Position = small, Orientation = turn",
            "robocomp",
            "order = rpy_xyz, rotation = fixed",
        ),
    ];
    for (name, parts, axes, says) in composites {
        out += &format!(
            "dproto {name} :: geometry {{ semantic = Pose composes = {{ {parts} }} axes = {axes} \
             covariance = {{ member c, {says} }} }}\n"
        );
    }
    for (name, spin, axes) in [
        ("twist", "spin", "ros"),
        ("twist_degrees", "degrees", "innermodel"),
    ] {
        out += &format!(
            "dproto {name} :: geometry {{ semantic = Twist composes = {{ AngularVelocity = {spin}, \
             LinearVelocity = flow }} axes = {axes} covariance = {{ member c }} }}\n"
        );
    }
    out
}

/// Small errors about a value: three or six numbers, as the covariance of a prototype counts them.
struct Kind {
    /// The prototype without its covariance has these numbers for a value and an error.
    value: fn(&[f64], &[f64]) -> Vec<f64>,
    /// The error of a value about another one.
    error: fn(&[f64], &[f64]) -> Vec<f64>,
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn quaternion(numbers: &[f64]) -> Matrix {
    Quaternion::xyzw([numbers[0], numbers[1], numbers[2], numbers[3]]).matrix()
}

fn rpy(numbers: &[f64]) -> Matrix {
    let turns = [numbers[0], numbers[1], numbers[2]].map(f64::to_radians);
    EulerOrder::RPY.matrix(turns)
}

fn three(numbers: &[f64]) -> [f64; 3] {
    [numbers[0], numbers[1], numbers[2]]
}

fn fixed_turn(from: &Matrix, to: &Matrix) -> Vec<f64> {
    to_rotation_vector(&product(to, &transposed(from))).to_vec()
}

fn moving_turn(from: &Matrix, to: &Matrix) -> Vec<f64> {
    to_rotation_vector(&product(&transposed(from), to)).to_vec()
}

fn of(name: &str) -> Kind {
    match name {
        "fixed" | "other" => Kind {
            value: |at, error| {
                let matrix = product(
                    &from_rotation_vector(three(&error[3..])),
                    &quaternion(&at[3..]),
                );
                let turn = Quaternion::of_matrix(&matrix).to_xyzw();
                [&sum(&at[..3], &error[..3])[..], &turn].concat()
            },
            error: |at, value| {
                let turn = fixed_turn(&quaternion(&at[3..]), &quaternion(&value[3..]));
                [difference(&value[..3], &at[..3]), turn].concat()
            },
        },
        "moving" => Kind {
            value: |at, error| {
                let matrix = product(
                    &quaternion(&at[3..]),
                    &from_rotation_vector(three(&error[3..])),
                );
                let turn = Quaternion::of_matrix(&matrix).to_xyzw();
                [&sum(&at[..3], &error[..3])[..], &turn].concat()
            },
            error: |at, value| {
                let turn = moving_turn(&quaternion(&at[3..]), &quaternion(&value[3..]));
                [difference(&value[..3], &at[..3]), turn].concat()
            },
        },
        // Roll, pitch and yaw in degrees come first.
        "turned" => Kind {
            value: |_, _| unreachable!("no source"),
            error: |at, value| {
                let turn = moving_turn(&rpy(at), &rpy(value));
                [difference(&value[3..], &at[3..]), turn].concat()
            },
        },
        "matrix" => Kind {
            value: |_, _| unreachable!("no source"),
            error: |at, value| {
                let matrix = |of: &[f64]| [0, 4, 8].map(|row| three(&of[row..]));
                let place = |of: &[f64]| [of[3], of[7], of[11]];
                let turn = fixed_turn(&matrix(at), &matrix(value));
                [difference(&place(value), &place(at)), turn].concat()
            },
        },
        // The angular velocity comes first.
        "twist" | "twist_degrees" => Kind {
            value: |at, error| [sum(&at[..3], &error[3..]), sum(&at[3..], &error[..3])].concat(),
            error: |at, value| {
                let all = difference(value, at);
                [&all[3..], &all[..3]].concat()
            },
        },
        "round_spread" => Kind {
            value: |_, _| unreachable!("no source"),
            error: |at, value| {
                let place = |of: &[f64]| {
                    let flat = of[0] * of[2].cos();
                    [flat * of[1].cos(), flat * of[1].sin(), of[0] * of[2].sin()]
                };
                difference(&place(value), &place(at))
            },
        },
        _ => Kind {
            value: sum,
            error: difference,
        },
    }
}

/// The order in the message: `rpy_xyz` has the turns first.
fn ordered(library: &Library, name: &str, error: Vec<f64>) -> Vec<f64> {
    let covariance = library
        .prototype(name)
        .and_then(|of| of.covariance.as_ref());
    let order = covariance.and_then(|of| of.order.as_deref());
    match order {
        Some("rpy_xyz") => [&error[3..], &error[..3]].concat(),
        _ => error,
    }
}

fn moments(errors: &[Vec<f64>]) -> Vec<f64> {
    let side = errors[0].len();
    let mut out = vec![0.0; side * side];
    for error in errors {
        for row in 0..side {
            for column in 0..side {
                out[side * row + column] += error[row] * error[column];
            }
        }
    }
    out.iter().map(|sum| sum / errors.len() as f64).collect()
}

/// The plan for values alone takes the first numbers of the one with covariances, which it computes
/// in the same way.
fn value_of(program: &Program, value: &[f64], spread: &[f64], length: usize) -> Vec<f64> {
    let mut all = program.run(&[value, spread].concat()).expect("in range");
    all.truncate(length);
    all
}

/// The covariance of samples is that of the plan. The covariance of the input is that of the same
/// samples, so that only the part that is not linear is left.
#[test]
fn covariances_are_those_of_samples() {
    let library = library(&text());
    let network = Network::new(&library);
    let mut random = fastrand::Rng::with_seed(38);
    let mut number = move || random.f64() * 2.0 - 1.0;
    let pairs = [
        ("fixed", "moving"),
        ("fixed", "turned"),
        ("fixed", "other"),
        ("fixed", "matrix"),
        ("moving", "fixed"),
        ("moving", "turned"),
        ("moving", "other"),
        ("other", "turned"),
        ("other", "moving"),
        ("twist", "twist_degrees"),
        ("point_spread", "small_spread"),
        ("point_spread", "round_spread"),
        ("small_spread", "round_spread"),
    ];
    for (from, to) in pairs {
        let (source, target) = (of(from), of(to));
        let plan = network.plan(from, to).expect("a plan");
        assert!(plan.lost.is_empty(), "{plan}");
        let at: Vec<f64> = match from {
            "twist" => vec![0.3, -0.7, 1.2, 2.0, -1.0, 0.4],
            "point_spread" | "small_spread" => vec![3.0, -2.0, 1.0],
            _ => vec![3.0, -2.0, 1.0, 0.1, 0.5, -0.7, 0.5],
        };
        let side = if at.len() == 3 { 3 } else { 6 };
        let mixed: Vec<f64> = (0..side * side).map(|_| number() * 1e-4).collect();
        let errors: Vec<Vec<f64>> = (0..500)
            .map(|_| {
                let raw: Vec<f64> = (0..side).map(|_| number()).collect();
                let rows = mixed.chunks(side);
                rows.map(|row| row.iter().zip(&raw).map(|(a, b)| a * b).sum())
                    .collect()
            })
            .collect();
        let own: Vec<Vec<f64>> = errors
            .iter()
            .map(|error| ordered(&library, from, error.clone()))
            .collect();
        let spread = moments(&own);
        let length = plan.program.outputs() - side * side;
        let middle = value_of(&plan.program, &at, &spread, length);
        let theirs: Vec<Vec<f64>> = errors
            .iter()
            .map(|error| {
                let value = (source.value)(&at, error);
                let value = value_of(&plan.program, &value, &spread, length);
                ordered(&library, to, (target.error)(&middle, &value))
            })
            .collect();
        let wanted = moments(&theirs);
        let found = plan
            .program
            .run(&[&at[..], &spread].concat())
            .expect("in range");
        let found = &found[length..];
        for row in 0..side {
            for column in 0..side {
                let place = side * row + column;
                let size = (wanted[side * row + row] * wanted[side * column + column]).sqrt();
                let error = (found[place] - wanted[place]).abs();
                assert!(
                    error < 1e-3 * size,
                    "{from} to {to}, {row}, {column}: {} for {}",
                    found[place],
                    wanted[place]
                );
            }
        }
    }
}

/// Changes of axes and units alone turn the matrix, whatever the value is.
#[test]
fn a_covariance_in_other_axes_moves_its_numbers() {
    let library = library(&text());
    let network = Network::new(&library);
    let plan = network
        .plan("point_spread", "small_spread")
        .expect("a plan");
    let spread = [4.0, 0.5, 0.25, 0.5, 9.0, -2.0, 0.25, -2.0, 16.0];
    let found = plan.program.run(&[&[1.0, 2.0, 3.0][..], &spread].concat());
    let found = found.expect("in range");
    // ahead, left, up becomes right, up, ahead: x' = -y, y' = z, z' = x, in millimetres.
    let wanted = [9.0, 2.0, -0.5, 2.0, 16.0, 0.25, -0.5, 0.25, 4.0].map(|value| value * 1e6);
    assert_eq!(found[..3], [-2000.0, 3000.0, 1000.0]);
    assert_eq!(found[3..], wanted);
}

/// Symmetric, and no variance below 0 in any direction.
#[test]
fn what_is_no_covariance_is_refused() {
    let library = library(&text());
    let network = Network::new(&library);
    let plan = network
        .plan("point_spread", "small_spread")
        .expect("a plan");
    let run = |spread: [f64; 9]| {
        plan.program
            .run(&[&[1.0, 2.0, 3.0][..], &spread].concat())
            .map(drop)
    };
    let of = |pairs: [f64; 3]| {
        let [a, b, c] = pairs;
        [1.0, a, b, a, 1.0, c, b, c, 1.0]
    };
    let line = [1.0, -2.0, 1e-9];
    let rank_one = [0, 1, 2].map(|row| [0, 1, 2].map(|column| line[row] * line[column]));
    let single = |value: f64| f64::from(value as f32);
    for fine in [
        [0.0; 9],
        of([0.9, 0.9, 0.9]),
        of([1.0, 1.0, 1.0]),
        of([1.0, -1.0, -1.0]),
        [4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-12],
        rank_one.concat().try_into().expect("nine"),
        rank_one
            .concat()
            .iter()
            .map(|of| single(of * 0.1))
            .collect::<Vec<_>>()
            .try_into()
            .expect("nine"),
    ] {
        assert_eq!(run(fine), Ok(()), "{fine:?}");
    }
    let asymmetric = [1.0, 0.5, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0, 1.0];
    for wrong in [
        // The unknown covariance of some messages of ROS.
        [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1e-12],
        of([1.1, 0.0, 0.0]),
        of([0.0, 0.0, -1.1]),
        // All pairs may be so, all three may not.
        of([0.9, 0.9, -0.9]),
        [0.0, 0.1, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 1.0],
        asymmetric,
        [f64::NAN; 9],
        of([f64::NAN, 0.0, 0.0]),
    ] {
        assert!(run(wrong).is_err(), "{wrong:?}");
    }
    let said = |spread| run(spread).expect_err("it is none").to_string();
    assert_eq!(
        said([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        "the covariance is not symmetric or not positive: -1.00001 is not at least 0"
    );
    let uncertain = said([0.0, 0.1, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 1.0]);
    assert!(uncertain.ends_with(" is not 0"), "{uncertain}");
}

/// A covariance at one end only is lost, and the plan says so.
#[test]
fn a_covariance_without_a_counterpart_is_lost() {
    let library = library(&text());
    let network = Network::new(&library);
    for (from, to) in [("point_spread", "small"), ("point", "small_spread")] {
        let plan = network.plan(from, to).expect("a plan");
        let lost: Vec<String> = plan.lost.iter().map(ToString::to_string).collect();
        assert_eq!(lost, ["the covariance is not converted, not bounded"]);
    }
}
