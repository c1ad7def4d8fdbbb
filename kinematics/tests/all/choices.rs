//! Choices of printed code: units, axes, layouts and types change its numbers, not what they mean.

use crate::printed::{compiled, printed};
use crate::{ARM, load_beside};
use rc_kinematics::Cell;
use rc_quantity::Axes;
use rc_quantity::rotation::{Matrix, product, transposed, turned};
use rc_robot::State;
use std::process::Command;

const SIX: &str = include_str!("../../examples/six.urdf");

fn cell_of(choices: &str, solvers: &str) -> Cell {
    let text = format!("import \"arm.urdf\"; Kinematics cell {{ {choices} {solvers} }};");
    let (cell, found) = load_beside(&text, &[("arm.urdf", ARM)]);
    assert_eq!(found, "");
    cell.expect("a cell")
}

/// The second joint slides.
const STATE: [[f64; 3]; 3] = [[0.3, 0.2, -0.7], [0.4, -0.1, 0.9], [-0.3, 0.6, 0.2]];

fn run(cell: &Cell, metre: f64) -> Vec<f64> {
    let scaled = |of: [f64; 3]| vec![of[0], of[1] * metre, of[2]];
    let [positions, velocities, accelerations] = STATE.map(scaled);
    let state = State {
        positions,
        velocities,
        accelerations,
    };
    let efforts = [1.0, 2.0, 3.0];
    cell.solvers[0]
        .run(&state, &efforts, &[])
        .expect("its joints")
}

fn near(found: &[f64], wanted: &[f64]) {
    assert_eq!(found.len(), wanted.len());
    for (one, other) in found.iter().zip(wanted) {
        let is_near = (one - other).abs() < 1e-11 * (1.0 + other.abs());
        assert!(is_near, "{found:?} {wanted:?}");
    }
}

const MOTIONS: &str = "solver fk { pose wrist in base; jacobian wrist in base; velocity wrist in base; \
    acceleration wrist in base expressed in wrist; };";

#[test]
fn lengths_in_millimetres_are_a_thousand_times_those_in_metres() {
    let (metres, millimetres) = (cell_of("", MOTIONS), cell_of("lengths mm;", MOTIONS));
    let mut wanted = run(&metres, 1.0);
    for place in [3, 7, 11] {
        wanted[place] *= 1e3;
    }
    for row in 0..6 {
        for (column, share) in [1.0, 1e-3, 1.0].into_iter().enumerate() {
            wanted[16 + 3 * row + column] *= if row < 3 { 1e3 * share } else { share };
        }
    }
    for place in (34..37).chain(40..43) {
        wanted[place] *= 1e3;
    }
    near(&run(&millimetres, 1e3), &wanted);
    let limits = |cell: &Cell| cell.robot.limits()[1].expect("limits").upper;
    assert_eq!(limits(&millimetres), 1e3 * limits(&metres));
    assert_eq!(
        millimetres.robot.limits()[0].expect("limits").upper,
        metres.robot.limits()[0].expect("limits").upper
    );
    let text = rc_kinematics::rust(&millimetres);
    assert!(text.contains("of joints that slide in mm.") && text.contains("in mm/s²"));
}

/// An inverse solver finds positions for a pose in millimetres, by columns, along other axes.
#[test]
fn inverse_solvers_have_the_choices_of_their_file() {
    let of = |choices: &str| {
        let text = format!(
            "import \"six.urdf\"; Kinematics cell {{ {choices} solver fk {{ pose tool in base; }};
            solver reach {{ inverse pose tool in base; within limits; tolerance 1e-6 m 1e-6 rad; }}; }};"
        );
        let (cell, found) = load_beside(&text, &[("six.urdf", SIX)]);
        assert_eq!(found, "");
        cell.expect("a cell")
    };
    let positions = vec![0.3, -1.1, 0.9, 0.4, 0.7, -0.2];
    let state = State::still(positions.clone());
    let mut answers = Vec::new();
    for choices in ["", "lengths mm;", "frames innermodel; lengths mm;"] {
        let cell = of(choices);
        let pose = cell.solvers[0].run(&state, &[0.0; 6], &[]).expect("a pose");
        let target: [[f64; 4]; 4] =
            std::array::from_fn(|row| std::array::from_fn(|column| pose[4 * row + column]));
        let (found, search) = cell.inverses[0]
            .positions(&target, &[0.2, -1.0, 1.0, 0.3, 0.6, 0.0])
            .expect("an answer");
        assert!(search.reached, "{choices}");
        near_by(&found, &positions, 1e-5);
        answers.push(search.iterations);
    }
    // The closed form is found with each of them.
    assert_eq!(answers, [1, 1, 1]);
}

