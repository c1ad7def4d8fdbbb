//! How long printed solvers take, beside Pinocchio in C++: the same functions of the same robots, compiled with
//! the same optimisation, on one thread. Prints rows of Markdown.
//!
//! Arguments: a folder for programs, and an interpreter of Python that has the packages `pin`, `cmeel-eigen`,
//! `example-robot-data`, `casadi` and `ik-geo`. Then `mink` and `pink`, each before an interpreter that has it; each may
//! be missing.

mod differential;
mod peers;

use rc_diagnostics::{Format, SourceMap, render};
use rc_formula::Interpreter;
use rc_kinematics::{Cell, Solver};
use rc_syntax::MemoryLoader;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Runs of a block, and the blocks of each function.
const RUNS: usize = 2_000;
const BLOCKS: usize = 41;
/// Different positions of one block.
const STATES: usize = 64;

/// The greatest times as shares of those of Pinocchio: of motions, efforts and accelerations.
const GOALS: [f64; 3] = [0.6, 0.6, 0.8];
const GOALS_OF_HUMANOIDS: [f64; 3] = [0.8, 0.6, 0.8];

/// A robot, the frames whose poses and Jacobians are computed, and the frame in which they are.
struct Robot {
    name: &'static str,
    file: &'static str,
    base: &'static str,
    tips: &'static [&'static str],
    goals: [f64; 3],
}

const ROBOTS: [Robot; 2] = [
    Robot {
        name: "UR5, 6 joints, 1 frame",
        file: "ur_description/urdf/ur5_robot.urdf",
        base: "base_link",
        tips: &["tool0"],
        goals: GOALS,
    },
    Robot {
        name: "Unitree G1, 29 joints, 4 frames",
        file: "g1_description/urdf/g1_29dof_rev_1_0.urdf",
        base: "pelvis",
        tips: &[
            "left_rubber_hand",
            "right_rubber_hand",
            "left_ankle_roll_link",
            "right_ankle_roll_link",
        ],
        goals: GOALS_OF_HUMANOIDS,
    },
];

/// The functions, by their names in all programs.
const FUNCTIONS: [&str; 3] = ["fk", "efforts_of", "drive"];
const TITLES: [&str; 3] = [
    "poses and Jacobians",
    "efforts (RNEA)",
    "accelerations (ABA)",
];

fn cell(robot: &Robot, urdf: &str) -> Cell {
    let mut outputs = String::new();
    for tip in robot.tips {
        let base = robot.base;
        write!(outputs, "pose {tip} in {base}; jacobian {tip} in {base}; ").expect("a text");
    }
    let solvers = format!(
        "solver fk {{ {outputs} }}; solver efforts_of {{ efforts; }}; solver drive {{ accelerations; }};"
    );
    cell_of(urdf, &solvers)
}

/// A robot of 49 coordinates: a humanoid with hands, on a base that moves freely.
const GREAT: &str = "g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf";

/// How long printing takes for it, in s, and how long the C is, in KB.
const GOALS_OF_PRINTING: [f64; 2] = [1.0, 200.0];

/// The rows of printing for the great robot, and whether all goals are met.
fn printing(urdf: &str) -> (String, bool) {
    let [most_time, most_size] = GOALS_OF_PRINTING;
    let mut rows = String::from("| 49 joints | goal | measured | |\n|---|---|---|---|\n");
    let mut all_met = true;
    for (what, solvers) in [
        (
            "pose, Jacobian and efforts",
            "solver fk { pose left_wrist_yaw_link in floor; jacobian left_wrist_yaw_link in floor; }; solver efforts_of { efforts; };",
        ),
        ("accelerations", "solver drive { accelerations; };"),
    ] {
        let start = Instant::now();
        let cell = cell_of(urdf, &format!("floating pelvis in floor; {solvers}"));
        let size = rc_kinematics::c(&cell).len() as f64 / 1024.0;
        let time = start.elapsed().as_secs_f64();
        assert_eq!(cell.robot.coordinates.len(), 49);
        for (measure, goal, unit, own) in [
            ("printing", most_time, "s", time),
            ("the C", most_size, "KB", size),
        ] {
            let is_met = own <= goal;
            all_met &= is_met;
            writeln!(
                rows,
                "| {what}: {measure} | ≤ {goal} {unit} | {own:.2} {unit} | {} |",
                if is_met { "met" } else { "**missed**" }
            )
            .expect("a text");
        }
    }
    (rows, all_met)
}

fn cell_of(urdf: &str, solvers: &str) -> Cell {
    let text = format!("import \"robot.urdf\";\nKinematics cell {{ {solvers} }};");
    let mut sources = SourceMap::new();
    let source = sources.add("cell.kdsl", text);
    let loader = MemoryLoader::new([("robot.urdf", urdf)]);
    let (cell, found) = rc_kinematics::load(&mut sources, &loader, source);
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    cell.expect("a cell")
}

