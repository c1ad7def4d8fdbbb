//! Inverse solvers with numbers of 32 bits.

use crate::inverse::{RANDOM, SEVEN, SIX};
use crate::load_with;
use crate::printed::{compiled, printed};
use rc_kinematics::{Cell, Question};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

fn cell(name: &str, robot: &str, choices: &str, reach: &str) -> Cell {
    let text = format!(
        "import \"arm.urdf\"; Kinematics {name} {{ {choices} posture home {{ }};
        solver fk {{ pose tool in base; }};
        solver reach {{ inverse pose tool in base; within limits; {reach} }};
        solver loose {{ inverse pose forearm in base; restarts 2; tolerance 1 mm 0.1 deg; }};
        solver push {{ inverse velocity tool in base; within limits; period 1 ms; damped 0.02; null posture home; }}; }};"
    );
    // The other robot has other names.
    let robot = robot.replace("\"l4\"", "\"forearm\"");
    let (cell, found) = load_with(&text, &robot);
    assert_eq!(found, "");
    cell.expect("a cell")
}

/// Runs an optimised program beside these cells.
fn run(folder: &Path, cells: &[&Cell], main: &str) -> Vec<f64> {
    let mut text = String::new();
    for cell in cells {
        let file = folder.join(format!("{}.rs", cell.name));
        std::fs::write(file, rc_kinematics::rust(cell)).expect("a file");
        writeln!(text, "mod {};", cell.name).expect("a text");
    }
    let source = folder.join("main.rs");
    std::fs::write(&source, text + RANDOM + main).expect("a file");
    let program = folder.join("in_rust");
    let options = ["--edition=2021", "-Dwarnings", "-O"];
    compiled("rustc", &options, &source, &program);
    printed(&mut Command::new(program))
}

