//! Printed code computes what the algorithms compute.

use crate::load;
use rc_kinematics::{Cell, PAYLOAD, Solver};
use rc_quantity::rotation::Quaternion;
use rc_robot::{State, dynamics};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

const TEXT: &str = r#"import "arm.urdf";
Kinematics cell
{
    // Where the tool is, and how it moves.
    solver fk { pose "tool-0" in base; jacobian "tool-0" in base; jacobian finger in slide expressed in base; pose finger in slide as quaternion; };
    solver motion { velocity "tool-0" in base expressed in "tool-0"; acceleration finger in shoulder; };
    solver hold { efforts; mass_matrix; gravity 0, 0, -1.62; };
    solver still { pose base in base; };
    solver drive { accelerations; mass_matrix; efforts; payload part at "tool-0"; };
};
"#;

fn cell() -> Cell {
    let (cell, found) = load(TEXT);
    assert_eq!(found, "");
    cell.expect("a cell")
}

/// A mass that the tool carries.
const PART: [f64; PAYLOAD] = [
    1.3, 0.02, -0.01, 0.2, 0.02, 0.001, -0.002, 0.03, 0.003, 0.015,
];

/// The numbers of the payloads of a solver.
fn payloads(solver: &Solver) -> &'static [f64] {
    if solver.payloads.is_empty() {
        &[]
    } else {
        &PART
    }
}

/// The output of a solver; the numbers of velocities also represent efforts.
fn run(solver: &Solver, state: &State) -> Vec<f64> {
    let numbers = solver.run(state, &state.velocities, payloads(solver));
    numbers.expect("as many joints")
}

fn states(count: usize) -> Vec<State> {
    states_of(count, 3)
}

fn states_of(count: usize, joints: usize) -> Vec<State> {
    let mut random = fastrand::Rng::with_seed(44);
    let mut some = || (0..joints).map(|_| random.f64() * 4.0 - 2.0).collect();
    (0..count)
        .map(|_| State {
            positions: some(),
            velocities: some(),
            accelerations: some(),
        })
        .collect()
}

/// All numbers of all solvers for some states.
fn expected(cell: &Cell, states: &[State]) -> Vec<f64> {
    let mut out = Vec::new();
    for state in states {
        for solver in &cell.solvers {
            out.extend(run(solver, state));
        }
    }
    out
}

/// Robots with thirty joints have ten thousand operations.
#[test]
fn c_has_few_bytes_for_each_operation() {
    let text = "import \"arm.urdf\"; Kinematics cell { solver drive { accelerations; mass_matrix; efforts; }; };";
    let (cell, found) = crate::load_with(text, include_str!("../robots/seven.urdf"));
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let work = cell.solvers[0].work();
    let operations = work.sums + work.products + work.functions;
    let bytes = rc_kinematics::c(&cell).len();
    assert!(
        bytes < 12 * operations,
        "{bytes} bytes, {operations} operations"
    );
}

