//! Printed C++ computes what printed C computes.

use crate::load_beside;
use crate::printed::{compiled, printed};
use rc_robot::State;
use std::fmt::Write as _;
use std::process::Command;

const SIX: &str = include_str!("../../examples/six.urdf");

const TEXT: &str = "import \"six.urdf\";
Kinematics six
{
    scalars f64;
    posture home { elbow = 1; };
    solver fk { pose tool in base; jacobian tool in base; velocity tool in base; };
    solver go { accelerations; mass_matrix; payload part at tool; };
    solver reach { inverse pose tool in base; within limits; };
    solver from_home { inverse pose tool in base; seed home; };
    solver push { inverse velocity tool in base; };
};";

#[test]
fn cpp_has_matrices_of_eigen() {
    let packages = rc_test_support::python::packages;
    let test = "cpp_has_matrices_of_eigen";
    if Command::new("c++").arg("--version").output().is_err() {
        rc_test_support::python::skipped(test, "there is no compiler of C++ in the path");
        return;
    }
    let Some(python) = packages("eigen", "cmeel-eigen==3.4.1\n", test) else {
        return;
    };
    let place = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let place = Command::new(python).args(["-c", place]).output();
    let place = String::from_utf8(place.expect("python").stdout).expect("a text");
    let eigen = format!("-I{}/cmeel.prefix/include/eigen3", place.trim());
    for (kind, word, near) in [("f64", "double", 1e-9), ("f32", "float", 1e-4)] {
        compared(&eigen, kind, word, near);
    }
}

/// Numbers of `kind` are as near to those of 64 bits. `word` is their type in C++.
fn compared(eigen: &str, kind: &str, word: &str, near: f64) {
    let text_of = |kind| TEXT.replace("scalars f64", &format!("scalars {kind}"));
    let (printed_cell, found) = load_beside(&text_of(kind), &[("six.urdf", SIX)]);
    assert_eq!(found, "");
    let printed_cell = printed_cell.expect("a cell");
    let (cell, found) = load_beside(&text_of("f64"), &[("six.urdf", SIX)]);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let state = State {
        positions: vec![0.3, -1.1, 0.9, 0.4, 0.7, -0.2],
        velocities: vec![0.1, 0.2, -0.3, 0.4, 0.5, 0.6],
        accelerations: vec![0.0; 6],
    };
    let part = [1.0, 0.0, 0.0, 0.1, 0.01, 0.0, 0.0, 0.01, 0.0, 0.01];
    let mut expected = cell.solvers[0]
        .run(&state, &[0.0; 6], &[])
        .expect("numbers");
    let pose = expected[..16].to_vec();
    let efforts = &state.velocities;
    expected.extend(
        cell.solvers[1]
            .run(&state, efforts, &part)
            .expect("numbers"),
    );
    let rows = pose.chunks(4).map(|row| [row[0], row[1], row[2], row[3]]);
    let target: [[f64; 4]; 4] = rows.collect::<Vec<_>>().try_into().expect("four rows");
    for inverse in &cell.inverses[..2] {
        let (positions, found) = inverse
            .positions(&target, &state.velocities)
            .expect("positions");
        assert!(found.reached);
        expected.extend(positions);
    }
    let velocity = [0.1, 0.0, 0.2, 0.0, 0.3, 0.0];
    let answer = cell.inverses[2].velocities(&state.positions, &velocity);
    expected.extend(answer.expect("six joints").expect("velocities").0);
    let list = |numbers: &[f64]| -> String {
        let words: Vec<String> = numbers.iter().map(|number| format!("{number:?}")).collect();
        words.join(", ")
    };
    let mut text = String::from(
        "#include \"six.hpp\"\n#include \"six.hpp\"\n#include <cstdio>\n\
        template <typename M> void show(const M &all)\n{\n    for (int row = 0; row < all.rows(); row++)\n        \
        for (int column = 0; column < all.cols(); column++)\n            std::printf(\"%.17g\\n\", all(row, column));\n}\n\
        int main()\n{\n    (void)six_joints; (void)six_lower; (void)six_upper;\n",
    );
    let six = format!("Eigen::Matrix<{word}, 6, 1>");
    write!(
        text,
        "    {six} q, v, w;\n    q << {};\n    v << {};\n    w << {};\n    Eigen::Matrix<{word}, 10, 1> part;\n    part << {};\n\
        \x20   auto moved = six::fk(q, v);\n    show(moved.pose_tool_in_base);\n    show(moved.jacobian_tool_in_base);\n\
        \x20   show(moved.velocity_tool_in_base);\n    auto driven = six::go(q, v, v, part);\n    show(driven.accelerations);\n\
        \x20   show(driven.mass_matrix);\n    Eigen::Matrix<{word}, 4, 4> target = moved.pose_tool_in_base;\n\
        \x20   auto found = six::reach(target, v);\n    show(Eigen::Map<{six}>(found.positions));\n\
        \x20   found.reached = 0;\n    auto other = six::from_home(target);\n    show(Eigen::Map<{six}>(other.positions));\n\
        \x20   show(Eigen::Map<{six}>(six::push(q, w).velocities));\n    return 0;\n}}\n",
        list(&state.positions),
        list(&state.velocities),
        list(&velocity),
        list(&part),
    )
    .expect("a text");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("six.hpp"), rc_kinematics::cpp(&printed_cell)).expect("a file");
    std::fs::write(at("main.cpp"), text).expect("a file");
    // Warnings of Eigen are its own.
    let eigen = eigen.replacen("-I", "-isystem", 1);
    let options = [
        "-std=c++17",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-ffp-contract=off",
        &eigen,
    ];
    compiled("c++", &options, &at("main.cpp"), &at("in_cpp"));
    let numbers = printed(&mut Command::new(at("in_cpp")));
    assert_eq!(numbers.len(), expected.len());
    for (one, other) in numbers.iter().zip(&expected) {
        assert!(
            (one - other).abs() < near * (1.0 + other.abs()),
            "{kind}: {one} {other}"
        );
    }
}
