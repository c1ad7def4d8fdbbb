//! Several robots in one file, and loops.

use crate::{ARM, load_beside};
use rc_kinematics::{Cell, Solver};
use rc_robot::{State, dynamics};
use serde_json::{Value, json};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

const SIX: &str = include_str!("../../examples/six.urdf");

fn cell(text: &str, robots: &[(&str, &str)]) -> Cell {
    let (cell, found) = load_beside(text, robots);
    assert_eq!(found, "");
    cell.expect("a cell")
}

fn random(random: &mut fastrand::Rng, count: usize, most: f64) -> Vec<f64> {
    (0..count)
        .map(|_| (random.f64() * 2.0 - 1.0) * most)
        .collect()
}

/// The numbers of an output.
fn output(solver: &Solver, name: &str, state: &State, efforts: &[f64]) -> Vec<f64> {
    let all = solver.run(state, efforts, &[]).expect("numbers");
    let mut at = 0;
    for output in &solver.outputs {
        let size = output.shape.size();
        if output.name == name {
            return all[at..at + size].to_vec();
        }
        at += size;
    }
    panic!("no output {name}");
}

fn near(one: &[f64], other: &[f64], most: f64) {
    assert_eq!(one.len(), other.len());
    for (a, b) in one.iter().zip(other) {
        assert!((a - b).abs() <= most * (1.0 + b.abs()), "{a} {b}");
    }
}

/// Two arms in one file move as each does alone, and the place of one in the other is that of the file.
#[test]
fn two_arms_are_one_robot() {
    let own = "solver fk { pose wrist in base; efforts; mass_matrix; };";
    let alone = format!("import \"arm.urdf\";\nKinematics one {{ {own} }};");
    let alone = cell(&alone, &[("arm.urdf", ARM)]);
    let text = "import \"arm.urdf\" as left;\nimport \"arm.urdf\" as right;
Kinematics two
{
    fixed right.base in left.base at 1 m, 200 mm, 0 rpy 0, 0, 180 deg;
    solver fk { pose left.wrist in left.base; pose right.wrist in left.base; pose right.base in left.shoulder; };
    solver hold { efforts; mass_matrix; };
};";
    let two = cell(text, &[("arm.urdf", ARM)]);
    assert_eq!(two.robot.coordinates[3], "right.turn");
    let mut numbers = fastrand::Rng::with_seed(3);
    for _ in 0..20 {
        let mut six = || random(&mut numbers, 6, 1.0);
        let state = State {
            positions: six(),
            velocities: six(),
            accelerations: six(),
        };
        let part = |from: usize| State {
            positions: state.positions[from..from + 3].to_vec(),
            velocities: state.velocities[from..from + 3].to_vec(),
            accelerations: state.accelerations[from..from + 3].to_vec(),
        };
        let solver = &alone.solvers[0];
        let of = |name: &str, from: usize| output(solver, name, &part(from), &[0.0; 3]);
        let both = |name: &str| output(&two.solvers[0], name, &state, &[0.0; 6]);
        near(
            &both("pose_left_wrist_in_left_base"),
            &of("pose_wrist_in_base", 0),
            1e-12,
        );
        // Half a turn about z, and then the way.
        let right = of("pose_wrist_in_base", 3);
        let turned = both("pose_right_wrist_in_left_base");
        near(
            &[turned[3], turned[7], turned[11]],
            &[1.0 - right[3], 0.2 - right[7], right[11]],
            1e-12,
        );
        let whole = |name: &str| output(&two.solvers[1], name, &state, &[0.0; 6]);
        // The second base is turned about gravity.
        let efforts = [of("efforts", 0), of("efforts", 3)].concat();
        near(&whole("efforts"), &efforts, 1e-12);
        let mass = whole("mass_matrix");
        near(&mass[..3], &of("mass_matrix", 0)[..3], 1e-12);
        near(&mass[3..6], &[0.0; 3], 1e-12);
    }
}