#[test]
fn recorded_formulas_are_the_algorithms() {
    let cell = cell();
    let robot = &cell.robot;
    let names = |solver: &Solver| {
        solver
            .outputs
            .iter()
            .map(|o| o.name.clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(
        names(&cell.solvers[0])[2],
        "jacobian_finger_in_slide_expressed_in_base"
    );
    assert_eq!(robot.coordinates, ["turn", "reach", "bend"]);
    let body = |name| robot.body(name).expect("a link");
    for state in states(50) {
        let near = |one: &[f64], other: &[f64]| {
            assert_eq!(one.len(), other.len());
            for (a, b) in one.iter().zip(other) {
                assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} {b}");
            }
        };
        let chain = robot
            .chain(body("base"), body("tool-0"))
            .expect("no free joint");
        let moved = chain.moved(&state);
        let numbers = run(&cell.solvers[0], &state);
        let place = [numbers[3], numbers[7], numbers[11]];
        near(&place, &moved.pose.translation);
        assert_eq!(numbers[12..16], [0.0, 0.0, 0.0, 1.0]);
        // The quaternion is the rotation of the chain.
        let chain = robot
            .chain(body("slide"), body("finger"))
            .expect("one tree");
        let pose = chain.moved(&state).pose;
        let (place, turn) = numbers[numbers.len() - 7..].split_at(3);
        near(place, &pose.translation);
        let quaternion = Quaternion::xyzw([turn[0], turn[1], turn[2], turn[3]]);
        near(&quaternion.matrix().concat(), &pose.rotation.concat());
        assert!(turn[3] >= 0.0);
        // The numbers of the first row of the Jacobian: x of the velocity, by joints.
        let x: Vec<f64> = moved
            .jacobian
            .iter()
            .map(|column| column.linear[0])
            .collect();
        near(&numbers[16..19], &x);
        let numbers = run(&cell.solvers[2], &state);
        let efforts = dynamics::efforts(robot, &state, [0.0, 0.0, -1.62], &[]);
        near(&numbers[..3], &efforts);
        near(
            &numbers[3..],
            &dynamics::mass_matrix(robot, &state, &[]).concat(),
        );
    }
    // Constants are not computed.
    assert_eq!(cell.solvers[3].work(), rc_kinematics::Work::default());
}

/// A payload is a mass of the link in another file, and accelerations are those that need the efforts.
#[test]
fn payloads_are_masses_and_accelerations_give_efforts_back() {
    let cell = cell();
    let drive = &cell.solvers[4];
    let [mass, x, y, z, xx, xy, xz, yy, yz, zz] = PART;
    let inertial = format!(
        "<link name=\"tool-0\"><inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{mass}\"/>\
        <inertia ixx=\"{xx}\" ixy=\"{xy}\" ixz=\"{xz}\" iyy=\"{yy}\" iyz=\"{yz}\" izz=\"{zz}\"/></inertial></link>"
    );
    let heavy = crate::ARM.replace("<link name=\"tool-0\"/>", &inertial);
    let (heavy, found) = crate::load_with(TEXT, &heavy);
    assert_eq!(found, "");
    let heavy = heavy.expect("a cell").robot;
    for state in states(30) {
        let numbers = run(drive, &state);
        let (accelerations, rest) = numbers.split_at(3);
        let (masses, efforts) = rest.split_at(9);
        let gravity = [0.0, 0.0, -9.80665];
        equal(efforts, &dynamics::efforts(&heavy, &state, gravity, &[]));
        equal(masses, &dynamics::mass_matrix(&heavy, &state, &[]).concat());
        let driven = State {
            accelerations: accelerations.to_vec(),
            ..state.clone()
        };
        let back = dynamics::efforts(&heavy, &driven, gravity, &[]);
        for (one, other) in back.iter().zip(&state.velocities) {
            assert!((one - other).abs() < 1e-9, "{one} {other}");
        }
    }
}

/// The numbers that a program prints, one a line.
pub(crate) fn printed(program: &mut Command) -> Vec<f64> {
    let output = program.output().expect("it starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8(output.stdout).expect("a text");
    let lines = text.lines();
    lines.map(|line| line.parse().expect("a number")).collect()
}

pub(crate) fn compiled(compiler: &str, options: &[&str], source: &Path, program: &Path) {
    let output = Command::new(compiler)
        .args(options)
        .arg(source)
        .arg("-o")
        .arg(program)
        .args(if compiler == "cc" { &["-lm"][..] } else { &[] })
        .output()
        .expect("a compiler");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.is_empty(), "{errors}");
}

fn list(numbers: &[f64]) -> String {
    let all: Vec<String> = numbers.iter().map(|number| format!("{number:?}")).collect();
    all.join(", ")
}

/// Library functions may differ in the last bit.
fn equal(one: &[f64], other: &[f64]) {
    near(one, other, 1e-12);
}

fn near(one: &[f64], other: &[f64], most: f64) {
    assert_eq!(one.len(), other.len());
    for (a, b) in one.iter().zip(other) {
        assert!((a - b).abs() <= most * (1.0 + b.abs()), "{a} {b}");
    }
}

#[test]
fn code_in_three_languages_gives_the_same_numbers() {
    in_three_languages(&cell(), &states(20), 1e-12);
}

/// Joints of each type, one that follows, motors, and a loop that a joint closes.
#[test]
fn joints_of_each_type_are_printed() {
    let types = [
        "revolute",
        "continuous",
        "prismatic",
        "fixed",
        "planar",
        "floating",
        "spherical",
    ];
    let mut robot = String::from("<robot name=\"all\"><link name=\"l0\"/>");
    for (at, kind) in types.iter().enumerate() {
        let link = at + 1;
        write!(
            robot,
            "<link name=\"l{link}\"><inertial><origin xyz=\"0.1 0 0.2\"/><mass value=\"{link}\"/>\
            <inertia ixx=\"0.2\" iyy=\"0.3\" izz=\"0.25\" ixy=\"0.01\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
            <joint name=\"{kind}\" type=\"{kind}\"><parent link=\"l{at}\"/><child link=\"l{link}\"/><origin xyz=\"0.1 0.2 0.3\" rpy=\"0 0.4 0\"/>\
            <axis xyz=\"0 1 1\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>"
        )
        .expect("a text");
    }
    robot += "<link name=\"tool\"/><joint name=\"follow\" type=\"revolute\"><parent link=\"l7\"/><child link=\"tool\"/><axis xyz=\"1 0 0\"/>\
        <limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/><mimic joint=\"revolute\" multiplier=\"0.5\" offset=\"0.1\"/></joint>\
        <transmission name=\"t\"><type>transmission_interface/SimpleTransmission</type><joint name=\"prismatic\"><offset>0.1</offset></joint>\
        <actuator name=\"m\"><mechanicalReduction>-300</mechanicalReduction></actuator></transmission></robot>";
    let text = "import \"arm.urdf\"; Kinematics cell {
        spherical l0 in world at 0, 0, 1 rpy 0.1, 0, 0;
        loop bar { l2 = tool; revolute 0, 0, 1; };
        solver fk { pose tool in world; jacobian tool in l0; acceleration l5 in world; velocity l2 in tool; };
        solver hold { efforts; mass_matrix; loop_errors; };
        solver go { accelerations; closed_velocities; };
        solver out { actuator positions; actuator velocities; actuator efforts; };
        solver back { joint positions; joint velocities; joint efforts; };
    };";
    let (cell, found) = crate::load_with(text, &robot);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let count = cell.robot.coordinates.len();
    assert_eq!(
        cell.robot.coordinates[count - 3..],
        ["l0.roll", "l0.pitch", "l0.yaw"]
    );
    // Of one coordinate three, of a plane three, of free motion six, and twice those of a ball.
    assert_eq!(count, 3 + 3 + 6 + 3 + 3);
    // Loops that are open, in any state, have great accelerations.
    in_three_languages(&cell, &states_of(5, count), 1e-8);
}

