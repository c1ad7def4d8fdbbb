//! Python that loads printed C computes what printed C computes.

use crate::load_beside;
use crate::printed::{compiled, printed};
use rc_robot::State;
use std::path::Path;
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

const PROGRAM: &str = "
import numpy, six_ctypes as six
q = numpy.array([0.3, -1.1, 0.9, 0.4, 0.7, -0.2])
v = [0.1, 0.2, -0.3, 0.4, 0.5, 0.6]
part = [1, 0, 0, 0.1, 0.01, 0, 0, 0.01, 0, 0.01]
moved, driven = six.fk(q, v), six.go(q, v, v, part)
assert moved.jacobian_tool_in_base.shape == (6, 6)
found, other = six.reach(moved.pose_tool_in_base, v), six.from_home(moved.pose_tool_in_base)
assert found.reached and other.reached and found.distance < 1e-6 * WIDER
rates = six.push(q, moved.velocity_tool_in_base)
for part in [*moved, *driven, found.positions, other.positions, *rates]:
    for number in part.flatten():
        print(repr(float(number)))
try:
    six.fk(q[:3], v)
except ValueError as error:
    assert str(error) == 'positions has the shape (3,), not (6,)', error
else:
    raise AssertionError
";

#[test]
fn python_loads_a_library_in_c() {
    let test = "python_loads_a_library_in_c";
    let packages = rc_test_support::python::packages;
    let python = packages("python-numpy", "numpy==2.3.4", test);
    let Some(python) = python else { return };
    for (kind, wider, near) in [("f64", "1", 1e-9), ("f32", "10", 1e-4)] {
        loaded(python, kind, wider, near);
    }
}

/// Numbers of `kind` are as near to those of 64 bits.
fn loaded(python: &Path, kind: &str, wider: &str, near: f64) {
    let text = |kind| TEXT.replace("scalars f64", &format!("scalars {kind}"));
    let program = PROGRAM.replace("WIDER", wider);
    let (printed_cell, found) = load_beside(&text(kind), &[("six.urdf", SIX)]);
    assert_eq!(found, "");
    let printed_cell = printed_cell.expect("a cell");
    let (cell, found) = load_beside(&text("f64"), &[("six.urdf", SIX)]);
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
    let (pose, velocity) = (expected[..16].to_vec(), expected[52..].to_vec());
    let velocity: [f64; 6] = velocity.try_into().expect("six numbers");
    expected.extend(
        cell.solvers[1]
            .run(&state, &state.velocities, &part)
            .expect("numbers"),
    );
    let target = std::array::from_fn(|row| std::array::from_fn(|column| pose[4 * row + column]));
    for inverse in &cell.inverses[..2] {
        let (positions, _) = inverse
            .positions(&target, &state.velocities)
            .expect("positions");
        expected.extend(positions);
    }
    let answer = cell.inverses[2].velocities(&state.positions, &velocity);
    let (velocities, achieved) = answer.expect("six joints").expect("velocities");
    expected.extend(velocities);
    expected.extend(achieved);
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("six.c"), rc_kinematics::library(&printed_cell)).expect("a file");
    std::fs::write(at("six_ctypes.py"), rc_kinematics::loader(&printed_cell)).expect("a file");
    std::fs::write(at("main.py"), program).expect("a file");
    let output = Command::new(python)
        .arg(at("main.py"))
        .output()
        .expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        errors.contains("build it: cc -O2 -ffp-contract=off -shared -fPIC six.c -o libsix.so -lm"),
        "{errors}"
    );
    let options = ["-O2", "-ffp-contract=off", "-shared", "-fPIC"];
    compiled("cc", &options, &at("six.c"), &at("libsix.so"));
    let numbers = printed(Command::new(python).arg(at("main.py")));
    assert_eq!(numbers.len(), expected.len());
    for (one, other) in numbers.iter().zip(&expected) {
        assert!(
            (one - other).abs() < near * (1.0 + other.abs()),
            "{kind}: {one} {other}"
        );
    }
}