/// Prints how many of 2,000 poses both find, and how often with the same positions; how far the frame really is from the pose and by
/// which angle it is turned, and how far from that the result says it is. Then for 30 poses out of reach how many are said to be,
/// and how much farther the positions are than those of 64 bits. Then by how much the velocities of the frame differ.
const BESIDE: &str = "
const N: usize = wide::JOINTS.len();
fn single<const M: usize>(of: &[f64; M]) -> [f32; M] { of.map(|number| number as f32) }
fn matrix(of: &[[f64; 4]; 4]) -> [[f32; 4]; 4] { [single(&of[0]), single(&of[1]), single(&of[2]), single(&of[3])] }
fn apart(one: &[[f64; 4]; 4], other: &[[f64; 4]; 4]) -> (f64, f64) {
    let (mut way, mut turn) = (0.0, 0.0);
    for row in 0..3 {
        way += (one[row][3] - other[row][3]).powi(2);
        for column in 0..3 { turn += (one[row][column] - other[row][column]).powi(2); }
    }
    (way.sqrt(), 2.0 * (turn / 8.0).sqrt().min(1.0).asin())
}
fn some(random: &mut Random) -> [f64; N] {
    std::array::from_fn(|at| {
        let (lower, upper) = (wide::LOWER[at].max(-3.0), wide::UPPER[at].min(3.0));
        lower + random.next() * (upper - lower)
    })
}
fn main() {
    let random = &mut Random(0x44_1234_5678);
    let (mut found, mut exact, mut same) = (0, 0, 0);
    let (mut distance, mut angle, mut wrong) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..2000 {
        let target = wide::fk(&some(random)).pose_tool_in_base;
        let last = some(random);
        let answer = narrow::reach(&narrow::Pose::new(matrix(&target)), &single(&last));
        assert_eq!(answer, narrow::reach(&narrow::Pose::new(matrix(&target)), &single(&last)));
        let other = wide::reach(&target, &last);
        let positions = answer.positions.map(f64::from);
        for at in 0..N {
            assert!(positions[at] >= wide::LOWER[at] && positions[at] <= wide::UPPER[at], \"beyond a limit\");
        }
        let (way, turn) = apart(&wide::fk(&positions).pose_tool_in_base, &target);
        wrong = wrong.max((way - answer.distance as f64).abs()).max((turn - answer.angle as f64).abs());
        exact += other.reached as usize;
        if answer.reached {
            found += 1;
            (distance, angle) = (distance.max(way), angle.max(turn));
            let far = (0..N).map(|at| (positions[at] - other.positions[at]).abs()).fold(0.0, f64::max);
            same += (far < 1e-2) as usize;
        }
    }
    println!(\"{found}\\n{exact}\\n{same}\\n{distance}\\n{angle}\\n{wrong}\");
    let (mut said, mut worst) = (0, 0.0f64);
    for _ in 0..30 {
        let mut target = wide::fk(&some(random)).pose_tool_in_base;
        let length = (target[0][3].powi(2) + target[1][3].powi(2) + target[2][3].powi(2)).sqrt();
        let stretch = (1.7 + random.next()) / length;
        for row in &mut target[..3] { row[3] *= stretch; }
        let last = some(random);
        let answer = narrow::reach(&narrow::Pose::new(matrix(&target)), &single(&last));
        let other = wide::reach(&target, &last);
        said += (!answer.reached && answer.distance > 1e-3) as usize;
        worst = worst.max((answer.distance as f64).hypot(answer.angle as f64) / other.distance.hypot(other.angle));
    }
    println!(\"{said}\\n{worst}\");
    let mut differ = 0.0f64;
    for round in 0..500 {
        let mut at = some(random);
        if round % 3 == 0 { at[1] = narrow::LOWER[1] as f64; }
        let wish: [f64; 6] = std::array::from_fn(|_| random.next() - 0.5);
        let answer = narrow::push(&single(&at), &single(&wish));
        let other = wide::push(&single(&at).map(f64::from), &single(&wish).map(f64::from));
        for row in 0..6 { differ = differ.max((answer.achieved[row] as f64 - other.achieved[row]).abs()); }
        for joint in 0..N {
            let next = single(&at)[joint] as f64 + 1e-3 * answer.velocities[joint] as f64;
            assert!(next >= wide::LOWER[joint] - 1e-6 && next <= wide::UPPER[joint] + 1e-6, \"beyond a limit\");
        }
    }
    println!(\"{differ}\");
}
";

/// Poses of a UR5 and of an arm with seven joints, within the tolerance that a file has without one, and within the least one.
#[test]
fn poses_are_found_with_32_bits() {
    let (usual, least) = ("tolerance 1e-5 m 1e-5 rad;", "tolerance 6e-6 m 4e-6 rad;");
    for (name, robot, [tolerance, own]) in [
        ("six", SIX, [usual, ""]),
        ("six", SIX, [least; 2]),
        ("seven", SEVEN, [usual, ""]),
        ("seven", SEVEN, [least; 2]),
    ] {
        let wide = cell("wide", robot, "", tolerance);
        let narrow = cell("narrow", robot, "scalars f32;", own);
        let folder = tempfile::tempdir().expect("a folder");
        let numbers = run(folder.path(), &[&wide, &narrow], BESIDE);
        let &[
            found,
            exact,
            same,
            distance,
            angle,
            wrong,
            said,
            worst,
            differ,
        ] = numbers.as_slice()
        else {
            panic!("{numbers:?}");
        };
        assert!(found >= 1998.0 && exact >= 1998.0, "{name}: {numbers:?}");
        assert!(same >= 0.95 * found, "{name}: {numbers:?}");
        // The rounding of 32 bits is less than the least tolerance.
        let most = 1e-5 + 4e-6;
        assert!(distance < most && angle < most, "{name}: {numbers:?}");
        assert!(wrong < 4e-6, "{name}: {numbers:?}");
        assert!(said == 30.0 && worst < 1.01, "{name}: {numbers:?}");
        assert!(differ < 1e-2, "{name}: {numbers:?}");
    }
}

/// In millimetres, a search with 32 bits finds the same poses, within the tolerance that a file has without one.
#[test]
fn poses_in_millimetres_are_found_with_32_bits() {
    let main = "
fn main() {
    let random = &mut Random(5);
    let (mut found, mut worst, mut wrong) = (0, 0.0f64, 0.0f64);
    for _ in 0..1000 {
        let mut some = || -> [f64; wide::JOINTS.len()] {
            std::array::from_fn(|at| wide::LOWER[at].max(-3.0) + random.next() * (wide::UPPER[at].min(3.0) - wide::LOWER[at].max(-3.0)))
        };
        let target = wide::fk(&some()).pose_tool_in_base;
        let last = some().map(|at| at as f32);
        let mut given = target.map(|row| row.map(|part| part as f32));
        for row in 0..3 { given[row][3] = (1000.0 * target[row][3]) as f32; }
        let answer = narrow::reach(&narrow::Pose::new(given), &last);
        let pose = wide::fk(&answer.positions.map(f64::from)).pose_tool_in_base;
        let way = (0..3).map(|row| (pose[row][3] - target[row][3]).powi(2)).sum::<f64>().sqrt();
        found += answer.reached as usize;
        if answer.reached { worst = worst.max(way); wrong = wrong.max((way - 1e-3 * answer.distance as f64).abs()); }
    }
    println!(\"{found}\\n{worst}\\n{wrong}\");
}
";
    for robot in [SIX, SEVEN] {
        let wide = cell("wide", robot, "", "");
        let text = "import \"arm.urdf\"; Kinematics narrow { scalars f32; lengths mm;
            solver fk { pose tool in base; }; solver reach { inverse pose tool in base; within limits; }; };";
        let (narrow, told) = load_with(text, robot);
        assert_eq!(told, "");
        let folder = tempfile::tempdir().expect("a folder");
        let narrow = narrow.expect("a cell");
        let numbers = run(folder.path(), &[&wide, &narrow], main);
        assert!(numbers[0] >= 999.0, "{numbers:?}");
        assert!(numbers[1] < 1.4e-5 && numbers[2] < 4e-6, "{numbers:?}");
    }
}

/// A straight elbow: by rounding, the pose is as often beyond the edge of reach. The closed form has it, so that no search is needed.
#[test]
fn poses_at_the_edge_of_reach_have_the_closed_form() {
    let (wide, narrow) = (
        cell("wide", SIX, "", ""),
        cell("narrow", SIX, "scalars f32;", ""),
    );
    let main = "
fn main() {
    let random = &mut Random(11);
    for _ in 0..100 {
        let mut some = || -> [f64; 6] { std::array::from_fn(|_| random.next() * 6.0 - 3.0) };
        let (mut from, last) = (some(), some());
        from[2] = 0.0;
        let target = wide::fk(&from).pose_tool_in_base.map(|row| row.map(|part| part as f32));
        let answer = narrow::reach(&narrow::Pose::new(target), &last.map(|at| at as f32));
        assert!(answer.reached);
        println!(\"{}\", answer.iterations);
    }
}
";
    let folder = tempfile::tempdir().expect("a folder");
    let mut numbers = run(folder.path(), &[&wide, &narrow], main);
    numbers.sort_unstable_by(f64::total_cmp);
    assert!(numbers[90] <= 2.0, "{numbers:?}");
}

/// Joints without an end that are many turns away: the result is that of the positions there.
#[test]
fn positions_far_from_0_are_not_called_reached() {
    let endless = SIX.replace("type=\"revolute\"", "type=\"continuous\"");
    // Without a closed form, which has the turns from the beginning.
    let elbow = "0.425\" rpy=\"0 0 0\"";
    assert!(endless.contains(elbow));
    let endless = endless.replace(elbow, "0.425\" rpy=\"0.01 0 0\"");
    let wide = cell("wide", &endless, "", "");
    let narrow = cell("narrow", &endless, "scalars f32;", "");
    let main = "
fn main() {
    let random = &mut Random(7);
    for turns in [0.0, 1e1, 1e4] {
        let (mut found, mut wrong) = (0, 0.0f64);
        for _ in 0..100 {
            let mut some = || -> [f64; 6] { std::array::from_fn(|_| random.next() * 6.0 - 3.0) };
            let target = wide::fk(&some()).pose_tool_in_base;
            let last = some().map(|at| (at + turns * std::f64::consts::TAU) as f32);
            let answer = narrow::reach(&narrow::Pose::new(target.map(|row| row.map(|part| part as f32))), &last);
            let pose = wide::fk(&answer.positions.map(f64::from)).pose_tool_in_base;
            let way = (0..3).map(|row| (pose[row][3] - target[row][3]).powi(2)).sum::<f64>().sqrt();
            found += answer.reached as usize;
            if answer.reached { wrong = wrong.max(way); }
        }
        println!(\"{found}\\n{wrong}\");
    }
}
";
    let folder = tempfile::tempdir().expect("a folder");
    let numbers = run(folder.path(), &[&wide, &narrow], main);
    let wrong = numbers.iter().skip(1).step_by(2);
    assert!(wrong.copied().all(|way| way < 1.4e-5), "{numbers:?}");
    // A position has steps of 0.004 rad there.
    assert!(numbers[0] >= 99.0 && numbers[4] < 1.0, "{numbers:?}");
}

#[expect(clippy::cast_possible_truncation, reason = "rounded on purpose")]
fn list(numbers: &[f64], end: &str) -> String {
    let words = numbers
        .iter()
        .map(|number| format!("{:?}{end}", *number as f32));
    words.collect::<Vec<_>>().join(", ")
}

/// With a closed form, without one, and velocities.
#[test]
fn c_and_rust_have_equal_bits_of_32() {
    let mut cell = cell("six", SIX, "scalars f32;", "restarts 5;");
    cell.name = "six".to_owned();
    let mut random = fastrand::Rng::with_seed(32);
    let mut some = |count: usize, far: f64| -> Vec<f64> {
        (0..count)
            .map(|_| (random.f64() * 2.0 - 1.0) * far)
            .collect()
    };
    let mut rust = String::from("fn main() {\n");
    let mut c = String::from(
        "#include <stdint.h>\n#include <stdio.h>\n#include <string.h>\n#include \"six.h\"\n
static void print(const float *all, int count)
{
    for (int at = 0; at < count; at++) { uint32_t bits; memcpy(&bits, all + at, 4); printf(\"%u\\n\", (unsigned)bits); }
}
int main(void)
{
    (void)six_joints; (void)six_lower; (void)six_upper;\n",
    );
    for round in 0..12 {
        let state = rc_robot::State::still(some(6, 3.0));
        let mut pose = cell.solvers[0].run(&state, &[0.0; 6], &[]).expect("a pose");
        if round % 4 == 3 {
            // Out of reach.
            for place in [3, 7, 11] {
                pose[place] *= 3.0;
            }
        }
        let (last, velocity) = (some(6, 3.0), some(6, 1.0));
        // What a compiler knows, it computes on its own.
        let _ = writeln!(
            c,
            "    {{ volatile float given[28] = {{{}, {}, {}}}; float target[4][4], last[6], velocity[6];
        for (int at = 0; at < 16; at++) target[at / 4][at % 4] = given[at];
        for (int at = 0; at < 6; at++) {{ last[at] = given[16 + at]; velocity[at] = given[22 + at]; }}",
            list(&pose, "f"),
            list(&last, "f"),
            list(&velocity, "f")
        );
        let rows: Vec<String> = pose
            .chunks(4)
            .map(|row| format!("[{}]", list(row, "")))
            .collect();
        let _ = writeln!(
            rust,
            "    let (target, last, velocity) = std::hint::black_box(([{}], [{}], [{}]));",
            rows.join(", "),
            list(&last, ""),
            list(&velocity, "")
        );
        for inverse in &cell.inverses {
            let name = &inverse.name;
            let (call, fields) = match &inverse.asked {
                Question::Pose(_) => ("target, last", "r.positions, &[r.distance], &[r.angle]"),
                Question::Velocity(_) => ("last, velocity", "r.velocities, &r.achieved"),
            };
            let in_c = match &inverse.asked {
                Question::Pose(_) => {
                    "print(r.positions, 6); print(&r.distance, 1); print(&r.angle, 1); \
                    printf(\"%d\\n%d\\n\", r.reached, r.iterations);"
                }
                Question::Velocity(_) => "print(r.velocities, 6); print(r.achieved, 6);",
            };
            let _ = writeln!(
                c,
                "        {{ six_{name}_result r; six_{name}({call}, &r); {in_c} }}"
            );
            let _ = writeln!(
                rust,
                "    let r = six::{name}(&{});\n    let all: &[&[f32]] = &[&{fields}];\n    \
                all.concat().iter().for_each(|number| println!(\"{{}}\", number.to_bits()));",
                call.replace(", ", ", &")
                    .replace("target", "six::Pose::new(target)")
            );
            if let Question::Pose(_) = &inverse.asked {
                rust.push_str("    println!(\"{}\\n{}\", r.reached as u8, r.iterations);\n");
            }
        }
        c.push_str("    }\n");
    }
    c.push_str("    return 0;\n}\n");
    rust.push_str("    let _ = Random(1).next();\n}\n");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("six.h"), rc_kinematics::c(&cell)).expect("a file");
    std::fs::write(at("main.c"), c).expect("a file");
    let options = [
        "-std=c99",
        "-O2",
        "-Wall",
        "-Wextra",
        "-pedantic",
        "-Wdouble-promotion",
        "-Wfloat-conversion",
        "-Werror",
        "-ffp-contract=off",
    ];
    compiled("cc", &options, &at("main.c"), &at("in_c"));
    let in_c = printed(&mut Command::new(at("in_c")));
    let in_rust = run(folder.path(), &[&cell], &rust);
    assert_eq!(in_c.len(), 12 * (10 + 10 + 12));
    assert_eq!(in_c, in_rust);
}

/// What 32 bits do not resolve is told with the least number.
#[test]
fn settings_below_rounding_are_told() {
    for (solver, what) in [
        (
            "inverse pose tool in base; tolerance 1e-6 m 1e-5 rad;",
            "to 1000 m, found 0.000001",
        ),
        (
            "inverse pose tool in base; tolerance 1e-5 m 1e-6 rad;",
            "expected a number from 4e-6 to 1000 rad, found 0.000001",
        ),
        (
            "inverse velocity tool in base; damped 0.001;",
            "expected a number from 3e-3 to 1000",
        ),
    ] {
        let text = |choices: &str| {
            format!(
                "import \"arm.urdf\"; Kinematics cell {{ {choices} solver s {{ {solver} }}; }};"
            )
        };
        let (_, found) = load_with(&text("scalars f32;"), SIX);
        assert!(
            found.contains("error[bad-value]") && found.contains(what),
            "{found}"
        );
        assert_eq!(load_with(&text(""), SIX).1, "");
    }
    // An arm with a long link has another tolerance.
    let far = cell("six", SIX, "scalars f32;", "");
    let long = SIX.replace("0.425\"", "42.5\"");
    let near = |cell: &Cell| match &cell.inverses[0].asked {
        Question::Pose(search) => search.near,
        Question::Velocity(_) => 0.0,
    };
    assert!((near(&far) - 1e-5).abs() < 1e-12);
    assert!(near(&cell("six", &long, "scalars f32;", "")) > 1e-4);
}