/// Rust, C and Python compute the numbers of the interpreter.
fn in_three_languages(cell: &Cell, states: &[State], most: f64) {
    let expected = expected(cell, states);
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("cell.rs"), rc_kinematics::rust(cell)).expect("a file");
    std::fs::write(at("cell.h"), rc_kinematics::c(cell)).expect("a file");
    std::fs::write(at("cell.py"), rc_kinematics::python(cell)).expect("a file");
    let mut rust = String::from("mod cell;\nfn main() {\n");
    let mut c = String::from(
        "#include <stdio.h>\n#include \"cell.h\"\n#include \"cell.h\"\n\
        static void print(const double *all, int count) { for (int i = 0; i < count; i++) printf(\"%.17g\\n\", all[i]); }\n\
        int main(void) {\n    (void)cell_joints; (void)cell_lower; (void)cell_upper;\n",
    );
    let names: Vec<String> = cell
        .robot
        .coordinates
        .iter()
        .map(|name| format!("'{name}'"))
        .collect();
    let mut python = format!(
        "import cell\n\
        def show(value):\n    if isinstance(value, (list, tuple)):\n        [show(one) for one in value]\n\
        \x20   else:\n        print(repr(float(value)))\n\
        assert cell.JOINTS == [{}]\n",
        names.join(", ")
    );
    for state in states {
        let (q, v, a) = (
            list(&state.positions),
            list(&state.velocities),
            list(&state.accelerations),
        );
        let part = list(&PART);
        writeln!(
            c,
            "    {{ const double q[] = {{{q}}}, v[] = {{{v}}}, a[] = {{{a}}}, part[] = {{{part}}}; (void)v; (void)a; (void)part;"
        )
        .expect("a text");
        for solver in &cell.solvers {
            let name = &solver.name;
            let taken: Vec<&str> = [
                Some("q"),
                solver.takes_velocities.then_some("v"),
                solver.takes_accelerations.then_some("a"),
                solver.takes_efforts.then_some("v"),
                (!solver.payloads.is_empty()).then_some("part"),
            ]
            .into_iter()
            .flatten()
            .collect();
            let lists = |open: &str, close: &str| {
                let lists = taken.iter().map(|array| {
                    let numbers = [("q", &q), ("v", &v), ("a", &a), ("part", &part)];
                    let numbers = numbers.into_iter().find(|(name, _)| name == array);
                    format!("{open}{}{close}", numbers.expect("an array").1)
                });
                lists.collect::<Vec<_>>().join(", ")
            };
            writeln!(rust, "    let r = cell::{name}({});", lists("&[", "]")).expect("a text");
            for output in &solver.outputs {
                let flat = match output.shape {
                    rc_kinematics::Shape::Vector(_) => "iter()",
                    rc_kinematics::Shape::Matrix(..) => "iter().flatten()",
                };
                writeln!(
                    rust,
                    "    r.{}.{flat}.for_each(|n| println!(\"{{n:?}}\"));",
                    output.name
                )
                .expect("a text");
            }
            writeln!(
                c,
                "    cell_{name}_result {name}; cell_{name}({}, &{name}); print((const double *)&{name}, sizeof {name} / sizeof(double));",
                taken.join(", ")
            )
            .expect("a text");
            writeln!(python, "show(cell.{name}({}))", lists("[", "]")).expect("a text");
        }
        c.push_str("    }\n");
    }
    rust.push_str("}\n");
    c.push_str("    return 0;\n}\n");
    std::fs::write(at("main.rs"), rust).expect("a file");
    std::fs::write(at("main.c"), c).expect("a file");
    std::fs::write(at("main.py"), python).expect("a file");
    compiled(
        "rustc",
        &["--edition=2021", "-Dwarnings"],
        &at("main.rs"),
        &at("in_rust"),
    );
    let warnings = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-pedantic",
        "-Werror",
        "-ffp-contract=off",
    ];
    compiled("cc", &warnings, &at("main.c"), &at("in_c"));
    let in_rust = printed(&mut Command::new(at("in_rust")));
    near(&in_rust, &expected, most);
    // The same operations with one library for sine and cosine: equal bits.
    let bits = |all: &[f64]| all.iter().map(|one| one.to_bits()).collect::<Vec<u64>>();
    let in_c = printed(&mut Command::new(at("in_c")));
    assert_eq!(bits(&in_c), bits(&in_rust));
    let in_python = printed(Command::new("python3").arg(at("main.py")));
    assert_eq!(bits(&in_python), bits(&in_rust));
}