/// A base that moves in a plane carries the arm, and its coordinates have limits, names and efforts.
#[test]
fn a_base_may_move() {
    let text = "import \"arm.urdf\";
Kinematics mobile
{
    planar base in floor at 0, 0, 100 mm;
    posture there { base.x = 2; base.y = 1 m; base.yaw = 90 deg; };
    solver fk { pose wrist in floor; pose wrist in base; jacobian wrist in floor; mass_matrix; };
    solver reach { inverse pose wrist in floor; within limits; seed there; };
};";
    let mobile = cell(text, &[("arm.urdf", ARM)]);
    let coordinates = ["turn", "reach", "bend", "base.x", "base.y", "base.yaw"];
    assert_eq!(mobile.robot.coordinates, coordinates);
    let positions = vec![0.3, 0.1, -0.4, 2.0, 1.0, std::f64::consts::FRAC_PI_2];
    let state = State::still(positions);
    let of = |name: &str| output(&mobile.solvers[0], name, &state, &[0.0; 6]);
    let (floor, base) = (of("pose_wrist_in_floor"), of("pose_wrist_in_base"));
    near(
        &[floor[3], floor[7], floor[11]],
        &[2.0 - base[7], 1.0 + base[3], 0.1 + base[11]],
        1e-12,
    );
    let jacobian = of("jacobian_wrist_in_floor");
    near(
        &[jacobian[3], jacobian[6 + 4], jacobian[30 + 5]],
        &[1.0; 3],
        1e-12,
    );
    // Sliding moves all that the base carries.
    let mass: f64 = mobile
        .robot
        .bodies
        .iter()
        .filter_map(|body| Some(body.inertia?.mass))
        .sum();
    near(&[of("mass_matrix")[3 * 6 + 3]], &[mass], 1e-12);
    let target: Vec<[f64; 4]> = floor
        .chunks(4)
        .map(|row| [row[0], row[1], row[2], row[3]])
        .collect();
    let target: [[f64; 4]; 4] = target.try_into().expect("four rows");
    let found = mobile.inverses[0]
        .positions(&target, &[0.0; 6])
        .expect("positions");
    assert!(found.1.reached, "{found:?}");
    // A place that is far from where the search begins.
    let mut far = target;
    far[0][3] += 200.0;
    let found = mobile.inverses[0].positions(&far, &[0.0; 6]);
    let (positions, found) = found.expect("positions");
    assert!(found.reached, "{found:?}");
    assert!(positions[3] > 190.0, "{positions:?}");
}

/// A four-bar linkage in the plane x, z: a crank, a coupler and a rocker.
pub(crate) const BARS: &str = r#"<robot name="bars">
    <link name="ground"/>
    <link name="crank"><inertial><origin xyz="0.1 0 0"/><mass value="0.4"/><inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <link name="coupler"><inertial><origin xyz="0.3 0 0"/><mass value="0.7"/><inertia ixx="0.001" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <link name="rocker"><inertial><origin xyz="0.2 0 0"/><mass value="0.5"/><inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <link name="coupler_end"/>
    <link name="rocker_end"/>
    <joint name="turn" type="continuous"><parent link="ground"/><child link="crank"/><axis xyz="0 1 0"/></joint>
    <joint name="knee" type="continuous"><parent link="crank"/><child link="coupler"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/></joint>
    <joint name="swing" type="continuous"><parent link="ground"/><child link="rocker"/><origin xyz="0.6 0 0"/><axis xyz="0 1 0"/></joint>
    <joint name="end" type="fixed"><parent link="coupler"/><child link="coupler_end"/><origin xyz="0.6 0 0"/></joint>
    <joint name="top" type="fixed"><parent link="rocker"/><child link="rocker_end"/><origin xyz="0.4 0 0"/></joint>
</robot>
"#;

pub(crate) const FOUR: &str = "import \"bars.urdf\";
Kinematics four
{
    loop bar { coupler_end = rocker_end; point; };
    solver close { closed_positions; holding turn; };
    solver keep { closed_positions; loop_errors; };
    solver rates { closed_velocities; loop_jacobian; };
    solver go { accelerations; loop_forces; efforts; };
    solver push { efforts; passive knee, swing; };
};";