/// Numbers that all programs have.
fn states(count: usize) -> Vec<Vec<f64>> {
    let number = |at: usize| ((at as f64 * 0.754_877_666 + 0.3) % 1.0) * 2.0 - 1.0;
    (0..STATES)
        .map(|state| (0..count).map(|at| number(state * count + at)).collect())
        .collect()
}

/// The arrays that a solver takes: the same numbers for each of them.
fn arrays(solver: &Solver) -> usize {
    1 + usize::from(solver.takes_velocities)
        + usize::from(solver.takes_accelerations)
        + usize::from(solver.takes_efforts)
}

fn rust(cell: &Cell) -> String {
    let count = cell.robot.coordinates.len();
    let mut out = format!(
        "mod cell;\nuse std::hint::black_box;\nconst Q: [[f64; {count}]; {STATES}] = {:?};\nfn main() {{\n",
        states(count)
    );
    for solver in &cell.solvers {
        let passed = vec!["black_box(q)"; arrays(solver)].join(", ");
        write!(
            out,
            "    let mut times = Vec::new();\n    for _ in 0..{BLOCKS} {{\n        let start = std::time::Instant::now();\n\
            \x20       for run in 0..{RUNS} {{ let q = &Q[run % {STATES}]; black_box(cell::{name}({passed})); }}\n\
            \x20       times.push(start.elapsed().as_nanos() as f64 / {RUNS}.0);\n    }}\n\
            \x20   times.sort_by(f64::total_cmp);\n    println!(\"{name} {{}}\", times[{BLOCKS} / 2]);\n",
            name = solver.name
        )
        .expect("a text");
    }
    for inverse in &cell.inverses {
        let pose = &cell.solvers[0].outputs[0].name;
        write!(
            out,
            "    let poses: Vec<_> = Q.iter().map(|q| cell::fk(q).{pose}).collect();\n\
            \x20   for pose in &poses {{ assert!(cell::{name}(pose, &[0.0; {count}]).reached); }}\n\
            \x20   let mut times = Vec::new();\n    for _ in 0..{BLOCKS} {{\n        let start = std::time::Instant::now();\n\
            \x20       for run in 0..{RUNS} {{ black_box(cell::{name}(black_box(&poses[run % {STATES}]), &[0.0; {count}])); }}\n\
            \x20       times.push(start.elapsed().as_nanos() as f64 / {RUNS}.0);\n    }}\n\
            \x20   times.sort_by(f64::total_cmp);\n    println!(\"{name} {{}}\", times[{BLOCKS} / 2]);\n",
            name = inverse.name
        )
        .expect("a text");
    }
    out + "}\n"
}

/// A program in C or C++ around calls of functions.
fn around(begin: &str, calls: &[(&str, String)]) -> String {
    let mut out = format!(
        "#include <math.h>\n#include <stdio.h>\n#include <stdlib.h>\n#include <time.h>\n\
        static double now(void) {{ struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return t.tv_sec * 1e9 + t.tv_nsec; }}\n\
        static int less(const void *a, const void *b) {{ double x = *(const double *)a, y = *(const double *)b; return (x > y) - (x < y); }}\n\
        static double number(int at) {{ return fmod(at * 0.754877666 + 0.3, 1.0) * 2.0 - 1.0; }}\n\
        #define HIDE(p) __asm__ volatile(\"\" : : \"r\"(p) : \"memory\")\n{begin}\n\
        \x20   double *Q = (double *)malloc({STATES} * count * sizeof *Q);\n\
        \x20   for (int at = 0; at < {STATES} * count; at++) Q[at] = number(at);\n"
    );
    for (name, call) in calls {
        writeln!(
            out,
            "    {{ double times[{BLOCKS}]; for (int block = 0; block < {BLOCKS}; block++) {{ double start = now();\n\
            \x20     for (int run = 0; run < {RUNS}; run++) {{ const double *q = Q + run % {STATES} * count; HIDE(q); {call} }}\n\
            \x20     times[block] = (now() - start) / {RUNS}; }}\n\
            \x20     qsort(times, {BLOCKS}, sizeof times[0], less); printf(\"{name} %.17g\\n\", times[{BLOCKS} / 2]); }}"
        )
        .expect("a text");
    }
    out + "    return 0;\n}\n"
}

fn c(cell: &Cell) -> String {
    let calls: Vec<(&str, String)> = cell
        .solvers
        .iter()
        .map(|solver| {
            let name = &solver.name;
            let passed = "q, ".repeat(arrays(solver));
            (
                name.as_str(),
                format!("cell_{name}_result r; cell_{name}({passed}&r); HIDE(&r);"),
            )
        })
        .collect();
    let count = cell.robot.coordinates.len();
    let begin = format!("#include \"cell.h\"\nint main(void)\n{{\n    const int count = {count};");
    around(&begin, &calls)
}