/// The compiler compares arrays of Rust and vectors of C++.
#[test]
fn lists_of_the_wrong_length_are_refused_in_python() {
    let text = "import \"arm.urdf\";\nKinematics cell {
    solver fk { pose wrist in base; };
    solver reach { inverse pose wrist in base; };
    solver push { inverse velocity wrist in base; }; };";
    let (cell, found) = load(text);
    assert_eq!(found, "");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let cell = cell.expect("a cell");
    std::fs::write(at("cell.py"), rc_kinematics::python(&cell)).expect("a file");
    let program = "import cell
pose = cell.fk([0, 0, 0]).pose_wrist_in_base
for wrong in [
    lambda: cell.fk([0, 0]),
    lambda: cell.reach(pose, [0, 0, 0, 0]),
    lambda: cell.reach([[1, 0, 0, 0]], [0, 0, 0]),
    lambda: cell.push([0], [0] * 6),
    lambda: cell.push([0, 0, 0], [0] * 3),
]:
    try:
        print(wrong())
    except ValueError as error:
        print(error)
";
    std::fs::write(at("main.py"), program).expect("a file");
    let mut python = Command::new("python3");
    let output = python.arg(at("main.py")).output().expect("python");
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    assert_eq!(
        String::from_utf8_lossy(&output.stdout),
        "expected 3 numbers of positions, found 2\n\
        expected 3 numbers of last, found 4\n\
        expected 4 rows of 4 numbers of target\n\
        expected 3 numbers of positions, found 1\n\
        expected 6 numbers of velocity, found 3\n"
    );
}