fn near_by(found: &[f64], wanted: &[f64], most: f64) {
    for (one, other) in found.iter().zip(wanted) {
        assert!((one - other).abs() < most, "{found:?} {wanted:?}");
    }
}

#[test]
fn frames_have_other_axes_and_joints_the_same_positions() {
    let solvers = "solver fk { pose wrist in base; velocity wrist in base; efforts; accelerations; mass_matrix; gravity 1, 2, -9; };";
    let ros = run(&cell_of("", solvers), 1.0);
    for (word, axes) in [
        ("ros", Axes::ROS),
        ("ros_optical", Axes::ROS_OPTICAL),
        ("robocomp", Axes::ROBOCOMP),
        ("innermodel", Axes::INNER_MODEL),
    ] {
        let own = run(&cell_of(&format!("frames {word};"), solvers), 1.0);
        let (turn, axial) = (Axes::ROS.matrix_to(axes), Axes::ROS.axial_matrix_to(axes));
        let mut wanted = ros.clone();
        let rotation: Matrix =
            std::array::from_fn(|row| std::array::from_fn(|column| ros[4 * row + column]));
        let rotation = product(&product(&turn, &rotation), &transposed(&turn));
        let place = turned(&turn, [ros[3], ros[7], ros[11]]);
        for row in 0..3 {
            wanted[4 * row..4 * row + 3].copy_from_slice(&rotation[row]);
            wanted[4 * row + 3] = place[row];
        }
        let linear = turned(&turn, [ros[16], ros[17], ros[18]]);
        let angular = turned(&axial, [ros[19], ros[20], ros[21]]);
        wanted[16..19].copy_from_slice(&linear);
        wanted[19..22].copy_from_slice(&angular);
        // Efforts, accelerations and masses of joints are the same.
        near(&own, &wanted);
    }
}