/// The program of Pinocchio. Its arguments: the file of a model, and the names of frames.
fn pinocchio() -> String {
    let begin = "#include <pinocchio/multibody.hpp>\n#include <pinocchio/serialization.hpp>\n\
        #include <pinocchio/algorithm/jacobian.hpp>\n#include <pinocchio/algorithm/frames.hpp>\n\
        #include <pinocchio/algorithm/rnea.hpp>\n#include <pinocchio/algorithm/aba.hpp>\n\
        namespace p = pinocchio;\nint main(int arguments, char **words)\n{\n\
        \x20   p::Model model; model.loadFromText(words[1]);\n    p::Data data(model);\n    const int count = model.nq;\n\
        \x20   std::vector<p::FrameIndex> frames;\n\
        \x20   for (int at = 2; at < arguments; at++) frames.push_back(model.getFrameId(words[at], p::BODY));\n\
        \x20   std::vector<p::Data::Matrix6x> jacobians(frames.size(), p::Data::Matrix6x::Zero(6, model.nv));\n\
        \x20   typedef Eigen::Map<const Eigen::VectorXd> V;";
    let one = "V x(q, count); ";
    // A frame of one arm has its chain only, as the printed code does.
    let motion = "if (frames.size() == 1) { \
        p::computeFrameJacobian(model, data, x, frames[0], p::LOCAL_WORLD_ALIGNED, jacobians[0]); \
        p::updateFramePlacement(model, data, frames[0]); HIDE(&jacobians[0]); } else { \
        p::computeJointJacobians(model, data, x); for (size_t at = 0; at < frames.size(); at++) { \
        p::updateFramePlacement(model, data, frames[at]); \
        p::getFrameJacobian(model, data, frames[at], p::LOCAL_WORLD_ALIGNED, jacobians[at]); HIDE(&jacobians[at]); } } HIDE(&data);";
    let calls = [
        (FUNCTIONS[0], format!("{one}{motion}")),
        (
            FUNCTIONS[1],
            format!("{one}p::rnea(model, data, x, x, x); HIDE(&data);"),
        ),
        (
            FUNCTIONS[2],
            format!("{one}p::aba(model, data, x, x, x); HIDE(&data);"),
        ),
    ];
    around(begin, &calls)
}