/// Too many numbers of one array do not make up for missing ones of the next.
#[test]
fn arrays_of_the_wrong_length_are_refused_by_the_interpreter() {
    let cell = cell();
    for lengths in [[4, 2, 3, 3], [3, 3, 2, 4], [2, 3, 3, 3], [3, 3, 3, 4]] {
        let [positions, velocities, accelerations, efforts] =
            lengths.map(|length| vec![0.5; length]);
        let state = State {
            positions,
            velocities,
            accelerations,
        };
        let found = cell.solvers[0].run(&state, &efforts, &[]);
        assert_eq!(found, Err(rc_formula::Rejected::Count), "{lengths:?}");
    }
}

/// C has no lengths of arrays, but gcc knows those of the declarations.
#[test]
fn arrays_that_are_too_short_are_told_by_gcc() {
    let of = |option: &str| {
        let output = Command::new("cc").arg(option).output();
        String::from_utf8_lossy(&output.expect("a compiler").stdout).into_owned()
    };
    let version = of("-dumpversion");
    let major = version.trim().split('.').next().unwrap_or_default();
    let is_new = major.parse().is_ok_and(|major: u32| major >= 11);
    let test = "arrays_that_are_too_short_are_told_by_gcc";
    if !of("--version").contains("Free Software Foundation") || !is_new {
        return rc_test_support::python::skipped(test, "cc is not gcc 11 or later");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("cell.h"), rc_kinematics::c(&cell())).expect("a file");
    for (count, is_short) in [(3, false), (2, true)] {
        let main = format!(
            "#include \"cell.h\"\nint main(void) {{ double q[{count}] = {{0}}; cell_fk_result r; cell_fk(q, &r); return (int)r.pose_tool_0_in_base[0][0]; }}\n"
        );
        std::fs::write(at("main.c"), main).expect("a file");
        let mut cc = Command::new("cc");
        let cc = cc
            .env("LC_ALL", "C")
            .args(["-std=c99", "-c", "-o"])
            .arg(at("main.o"))
            .arg(at("main.c"));
        let output = cc.output().expect("a compiler");
        let told =
            String::from_utf8_lossy(&output.stderr).contains("24 bytes from a region of size 16");
        assert_eq!(told, is_short, "{output:?}");
    }
}

/// A crate without the standard library compiles what `math libm` prints.
#[test]
fn rust_needs_no_standard_library() {
    for (kind, end) in [("f64", ""), ("f32", "f")] {
        without_standard_library(kind, end);
    }
}

fn without_standard_library(kind: &str, end: &str) {
    let arm = format!(
        "import \"arm.urdf\";\nKinematics cell {{ math libm; scalars {kind};
    solver fk {{ pose wrist in base; jacobian wrist in base; efforts; accelerations; }};
    solver reach {{ inverse pose wrist in base; within limits; }};
    solver push {{ inverse velocity wrist in base; within limits; period 1 ms; }}; }};"
    );
    let (cell, found) = load(&arm);
    assert_eq!(found, "");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let text = rc_kinematics::rust(&cell.expect("a cell"));
    assert!(text.contains(&format!("libm::sin{end}(")));
    std::fs::write(at("cell.rs"), text).expect("a file");
    std::fs::write(at("lib.rs"), "#![no_std]\npub mod cell;\n").expect("a file");
    // Only the names: the crate itself is not part of this workspace's tests.
    let one = ["sin", "cos", "sqrt", "floor"]
        .map(|name| format!("pub fn {name}{end}(a: {kind}) -> {kind} {{ a }}\n"));
    let libm = format!(
        "#![no_std]\n{}pub fn atan2{end}(a: {kind}, _: {kind}) -> {kind} {{ a }}\n",
        one.concat()
    );
    std::fs::write(at("libm.rs"), libm).expect("a file");
    let library = ["--edition=2021", "-Dwarnings", "--crate-type=rlib"];
    compiled("rustc", &library, &at("libm.rs"), &at("liblibm.rlib"));
    let link = format!("--extern=libm={}", at("liblibm.rlib").display());
    let options = [&library[..], &[&link]].concat();
    compiled("rustc", &options, &at("lib.rs"), &at("libcell.rlib"));
}