/// Printed C and Rust have columns as rows, and numbers of 32 bits near those of 64.
#[test]
fn layouts_and_types_of_printed_code() {
    let solvers = "solver fk { pose wrist in base; jacobian wrist in base; efforts; };";
    let wide = cell_of("", solvers);
    let mut narrow = cell_of("scalars f32; matrices column_major;", solvers);
    narrow.name = "narrow".to_owned();
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("cell.h"), rc_kinematics::c(&wide)).expect("a file");
    std::fs::write(at("narrow.h"), rc_kinematics::c(&narrow)).expect("a file");
    std::fs::write(at("narrow.rs"), rc_kinematics::rust(&narrow)).expect("a file");
    std::fs::write(
        at("main.c"),
        "#include \"cell.h\"\n#include \"narrow.h\"\n#include <stdio.h>
int main(void)
{
    const double q[3] = {0.3, 0.2, -0.7}, v[3] = {0.4, -0.1, 0.9}, a[3] = {-0.3, 0.6, 0.2};
    float s[3][3];
    for (int at = 0; at < 3; at++) { s[0][at] = (float)q[at]; s[1][at] = (float)v[at]; s[2][at] = (float)a[at]; }
    cell_fk_result wide;
    narrow_fk_result narrow;
    cell_fk(q, v, a, &wide);
    narrow_fk(s[0], s[1], s[2], &narrow);
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++)
            printf(\"%.9g\\n%.9g\\n\", wide.pose_wrist_in_base[row][column], (double)narrow.pose_wrist_in_base[column][row]);
    for (int row = 0; row < 6; row++)
        for (int column = 0; column < 3; column++)
            printf(\"%.9g\\n%.9g\\n\", wide.jacobian_wrist_in_base[row][column], (double)narrow.jacobian_wrist_in_base[column][row]);
    for (int at = 0; at < 3; at++)
        printf(\"%.9g\\n%.9g\\n\", wide.efforts[at], (double)narrow.efforts[at]);
    return 0;
}
",
    )
    .expect("a file");
    std::fs::write(
        at("main.rs"),
        "mod narrow;
fn main() {
    let found = narrow::fk(&[0.3, 0.2, -0.7], &[0.4, -0.1, 0.9], &[-0.3, 0.6, 0.2]);
    let pose: [[f32; 4]; 4] = *found.pose_wrist_in_base;
    let jacobian: [[f32; 6]; 3] = found.jacobian_wrist_in_base;
    for row in 0..4 { for column in 0..4 { println!(\"{}\", pose[column][row]); } }
    for row in 0..6 { for column in 0..3 { println!(\"{}\", jacobian[column][row]); } }
    for effort in found.efforts { println!(\"{effort}\"); }
}
",
    )
    .expect("a file");
    let options = [
        "-std=c99",
        "-O1",
        "-Wall",
        "-Wdouble-promotion",
        "-Wfloat-conversion",
        "-Werror",
        "-ffp-contract=off",
    ];
    compiled("cc", &options, &at("main.c"), &at("in_c"));
    let in_c = printed(&mut Command::new(at("in_c")));
    assert_eq!(in_c.len(), 2 * (16 + 18 + 3));
    compiled("rustc", &["--edition=2021"], &at("main.rs"), &at("in_rust"));
    let in_rust = printed(&mut Command::new(at("in_rust")));
    let expected = run(&wide, 1.0);
    let pairs = in_c.chunks(2).zip(&in_rust).zip(&expected);
    let mut differ = 0;
    for ((pair, in_rust), expected) in pairs {
        let [wide, narrow] = pair else {
            panic!("two numbers")
        };
        assert!((wide - expected).abs() < 1e-7, "{pair:?} {expected}");
        for one in [narrow, in_rust] {
            let most = 1e-4 * (1.0 + expected.abs());
            assert!((one - expected).abs() < most, "{one} {expected}");
            differ += usize::from((one - expected).abs() > 1e-12);
        }
    }
    assert!(differ > 20, "numbers of 32 bits are rounded: {differ}");
}

/// Python has lists of columns, and takes a target by columns.
#[test]
fn columns_in_python() {
    let of = |choices: &str| {
        let text = format!(
            "import \"six.urdf\"; Kinematics cell {{ {choices} solver fk {{ pose tool in base; }};
            solver reach {{ inverse pose tool in base; }}; }};"
        );
        let (cell, found) = load_beside(&text, &[("six.urdf", SIX)]);
        assert_eq!(found, "");
        rc_kinematics::python(&cell.expect("a cell"))
    };
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write("rows.py", &of(""));
    write("columns.py", &of("matrices column_major;"));
    write(
        "main.py",
        "import rows, columns
q = [0.3, -1.1, 0.9, 0.4, 0.7, -0.2]
one, other = rows.fk(q).pose_tool_in_base, columns.fk(q).pose_tool_in_base
assert other == [list(column) for column in zip(*one)]
found = columns.reach(other, [0.0] * 6)
assert found.reached and found == columns.reach(other, [0.0] * 6)
assert found.positions == rows.reach(one, [0.0] * 6).positions
print(found.distance)
",
    );
    let numbers = printed(Command::new("python3").arg(folder.path().join("main.py")));
    assert!(numbers[0] < 1e-6);
}

#[test]
fn wrong_choices_are_told() {
    for (text, what) in [
        ("scalars f16;", "`scalars` has no choice `f16`"),
        ("lengths cm;", "`lengths` has no choice `cm`"),
        ("frames inner_model;", "did you mean `innermodel`?"),
        ("lengths m; lengths mm;", "`lengths` occurs twice"),
        (
            "lengths mm; solver s { efforts; };",
            "forces and masses are computed in metres",
        ),
        (
            "lengths mm; solver s { inverse velocity wrist in base; };",
            "which `lengths mm` changes",
        ),
        (
            "scalars f32; loop l { wrist = base; point; }; solver s { closed_positions; };",
            "loops are closed with f64 only",
        ),
    ] {
        let text = format!(
            "import \"arm.urdf\"; Kinematics cell {{ {text} solver fk {{ pose wrist in base; }}; }};"
        );
        let (_, found) = load_beside(&text, &[("arm.urdf", ARM)]);
        assert!(found.contains(what), "{text}: {found}");
    }
}
