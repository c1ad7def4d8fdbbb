//! Inverse kinematics of real arms, whose files are in packages of `PyPI`.

use crate::hinges::keep_a_bar;
use crate::inverse::{closed_by_pinocchio, searches};
use crate::load_with;
use crate::printed::compiled;
use serde_json::{Value, json};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// The packages, as the tests of `rc-robot` have them.
const PACKAGES: &str = "example-robot-data==6.0.0\npin==4.1.0\n";

/// Name, file, and the links that become `base` and `tool`.
const ARMS: [(&str, &str, [&str; 2]); 4] = [
    (
        "ur5",
        "ur_description/urdf/ur5_robot.urdf",
        ["base_link", "tool0"],
    ),
    (
        "panda",
        "panda_description/urdf/panda.urdf",
        ["panda_link0", "panda_hand_tcp"],
    ),
    (
        "kinova",
        "kinova_description/robots/kinova.urdf",
        ["j2s6s200_link_base", "j2s6s200_end_effector"],
    ),
    (
        "tiago",
        "tiago_description/robots/tiago_no_hand.urdf",
        ["torso_lift_link", "arm_tool_link"],
    ),
];

/// The files of the arms, with `base` and `tool`.
fn texts(python: &Path) -> Vec<String> {
    let program = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let output = Command::new(python).args(["-c", program]).output();
    let output = String::from_utf8(output.expect("python").stdout).expect("a text");
    let data = "cmeel.prefix/share/example-robot-data/robots";
    let folder = Path::new(output.trim()).join(data);
    let of = |(_, file, [base, tool]): &(&str, &str, [&str; 2])| {
        let text = std::fs::read_to_string(folder.join(file)).expect("a robot");
        let named = |name: &str| format!("\"{name}\"");
        let text = text.replace(&named("base"), "\"base_of_maker\"");
        let text = text.replace(&named(base), "\"base\"");
        text.replace(&named(tool), "\"tool\"")
    };
    ARMS.iter().map(of).collect()
}

/// Poses of UR5, Panda, Kinova and the arm of `TIAGo` are found within limits, and Pinocchio finds the frames
/// there; other poses are said to be out of reach.
///
/// `KINEMATICS_POSES` is the number of poses of each arm.
#[test]
#[ignore = "`cargo xtask soak kinematics` runs it: the package has 400 MB of meshes"]
fn real_arms_reach_their_poses() {
    let test = "real_arms_reach_their_poses";
    let python = rc_test_support::python::packages("example-robots", PACKAGES, test);
    let Some(python) = python else { return };
    let count = std::env::var("KINEMATICS_POSES").map(|text| text.parse().expect("a number"));
    let count: usize = count.unwrap_or(300);
    let texts = texts(python);
    let mut shown = Vec::new();
    for ((name, ..), text) in ARMS.iter().zip(&texts) {
        let (lines, some) = searches(name, text, count, count / 10);
        let words: Vec<&str> = lines.iter().flat_map(|line| line.split(' ')).collect();
        let found: usize = words[1].parse().expect("a number");
        assert!(found * 1000 >= count * 999, "{name}: {lines:?}");
        assert_eq!(words[3], (count / 10).to_string(), "{name}: {lines:?}");
        let worst: f64 = words[4].parse().expect("a number");
        assert!(worst < 1.01, "{name}: {lines:?}");
        shown.push((text.as_str(), some));
    }
    closed_by_pinocchio("real_arms_reach_their_poses (by Pinocchio)", &shown);
}

/// The positions for a pose out of reach are the nearest: a long optimisation of scipy from many beginnings finds
/// none that is nearer by a hundredth.
#[test]
fn poses_out_of_reach_have_the_nearest_answer() {
    let test = "poses_out_of_reach_have_the_nearest_answer";
    let python = rc_test_support::python::interpreter("scipy==1.17.1", test);
    let Some(python) = python else { return };
    for robot in [
        include_str!("../../examples/six.urdf"),
        include_str!("../robots/seven.urdf"),
    ] {
        no_nearer_answer(python, robot, 1);
    }
}

