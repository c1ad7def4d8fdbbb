//! One arm beside CasADi in C, beside the crate `k`, and beside the package `ik-geo`, whose Rust is called from Python: the crate needs
//! CMake for a library of C++. Also beside the packages of [`differential`].

use crate::differential;
use crate::{BLOCKS, RUNS, Robot, STATES, around, c, cell_of, compiled, rust, states, times};
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// The greatest times as shares of those of CasADi's C, of its compilation, of `k`, and of `ik-geo`.
const GOALS: [f64; 4] = [1.0, 0.2, 0.3, 1.2];

/// How often a program is compiled: the least time counts.
const COMPILATIONS: usize = 5;

/// The median time of a call, in ns.
fn median(mut call: impl FnMut(usize)) -> f64 {
    let mut times = Vec::new();
    for _ in 0..BLOCKS {
        let start = Instant::now();
        for run in 0..RUNS {
            call(run % STATES);
        }
        times.push(start.elapsed().as_nanos() as f64 / RUNS as f64);
    }
    times.sort_by(f64::total_cmp);
    times[BLOCKS / 2]
}

/// The time of the pose and the Jacobian by `k`.
fn by_k(urdf: &str, tip: &str) -> f64 {
    let chain = k::Chain::<f64>::from_urdf_file(urdf).expect("a URDF");
    let end = chain.find_link(tip).expect("a link");
    let arm = k::SerialChain::from_end(end);
    let positions = states(6);
    median(|state| {
        arm.set_joint_positions_unchecked(black_box(&positions[state]));
        black_box(k::jacobian(&arm));
        black_box(arm.end_transform());
    })
}

/// Rows of Markdown, and whether all goals are met. `others` are the packages of [`differential`], and their
/// interpreters.
pub(crate) fn rows(
    robot: &Robot,
    urdf: &Path,
    folder: &Path,
    python: &Path,
    others: &[(String, PathBuf)],
) -> (String, bool) {
    let at = |name: &str| folder.join(name).to_str().expect("a text").to_owned();
    let text = std::fs::read_to_string(urdf).expect("a robot");
    let (tip, base) = (robot.tips[0], robot.base);
    let motion = format!("solver fk {{ pose {tip} in {base}; jacobian {tip} in {base}; }};");
    let forward = cell_of(&text, &motion);
    std::fs::write(at("cell.h"), rc_kinematics::c(&forward)).expect("a file");
    std::fs::write(at("main.c"), c(&forward)).expect("a file");
    let options = ["cc", "-O3", "-ffp-contract=off", "-w"];
    let build = |source: &str, program: &str| {
        let words = [&options[..], &[source, "-o", program, "-lm"]].concat();
        let times = (0..COMPILATIONS).map(|_| compiled(&words));
        times.fold(f64::INFINITY, f64::min)
    };
    // The program around the functions takes the compiler longer than they do.
    let nothing = around("int main(void)\n{\n    const int count = 6;", &[]);
    std::fs::write(at("main_nothing.c"), nothing).expect("a file");
    let frame = build(&at("main_nothing.c"), &at("nothing"));
    let own_compiling = build(&at("main.c"), &at("own_c"));
    let own = times(&mut Command::new(at("own_c")))["fk"];

    let script = at("beside_casadi.py");
    std::fs::write(&script, include_str!("beside_casadi.py")).expect("a file");
    let urdf = urdf.to_str().expect("a text");
    let made = times(Command::new(python).args([&script, urdf, tip, &at("casadi_fk.c")]));
    let begin = format!(
        "#include \"casadi_fk.c\"\nint main(void)\n{{\n    const int count = 6; static double work[{}];",
        made["work"]
    );
    let call = "const double *taken[1] = {q}; double r[48]; double *given[3] = {r, r + 9, r + 12}; \
        casadi_fk(taken, given, 0, work, 0); HIDE(r);";
    let program = around(&begin, &[("fk", call.to_owned())]);
    std::fs::write(at("main_casadi.c"), program).expect("a file");
    let compiling = build(&at("main_casadi.c"), &at("in_casadi"));
    let theirs = times(&mut Command::new(at("in_casadi")))["fk"];

    let asked =
        format!("{motion} solver reach {{ inverse pose {tip} in {base}; within limits; }};");
    let both = cell_of(&text, &asked);
    std::fs::write(at("cell.rs"), rc_kinematics::rust(&both)).expect("a file");
    std::fs::write(at("main.rs"), rust(&both)).expect("a file");
    let words = ["rustc", "--edition=2021", "-Copt-level=3"];
    compiled(&[&words[..], &[&at("main.rs"), "-o", &at("own_rust")]].concat());
    let in_rust = times(&mut Command::new(at("own_rust")));
    let k = by_k(urdf, tip);
    let script = at("beside_ik_geo.py");
    std::fs::write(&script, include_str!("beside_ik_geo.py")).expect("a file");
    let mut geo = Command::new(python);
    geo.arg(&script);
    geo.args([RUNS, BLOCKS, STATES].map(|count| count.to_string()));
    let geo = times(&mut geo)["reach"];
    let in_python = differential::rows(robot, Path::new(urdf), folder, others);
    let measured = [
        ("pose and Jacobian in C, CasADi", own, theirs, "ns"),
        (
            "compiling it, without the program around it",
            (own_compiling - frame) * 1e3,
            (compiling - frame) * 1e3,
            "ms",
        ),
        ("pose and Jacobian, `k`", in_rust["fk"], k, "ns"),
        (
            "positions for a pose, `ik-geo` from Python",
            in_rust["reach"],
            geo,
            "ns",
        ),
    ];
    let (mut rows, mut met) = (String::new(), true);
    rows.push_str("| UR5 beside | goal | own | other | share |\n|---|---|---|---|---|\n");
    let measured = measured
        .into_iter()
        .zip(GOALS)
        .map(|((what, own, other, unit), goal)| (what.to_owned(), own, other, unit, goal));
    let in_python = in_python
        .into_iter()
        .map(|(what, own, other)| (what, own, other, "ns", differential::GOAL));
    for (what, own, other, unit, goal) in measured.chain(in_python) {
        let share = own / other;
        met &= share <= goal;
        // A share that is not rounded to nothing.
        let digits = if share < 0.01 { 4 } else { 2 };
        let verdict = if share <= goal { "met" } else { "**missed**" };
        writeln!(
            rows,
            "| {what} | ≤ {goal} | {own:.0} {unit} | {other:.0} {unit} | {share:.digits$} {verdict} |"
        )
        .expect("a text");
    }
    (rows, met)
}