/// The linkage falls under gravity: it stays closed, and keeps its energy.
///
/// `KINEMATICS_STEPS` is the number of milliseconds.
#[test]
fn a_four_bar_linkage_stays_closed() {
    let four = cell(FOUR, &[("bars.urdf", BARS)]);
    let [close, keep, rates, go, _] = four.solvers.as_slice() else {
        panic!("five solvers");
    };
    let mut state = State::still(vec![-1.0, -0.2, -1.2]);
    state.positions = output(close, "closed_positions", &state, &[0.0; 3]);
    assert_eq!(state.positions[0].to_bits(), (-1.0_f64).to_bits());
    let (step, mut worst, mut fastest) = (1e-3, 0.0_f64, 0.0_f64);
    let energy = |state: &State| {
        let mut resting = state.clone();
        resting.accelerations = vec![0.0; 3];
        // The work of gravity: heights of the centres of mass.
        let robot = &four.robot;
        let places = robot.links().filter_map(|(at, _)| {
            let inertia = robot.bodies[at].inertia?;
            let pose = robot.chain(0, at)?.moved(&resting).pose;
            let height = pose.translation[2] + pose.rotation[2][0] * inertia.centre[0];
            Some(9.80665 * inertia.mass * height)
        });
        let mass = rc_robot::dynamics::mass_matrix(robot, &resting, &[]);
        let moving = mass.iter().zip(&state.velocities).map(|(row, own)| {
            let row = row.iter().zip(&state.velocities);
            0.5 * own * row.map(|(mass, speed)| mass * speed).sum::<f64>()
        });
        places.sum::<f64>() + moving.sum::<f64>()
    };
    let before = energy(&state);
    let rate = |state: &State| output(go, "accelerations", state, &[0.0; 3]);
    let ahead = |state: &State, (velocities, accelerations): (&[f64], &[f64]), time: f64| {
        let moved = |all: &[f64], by: &[f64]| -> Vec<f64> {
            all.iter()
                .zip(by)
                .map(|(one, by)| one + by * time)
                .collect()
        };
        State {
            positions: moved(&state.positions, velocities),
            velocities: moved(&state.velocities, accelerations),
            accelerations: vec![0.0; 3],
        }
    };
    let steps = std::env::var("KINEMATICS_STEPS").map(|text| text.parse().expect("a number"));
    for _ in 0..steps.unwrap_or(1_000) {
        // The midpoint rule.
        let first = rate(&state);
        let middle = ahead(&state, (&state.velocities, &first), step / 2.0);
        let second = rate(&middle);
        state = ahead(&state, (&middle.velocities, &second), step);
        state.positions = output(keep, "closed_positions", &state, &[0.0; 3]);
        state.velocities = output(rates, "closed_velocities", &state, &[0.0; 3]);
        let errors = output(keep, "loop_errors", &state, &[0.0; 3]);
        worst = errors
            .iter()
            .fold(worst, |most, error| most.max(error.abs()));
        fastest = state
            .velocities
            .iter()
            .fold(fastest, |most, speed| most.max(speed.abs()));
    }
    assert!(worst < 1e-12, "{worst}");
    assert!(fastest > 1.0, "{fastest}");
    assert!(
        (energy(&state) - before).abs() < 1e-4,
        "{before} {}",
        energy(&state)
    );
}