/// The same of a real arm, whose name is in `KINEMATICS_ARM`: UR5 without it. `KINEMATICS_FAR` is the number of poses.
#[test]
#[ignore = "`cargo xtask soak kinematics` runs it: the package has 400 MB of meshes"]
fn real_arms_have_the_nearest_answer() {
    let test = "real_arms_have_the_nearest_answer";
    let packages = rc_test_support::python::packages;
    let (Some(files), Some(python)) = (
        packages("example-robots", PACKAGES, test),
        rc_test_support::python::interpreter("scipy==1.17.1", test),
    ) else {
        return;
    };
    let count = std::env::var("KINEMATICS_FAR").map(|text| text.parse().expect("a number"));
    let arm = std::env::var("KINEMATICS_ARM").unwrap_or_else(|_| "ur5".to_owned());
    let place = ARMS.iter().position(|(name, ..)| *name == arm);
    let text = &texts(files)[place.expect("an arm")];
    no_nearer_answer(python, text, count.unwrap_or(20));
}

/// Two UR5 keep their bar. `KINEMATICS_STEPS` is the number of milliseconds.
#[test]
#[ignore = "`cargo xtask soak kinematics` runs it: the package has 400 MB of meshes"]
fn two_ur5_keep_their_bar() {
    let test = "two_ur5_keep_their_bar";
    let python = rc_test_support::python::packages("example-robots", PACKAGES, test);
    let Some(python) = python else { return };
    let steps = std::env::var("KINEMATICS_STEPS").map(|text| text.parse().expect("a number"));
    keep_a_bar((&texts(python)[0], "world"), steps.unwrap_or(200));
}

/// Of so many poses out of reach of an arm, scipy finds no nearer positions.
fn no_nearer_answer(python: &Path, robot: &str, count: usize) {
    let mut random = fastrand::Rng::with_seed(21);
    let text = "import \"arm.urdf\"; Kinematics arm { solver fk { pose tool in base; };
        solver reach { inverse pose tool in base; within limits; }; };";
    let (cell, found) = load_with(text, robot);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let limits: Vec<(f64, f64)> = cell
        .robot
        .limits()
        .into_iter()
        .flatten()
        .map(|limits| (limits.lower, limits.upper))
        .collect();
    let mut cases = Vec::new();
    while cases.len() < count {
        let mut some = || -> Vec<f64> {
            let places = limits.iter();
            places
                .map(|(lower, upper)| lower + random.f64() * (upper - lower))
                .collect()
        };
        let state = rc_robot::State::still(some());
        let last = some();
        let joints = state.positions.len();
        let numbers = cell.solvers[0].run(&state, &vec![0.0; joints], &[]);
        let numbers = numbers.expect("numbers");
        let mut target: [[f64; 4]; 4] =
            std::array::from_fn(|row| std::array::from_fn(|column| numbers[4 * row + column]));
        let stretch = 1.2 + random.f64();
        for row in &mut target[..3] {
            row[3] *= stretch;
        }
        let (positions, found) = cell.inverses[0]
            .positions(&target, &last)
            .expect("positions");
        if !found.reached {
            let far = found.distance.hypot(found.angle);
            cases.push(json!({ "target": target, "positions": positions, "far": far }));
        }
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("arm.h"), rc_kinematics::c(&cell)).expect("a file");
    let library = "#include \"arm.h\"\nvoid fk(const double *q, arm_fk_result *r) { (void)arm_joints; (void)arm_lower; (void)arm_upper; arm_fk(q, r); }\n";
    std::fs::write(at("arm.c"), library).expect("a file");
    let options = ["-std=c99", "-O2", "-shared", "-fPIC"];
    compiled("cc", &options, &at("arm.c"), &at("arm.so"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/nearest.py");
    let child = Command::new(python)
        .arg(script)
        .arg(at("arm.so"))
        // Threads wait for each other longer than these matrices take.
        .env("OPENBLAS_NUM_THREADS", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let mut child = child.expect("python");
    let mut input = child.stdin.take().expect("its input");
    let all = json!({ "limits": limits, "cases": cases });
    let written = input.write_all(all.to_string().as_bytes());
    written.expect("written");
    drop(input);
    let output = child.wait_with_output().expect("python");
    assert!(output.status.success(), "the script failed");
    let nearest: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for (own, other) in cases.iter().zip(nearest.as_array().expect("a list")) {
        let (own, other) = (own["far"].as_f64(), other.as_f64());
        let (own, other) = own.zip(other).expect("numbers");
        assert!(own <= 1.01 * other, "{own} {other}");
    }
}
