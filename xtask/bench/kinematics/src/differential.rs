//! The positions of one arm for poses, beside the differential inverse kinematics of `mink` (`MuJoCo`) and
//! `pink` (Pinocchio).
//!
//! Both are Python, and so is the loop that their users write around them: `beside_differential.py` has it, and its options.
//! They search from one beginning, and do not find each pose. The printed solver is compiled, begins with a closed form,
//! and searches again from other beginnings. So a row has the successes of both, and the mean times of those poses that
//! both find.

use crate::{BLOCKS, Robot, cell_of, compiled, times};
use rc_formula::Interpreter;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The greatest time as a share of theirs.
pub(crate) const GOAL: f64 = 0.1;

/// The poses. The positions that they are from are anywhere in a turn of each joint.
const POSES: usize = 200;

/// Where each search begins: an elbow and a wrist that are bent.
const START: [f64; 6] = [0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, -FRAC_PI_2, 0.0];

/// Calls of a block for one pose.
const RUNS: usize = 50;

/// How many steps their loops take at most; those that find a pose take about nine.
const STEPS: usize = 100;

/// How often their loops search for each pose.
const ROUNDS: usize = 9;

/// A row: what is compared, and the times of both in ns.
pub(crate) type Measured = (String, f64, f64);

/// Positions that fill the turns of all joints evenly: the sequence of M. Roberts, "The unreasonable
/// effectiveness of quasirandom sequences" (2018).
fn positions() -> Vec<[f64; 6]> {
    let ratio = (0..100).fold(2.0_f64, |ratio, _| (1.0 + ratio).powf(1.0 / 7.0));
    let number = |state: usize, joint: i32| (0.5 + state as f64 * ratio.powi(-joint)) % 1.0;
    (1..=POSES)
        .map(|state| std::array::from_fn(|at| (2.0 * number(state, at as i32 + 1) - 1.0) * PI))
        .collect()
}

/// Prints the time of each pose that the printed solver finds.
fn program(poses: &[Vec<f64>]) -> String {
    let rows: Vec<[&[f64]; 4]> = poses
        .iter()
        .map(|pose| std::array::from_fn(|row| &pose[4 * row..4 * row + 4]))
        .collect();
    format!(
        "mod cell;\nuse std::hint::black_box;\nconst POSES: [[[f64; 4]; 4]; {POSES}] = {rows:?};\nconst START: [f64; 6] = {START:?};\n\
        fn main() {{\n    for (at, pose) in POSES.iter().enumerate() {{\n        let pose = &cell::Pose::new(*pose);\n        if !cell::reach(pose, &START).reached {{ continue; }}\n\
        \x20       let mut times = Vec::new();\n        for _ in 0..{BLOCKS} {{\n            let start = std::time::Instant::now();\n\
        \x20           for _ in 0..{RUNS} {{ black_box(cell::reach(black_box(pose), &START)); }}\n\
        \x20           times.push(start.elapsed().as_nanos() as f64 / {RUNS}.0);\n        }}\n\
        \x20       times.sort_by(f64::total_cmp);\n        println!(\"pose_{{at}} {{}}\", times[{BLOCKS} / 2]);\n    }}\n}}\n"
    )
}

/// Compares the printed solver with each of the packages, which has a name, and an interpreter that has it.
pub(crate) fn rows(
    robot: &Robot,
    urdf: &Path,
    folder: &Path,
    packages: &[(String, PathBuf)],
) -> Vec<Measured> {
    let at = |name: &str| folder.join(name).to_str().expect("a text").to_owned();
    let text = std::fs::read_to_string(urdf).expect("a robot");
    let (tip, base) = (robot.tips[0], robot.base);
    let asked = format!(
        "solver fk {{ pose {tip} in {base}; }};\
        solver reach {{ inverse pose {tip} in {base}; within limits; seed last; tolerance 1e-6 m 1e-6 rad; }};"
    );
    let cell = cell_of(&text, &asked);
    let mut motion = Interpreter::new(&cell.solvers[0].program).expect("no call");
    let (mut poses, mut lines) = (Vec::new(), String::new());
    for positions in positions() {
        let mut pose = vec![0.0; motion.outputs()];
        let mut input = vec![0.0; motion.inputs()];
        input[..positions.len()].copy_from_slice(&positions);
        motion.run(&input, &mut pose).expect("numbers");
        for number in positions.iter().chain(&pose) {
            write!(lines, "{number:?} ").expect("a text");
        }
        lines.push('\n');
        poses.push(pose);
    }
    std::fs::write(at("poses.txt"), lines).expect("a file");
    std::fs::write(at("cell.rs"), rc_kinematics::rust(&cell)).expect("a file");
    std::fs::write(at("main.rs"), program(&poses)).expect("a file");
    let words = ["rustc", "--edition=2021", "-Copt-level=3"];
    compiled(&[&words[..], &[&at("main.rs"), "-o", &at("own_poses")]].concat());
    let own = times(&mut Command::new(at("own_poses")));

    let script = at("beside_differential.py");
    std::fs::write(&script, include_str!("beside_differential.py")).expect("a file");
    let start = START.map(|number| format!("{number:?}")).join(",");
    let row = |(name, python): &(String, PathBuf)| {
        let mut command = Command::new(python);
        command.arg(&script).arg(name).arg(urdf);
        command.args([base, tip, at("poses.txt").as_str(), start.as_str()]);
        command.args([STEPS, ROUNDS].map(|count| count.to_string()));
        let theirs = times(&mut command);
        let mean = |times: &BTreeMap<String, f64>| {
            let both = times.iter().filter(|(pose, _)| {
                own.contains_key(pose.as_str()) && theirs.contains_key(pose.as_str())
            });
            let times: Vec<f64> = both.map(|(_, time)| *time).collect();
            times.iter().sum::<f64>() / times.len() as f64
        };
        let what = format!(
            "positions for a pose, `{name}` in Python, {} and {} of {POSES} found",
            own.len(),
            theirs.len()
        );
        (what, mean(&own), mean(&theirs))
    };
    packages.iter().map(row).collect()
}