/// The efforts of accelerations that keep a loop closed give these accelerations, and the loop carries nothing.
#[test]
fn efforts_leave_loops_without_force() {
    let four = cell(FOUR, &[("bars.urdf", BARS)]);
    let [close, _, rates, go, _] = four.solvers.as_slice() else {
        panic!("five solvers");
    };
    let mut state = State::still(vec![-1.0, -0.2, -1.2]);
    state.positions = output(close, "closed_positions", &state, &[0.0; 3]);
    state.velocities = vec![1.0, -0.5, 0.3];
    state.velocities = output(rates, "closed_velocities", &state, &[0.0; 3]);
    let pushed = [0.4, -0.2, 0.1];
    state.accelerations = output(go, "accelerations", &state, &pushed);
    let forces = output(go, "loop_forces", &state, &pushed);
    assert!(forces.iter().any(|part| part.abs() > 0.1), "{forces:?}");
    let efforts = output(go, "efforts", &state, &[0.0; 3]);
    let again = output(go, "accelerations", &state, &efforts);
    near(&again, &state.accelerations, 1e-8);
    near(
        &output(go, "loop_forces", &state, &efforts),
        &[0.0; 3],
        1e-8,
    );
    let doc = &go.outputs[2].doc;
    assert!(
        doc.ends_with("with which the loops carry no force."),
        "{doc}"
    );
}

/// Motors give accelerations through the loop, also where joints have none, with the least efforts that do.
#[test]
fn motors_move_joints_without_one() {
    let four = cell(FOUR, &[("bars.urdf", BARS)]);
    let [close, _, rates, go, push] = four.solvers.as_slice() else {
        panic!("five solvers");
    };
    let mut state = State::still(vec![-1.0, -0.2, -1.2]);
    state.positions = output(close, "closed_positions", &state, &[0.0; 3]);
    state.velocities = vec![1.0, -0.5, 0.3];
    state.velocities = output(rates, "closed_velocities", &state, &[0.0; 3]);
    let pushed = [0.4, -0.2, 0.1];
    state.accelerations = output(go, "accelerations", &state, &pushed);
    let efforts = output(push, "efforts", &state, &[0.0; 3]);
    assert!(efforts[0].abs() > 0.01, "{efforts:?}");
    near(&efforts[1..], &[0.0; 2], 1e-300);
    let again = output(go, "accelerations", &state, &efforts);
    near(&again, &state.accelerations, 1e-8);
    let doc = &push.outputs[0].doc;
    assert!(doc.starts_with("The least torques"), "{doc}");
    // With a second motor, they share the effort.
    let text = FOUR.replace("passive knee, swing", "passive knee");
    let two = cell(&text, &[("bars.urdf", BARS)]);
    let shared = output(&two.solvers[4], "efforts", &state, &[0.0; 3]);
    let again = output(go, "accelerations", &state, &shared);
    near(&again, &state.accelerations, 1e-8);
    let square = |all: &[f64]| all.iter().map(|one| one * one).sum::<f64>();
    assert!(shared[2].abs() > 0.01, "{shared:?}");
    assert!(square(&shared) < square(&efforts), "{shared:?} {efforts:?}");
    // Any other share costs more.
    for by in [-0.05, 0.05] {
        let mixed: Vec<f64> = shared
            .iter()
            .zip(&efforts)
            .map(|(one, other)| one * (1.0 - by) + other * by)
            .collect();
        near(
            &output(go, "accelerations", &state, &mixed),
            &state.accelerations,
            1e-8,
        );
        assert!(square(&mixed) > square(&shared), "{mixed:?}");
    }
}

/// Where crank and coupler are in one line, the rocker moves no crank: its efforts are great numbers, and those of the crank
/// are as elsewhere.
#[test]
fn efforts_at_a_dead_centre_are_finite() {
    let text = FOUR.replace("passive knee, swing", "passive turn, knee");
    let [four, other] = [FOUR, &text].map(|text| cell(text, &[("bars.urdf", BARS)]));
    let (go, crank, rocker) = (&four.solvers[3], &four.solvers[4], &other.solvers[4]);
    let mut state = State::still(vec![-0.875_f64.acos(), 0.0, -0.25_f64.acos()]);
    let errors = output(&four.solvers[1], "loop_errors", &state, &[0.0; 3]);
    near(&errors, &[0.0; 3], 1e-12);
    state.accelerations = output(go, "accelerations", &state, &[0.4, -0.2, 0.1]);
    let efforts = output(crank, "efforts", &state, &[0.0; 3]);
    let again = output(go, "accelerations", &state, &efforts);
    near(&again, &state.accelerations, 1e-8);
    let efforts = output(rocker, "efforts", &state, &[0.0; 3]);
    assert!(efforts.iter().all(|one| one.is_finite()), "{efforts:?}");
    assert!(efforts[2].abs() > 1e6, "{efforts:?}");
}