/// The times of functions that a program prints.
fn times(command: &mut Command) -> BTreeMap<String, f64> {
    let output = command.output().expect("it starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    let text = String::from_utf8(output.stdout).expect("a text");
    let rows = text.lines().filter_map(|line| line.split_once(' '));
    rows.map(|(name, time)| (name.to_owned(), time.parse().expect("a number")))
        .collect()
}

/// Compiles a program, and says how long it takes.
fn compiled(words: &[&str]) -> f64 {
    let start = Instant::now();
    let output = Command::new(words[0]).args(&words[1..]).output();
    let output = output.expect("a compiler");
    let errors = String::from_utf8_lossy(&output.stderr);
    let errors: String = errors.chars().take(2_000).collect();
    assert!(output.status.success(), "{words:?}: {errors}");
    start.elapsed().as_secs_f64()
}

/// The time of a solver without printed code.
fn interpreted(solver: &Solver, count: usize) -> f64 {
    let mut interpreter = Interpreter::new(&solver.program).expect("no call");
    let mut output = vec![0.0; interpreter.outputs()];
    let inputs: Vec<Vec<f64>> = states(count).iter().map(|state| state.repeat(4)).collect();
    let mut times = Vec::new();
    for _ in 0..BLOCKS {
        let start = Instant::now();
        for run in 0..RUNS {
            let input = black_box(&inputs[run % STATES]);
            interpreter.run(input, &mut output).expect("numbers");
            black_box(&output);
        }
        times.push(start.elapsed().as_nanos() as f64 / RUNS as f64);
    }
    times.sort_by(f64::total_cmp);
    times[BLOCKS / 2]
}

fn main() {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [folder, python, others @ ..] = arguments.as_slice() else {
        panic!("a folder, and an interpreter");
    };
    let (others, rest) = others.as_chunks::<2>();
    assert!(rest.is_empty(), "an interpreter for each name");
    let others: Vec<(String, PathBuf)> = others
        .iter()
        .map(|[name, python]| (name.to_str().expect("a name").to_owned(), python.clone()))
        .collect();
    let place = Command::new(python)
        .args([
            "-c",
            "import sysconfig; print(sysconfig.get_path('purelib'))",
        ])
        .output();
    let place = String::from_utf8(place.expect("python").stdout).expect("a text");
    let prefix = Path::new(place.trim()).join("cmeel.prefix");
    std::fs::create_dir_all(folder).expect("a folder");
    let text = |path: &Path| path.to_str().expect("a text").to_owned();
    let at = |name: &str| text(&folder.join(name));
    let mut rows = String::from(
        "| | goal | Rust | C | Pinocchio | share | interpreted / Rust |\n|---|---|---|---|---|---|---|\n",
    );
    let mut facts = String::from(
        "| | printing | C | compiling C | sums, products, functions |\n|---|---|---|---|---|\n",
    );
    let mut met = true;
    // Once for all robots: it takes minutes.
    std::fs::write(at("pin.cpp"), pinocchio()).expect("a file");
    let libraries = prefix.join("lib");
    let include = format!("-I{}", text(&prefix.join("include")));
    let eigen = format!("-I{}", text(&prefix.join("include/eigen3")));
    let library = format!("-L{}", text(&libraries));
    compiled(&[
        "c++",
        "-std=c++17",
        "-O3",
        "-DNDEBUG",
        "-w",
        // As its CMake files say.
        "-DBOOST_FUSION_INVOKE_MAX_ARITY=10",
        "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
        "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
        &include,
        &eigen,
        &at("pin.cpp"),
        "-o",
        &at("in_cpp"),
        &library,
        "-lboost_serialization",
        "-lpinocchio_default",
        "-Wl,--allow-shlib-undefined",
    ]);
    for robot in &ROBOTS {
        let file = prefix
            .join("share/example-robot-data/robots")
            .join(robot.file);
        let urdf = std::fs::read_to_string(&file).expect("a robot");
        let start = Instant::now();
        let cell = cell(robot, &urdf);
        let header = rc_kinematics::c(&cell);
        let printing = start.elapsed();
        std::fs::write(at("cell.h"), &header).expect("a file");
        std::fs::write(at("cell.rs"), rc_kinematics::rust(&cell)).expect("a file");
        std::fs::write(at("main.rs"), rust(&cell)).expect("a file");
        std::fs::write(at("main.c"), c(&cell)).expect("a file");
        // The package has no headers of the parser.
        let model = folder.join("model.txt");
        let save = "import pinocchio, sys; pinocchio.buildModelFromUrdf(sys.argv[1]).saveToText(sys.argv[2])";
        compiled(&[&text(python), "-c", save, &text(&file), &text(&model)]);
        compiled(&[
            "rustc",
            "--edition=2021",
            "-Copt-level=3",
            &at("main.rs"),
            "-o",
            &at("in_rust"),
        ]);
        let compiling = compiled(&[
            "cc",
            "-O3",
            "-ffp-contract=off",
            &at("main.c"),
            "-o",
            &at("in_c"),
            "-lm",
        ]);
        let rust = times(&mut Command::new(folder.join("in_rust")));
        let c = times(&mut Command::new(folder.join("in_c")));
        let mut theirs = Command::new(folder.join("in_cpp"));
        theirs.arg(&model).args(robot.tips);
        let theirs = times(theirs.env("LD_LIBRARY_PATH", &libraries));
        for (at, name) in FUNCTIONS.into_iter().enumerate() {
            let solver = &cell.solvers[at];
            let slow = interpreted(solver, cell.robot.coordinates.len());
            let share = rust[name] / theirs[name];
            let is_met = share <= robot.goals[at];
            met &= is_met;
            writeln!(
                rows,
                "| {}: {} | ≤ {} | {:.0} ns | {:.0} ns | {:.0} ns | {share:.2} {} | {:.1} |",
                robot.name,
                TITLES[at],
                robot.goals[at],
                rust[name],
                c[name],
                theirs[name],
                if is_met { "met" } else { "**missed**" },
                slow / rust[name],
            )
            .expect("a text");
        }
        let work: Vec<String> = cell
            .solvers
            .iter()
            .map(|solver| {
                let work = solver.work();
                format!("{} + {} + {}", work.sums, work.products, work.functions)
            })
            .collect();
        writeln!(
            facts,
            "| {} | {:.2} s | {} KB | {compiling:.1} s | {} |",
            robot.name,
            printing.as_secs_f64(),
            header.len() / 1024,
            work.join("; ")
        )
        .expect("a text");
    }
    let robots = prefix.join("share/example-robot-data/robots");
    let urdf = robots.join(ROBOTS[0].file);
    let (beside, is_met) = peers::rows(&ROBOTS[0], &urdf, folder, python, &others);
    met &= is_met;
    let great = std::fs::read_to_string(robots.join(GREAT)).expect("a robot");
    let (great, is_met) = printing(&great);
    met &= is_met;
    print!("{rows}\n{facts}\n{beside}\n{great}");
    if !met {
        eprintln!("xtask: a goal was missed");
    }
}