/// Two frames that are half a turn apart are not together: the sine of that angle is 0. Closed positions bring them
/// there.
#[test]
fn half_a_turn_is_an_error_of_a_loop() {
    let text = "import \"six.urdf\" as left;\nimport \"six.urdf\" as right;
Kinematics both
{
    fixed right.base in left.base at 0, 0, 0 rpy 0, 0, 180 deg;
    loop bar { left.tool = right.tool; };
    solver far { loop_errors; };
    solver close { closed_positions; };
};";
    let both = cell(text, &[("six.urdf", SIX)]);
    let arm = [0.3, -1.2, 1.1, 0.2, 0.7, 0.4];
    let mut state = State::still([arm, arm].concat());
    let still = [0.0; 12];
    let errors = output(&both.solvers[0], "loop_errors", &state, &still);
    let turn = errors[3..].iter().fold(0.0, |all, part| all + part * part);
    near(&[turn.sqrt()], &[2.0], 1e-12);
    for _ in 0..10 {
        state.positions = output(&both.solvers[1], "closed_positions", &state, &still);
    }
    let errors = output(&both.solvers[0], "loop_errors", &state, &still);
    near(&errors, &[0.0; 6], 1e-12);
}

/// Two arms with one bar, and the linkage, in states that keep the loop closed.
struct Loops {
    cases: Vec<Value>,
    /// Accelerations, forces, and the efforts of the loop on the joints.
    own: Vec<[Vec<f64>; 3]>,
}

/// The states have velocities up to `fastest`.
fn loops(fastest: f64) -> Loops {
    let inner = SIX
        .split_once("<robot name=\"six\">")
        .and_then(|(_, rest)| rest.rsplit_once("</robot>"));
    let inner = inner.expect("a robot").0;
    let named = |arm: &str| {
        let mut text = inner.to_owned();
        for word in ["name=\"", "link=\""] {
            text = text.replace(word, &format!("{word}{arm}."));
        }
        text
    };
    let joint = "<joint name=\"between\" type=\"fixed\"><parent link=\"left.base\"/><child link=\"right.base\"/><origin xyz=\"0.8 0.1 0\" rpy=\"0 0 3\"/></joint>";
    let both = format!(
        "<robot name=\"both\">{}{}{joint}</robot>",
        named("left"),
        named("right")
    );
    let text = "import \"six.urdf\" as left;\nimport \"six.urdf\" as right;
Kinematics both
{
    fixed right.base in left.base at 0.8, 0.1, 0 rpy 0, 0, 3;
    loop bar { left.tool = right.tool; };
    solver close { closed_positions; };
    solver rates { closed_velocities; };
    solver go { accelerations; loop_forces; };
    solver push { efforts; passive right.shoulder_pan, right.shoulder_lift, right.elbow, right.wrist_1; };
};";
    let arms = cell(text, &[("six.urdf", SIX)]);
    let bars = cell(FOUR, &[("bars.urdf", BARS)]);
    let mut numbers = fastrand::Rng::with_seed(9);
    let (mut cases, mut own) = (Vec::new(), Vec::new());
    for (cell, urdf, ends) in [
        (&arms, both.as_str(), ["left.tool", "right.tool"]),
        (&bars, BARS, ["coupler_end", "rocker_end"]),
    ] {
        let count = cell.robot.coordinates.len();
        let solver = |name: &str| {
            let mut all = cell.solvers.iter();
            all.find(|solver| solver.name == name).expect("a solver")
        };
        for _ in 0..10 {
            let mut state = State::still(random(&mut numbers, count, 1.0));
            // From afar, it takes several calls.
            for _ in 0..20 {
                let closed = output(
                    solver("close"),
                    "closed_positions",
                    &state,
                    &vec![0.0; count],
                );
                state.positions = closed;
            }
            state.velocities = random(&mut numbers, count, fastest);
            state.velocities = output(
                solver("rates"),
                "closed_velocities",
                &state,
                &vec![0.0; count],
            );
            let efforts = random(&mut numbers, count, 9.0);
            let mut moving = state.clone();
            moving.accelerations = output(solver("go"), "accelerations", &state, &efforts);
            let all = dynamics::efforts(&cell.robot, &moving, [0.0, 0.0, -9.80665], &[]);
            // Those of the motors alone give the same accelerations.
            let of_motors = output(solver("push"), "efforts", &moving, &vec![0.0; count]);
            for efforts in [efforts, of_motors] {
                own.push([
                    moving.accelerations.clone(),
                    output(solver("go"), "loop_forces", &state, &efforts),
                    all.iter()
                        .zip(&efforts)
                        .map(|(all, own)| all - own)
                        .collect(),
                ]);
                cases.push(json!({
                    "urdf": urdf,
                    "ends": ends,
                    "coordinates": cell.robot.coordinates,
                    "point": count == 3,
                    "positions": state.positions,
                    "velocities": state.velocities,
                    "efforts": efforts,
                }));
            }
        }
    }
    Loops { cases, own }
}

/// What a script of this folder answers.
fn answers(python: &Path, script: &str, cases: &[Value]) -> Vec<Value> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all"));
    let child = Command::new(python)
        .arg(folder.join(script))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let mut child = child.expect("python");
    let mut input = child.stdin.take().expect("its input");
    let written = input.write_all(json!(cases).to_string().as_bytes());
    written.expect("written");
    drop(input);
    let output = child.wait_with_output().expect("python");
    assert!(output.status.success(), "the script failed");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Compares lists of own numbers with those of an oracle, by their names. A start from which the arms do not meet says
/// nothing.
fn compare(loops: &Loops, other: &[Value], names: [(&str, usize); 2], most: f64) {
    let mut seen = 0;
    for (own, other) in loops.own.iter().zip(other) {
        let list = |name: &str| -> Vec<f64> {
            let all = other[name].as_array().expect("a list");
            all.iter()
                .map(|one| one.as_f64().expect("a number"))
                .collect()
        };
        if other["error"].as_f64().expect("a number") > 1e-9 {
            continue;
        }
        seen += 1;
        for (name, at) in names {
            let (one, two) = (&own[at], list(name));
            let scale = two.iter().fold(1.0, |most: f64, one| most.max(one.abs()));
            for (a, b) in one.iter().zip(&two) {
                assert!((a - b).abs() < most * scale, "{name}: {one:?} {two:?}");
            }
        }
    }
    assert!(seen > 24, "{seen}");
}

/// Accelerations and forces of Pinocchio's constrained dynamics.
#[test]
fn loops_move_as_those_of_pinocchio() {
    let test = "loops_move_as_those_of_pinocchio";
    let Some(python) = rc_test_support::python::packages("pinocchio", "pin==4.1.0\n", test) else {
        return;
    };
    let loops = loops(1.0);
    let other = answers(python, "loops.py", &loops.cases);
    compare(&loops, &other, [("accelerations", 0), ("forces", 1)], 1e-6);
}

/// At rest, because its constraints know no acceleration by velocities. They are soft: a percent is missing, and
/// more of the greatest forces.
#[test]
fn loops_move_as_equality_constraints_of_mujoco() {
    let test = "loops_move_as_equality_constraints_of_mujoco";
    let Some(python) = rc_test_support::python::packages("mujoco", "mujoco==4.0.0\n", test) else {
        return;
    };
    let loops = loops(0.0);
    let other = answers(python, "loops_mujoco.py", &loops.cases);
    compare(&loops, &other, [("accelerations", 0), ("efforts", 2)], 2e-2);
}
