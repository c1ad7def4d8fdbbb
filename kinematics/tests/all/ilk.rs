//! Models in ILK: read, checked, printed.

use crate::{ARM, load};
use rc_diagnostics::{Format, SourceMap, render};
use rc_kinematics::{Cell, ilk};
use rc_robot::State;
use rc_syntax::MemoryLoader;
use serde_json::json;
use std::io::Write as _;
use std::process::{Command, Stdio};

/// A joint that turns on a base, one that slides on it, and what a camera on the base sees of it, as `ilk-generator` writes them.
const SOLVER: &str = "-- A forward solver.
return {
    solverid = 'fk', solver_type = 'forward', robot_name = 'crane', joint_space_size = 2,
    joints = { turn = { kind='revolute', coordinate=0 }, ['reach'] = { kind='prismatic', coordinate=1 } },
    poses = {
        constant = { turn__base={}, reach__mast={}, mast__reach={}, },
        joint = {
            mast__turn = { joint='turn', dir='a_x_b' },
            turn__mast = { joint='turn', dir='b_x_a' },
            hook__reach = { joint='reach', dir='a_x_b' },
            reach__hook = { joint='reach', dir='b_x_a' }
        }
    },
    joint_vel_twists = {
        v__mast__base = { joint='turn', polarity=1 },
        v__base__mast = { joint='turn', polarity=-1, ctransform='turn__base' },
        v__hook__mast = { joint='reach', polarity=1 }
    },
    ops = {
        { op='pose-compose', arg1='hook__reach', arg2='reach__mast', res='hook__mast' },
        { op='pose-compose', arg1='mast__turn', arg2='turn__base', res='mast__base' },
        { op='pose-compose', arg1='hook__mast', arg2='mast__base', res='hook__base' },
        { op='pose-compose', arg1='reach__mast', arg2='mast__base', res='reach__base' },
        { op='pose-compose', arg1='mast__reach', arg2='reach__hook', res='mast__hook' },
        { op='joint-vel-twist', arg='v__mast__base' },
        { op='pose-compose', arg1='mast__turn', arg2='turn__mast', res='same' },
        { op='vel-compose', arg1='v__hook__mast', arg2='v__mast__base', pose='mast__hook', res='v__hook__base' },
        { op='geom-jacobian', name='J', pose='hook__base', columns=2 },
        { op='GJac-col', joint='turn', jac='J', col=0, joint_pose='turn__base', polarity=1 },
        { op='GJac-col', joint='reach', jac='J', col=1, joint_pose='reach__base' },
    },
    outputs = {
        J = { otype='jacobian', usersort=4 },
        hook__base = { otype='pose', usersort=1 },
        v__hook__base = { otype='velocity', usersort=2 },
        v__base__mast = { otype='velocity', usersort=3 },
        same = { otype='pose', usersort=5 }
    }
}
";

/// The joint turns about z of the base, 2 m above it. The slide begins 0.5 m ahead, and goes along x of the mast.
const CONSTANTS: &str = "return { poses = {
    turn__base = { p = {0, 0, 2.0}, r = { 1,0,0, 0,1,0, 0,0,1 } },
    mast__reach = { p = {0, 0, -0.5}, r = { 0,0,-1, 0,1,0, 1,0,0 } },
    reach__mast = { p = { 0.5, 0., 0e0 }, r = { 0,0,1, 0,1,0, -1,0,0 } }, --[[ z of the slide is x ]]
} }";

fn read(solver: &str, constants: &str) -> (Option<Cell>, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("fk.ilk", solver);
    let loader = MemoryLoader::new([("model-constants.lua", constants)]);
    let (cell, found) = rc_kinematics::load(&mut sources, &loader, source);
    (cell, render(&sources, &found, Format::Short))
}

fn near(found: &[f64], wanted: &[f64]) {
    assert_eq!(found.len(), wanted.len(), "{found:?} {wanted:?}");
    for (one, other) in found.iter().zip(wanted) {
        let most = 1e-12 * (1.0 + other.abs().max(10.0));
        assert!((one - other).abs() < most, "{found:?} {wanted:?}");
    }
}

fn run(cell: &Cell, solver: usize, positions: &[f64], velocities: &[f64]) -> Vec<f64> {
    let state = State {
        positions: positions.to_vec(),
        velocities: velocities.to_vec(),
        accelerations: vec![0.0; positions.len()],
    };
    let efforts = vec![0.0; positions.len()];
    cell.solvers[solver]
        .run(&state, &efforts, &[])
        .expect("its joints")
}

/// Numbers that follow from a drawing of the crane.
#[test]
fn a_model_gives_the_numbers_of_its_drawing() {
    let (cell, found) = read(SOLVER, CONSTANTS);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    assert_eq!(cell.robot.coordinates, ["turn", "reach"]);
    let (angle, way, spin, speed) = (0.3_f64, 0.7, 1.1, -0.4);
    let numbers = run(&cell, 0, &[angle, way], &[spin, speed]);
    let (sine, cosine, length) = (angle.sin(), angle.cos(), 0.5 + way);
    // z of the hook is x of the mast, its x points down.
    near(
        &numbers[..16],
        &[
            0.0,
            -sine,
            cosine,
            length * cosine,
            0.0,
            cosine,
            sine,
            length * sine,
            -1.0,
            0.0,
            0.0,
            2.0,
            0.0,
            0.0,
            0.0,
            1.0,
        ],
    );
    // Along the axes of the hook: it turns against x, and moves along z and y.
    near(
        &numbers[16..22],
        &[-spin, 0.0, 0.0, 0.0, length * spin, speed],
    );
    // The base seen from the mast, along its own axes.
    near(&numbers[22..28], &[0.0, 0.0, -spin, 0.0, 0.0, 0.0]);
    let (x, y) = (length * cosine, length * sine);
    near(
        &numbers[28..40],
        &[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -y, cosine, x, sine, 0.0, 0.0],
    );
    near(&numbers[40..44], &[1.0, 0.0, 0.0, 0.0]);
    assert!(rc_kinematics::c(&cell).contains("crane_fk_fk("));
}

/// What we print and read again is what our own solver gives.
#[test]
fn printed_models_have_the_numbers_of_their_solvers() {
    let text = "import \"arm.urdf\"; Kinematics cell {
        solver fk { pose wrist in base; jacobian wrist in base; };
        solver back { pose base in \"tool-0\"; jacobian base in \"tool-0\"; pose slide in \"tool-0\"; };
    };";
    let (cell, found) = load(text);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let files = ilk::print(&cell).expect("poses and Jacobians");
    let constants = &files.last().expect("constants").1;
    for (solver, (name, text)) in files[..2].iter().enumerate() {
        let (again, found) = read(text, constants);
        assert_eq!(found, "", "{name}: {text}");
        let again = again.expect("a cell");
        let names = again.robot.coordinates.iter();
        assert_eq!(
            names.map(String::as_str).collect::<Vec<_>>(),
            ["fr_turn", "fr_reach", "fr_bend"]
        );
        for at in [[0.1, 0.2, 0.3], [-1.1, 0.05, 2.0]] {
            let mut own = run(&cell, solver, &at, &[0.0; 3]);
            // Angular rows come before linear ones.
            own[16..34].rotate_left(9);
            near(&run(&again, 0, &at, &[0.0; 3]), &own);
        }
    }
    assert!(
        files[0].1.contains("op = 'pose-compose'") && files[1].1.contains("polarity = -1"),
        "{}",
        files[1].1
    );
}

/// The model as older versions write it: without a list of joints.
#[test]
fn older_models_are_read() {
    let mut text = SOLVER.to_owned();
    for (from, to) in [
        (
            "joints = { turn = { kind='revolute', coordinate=0 }, ['reach'] = { kind='prismatic', coordinate=1 } },",
            "",
        ),
        ("{ joint='turn', dir", "{ jtype='revolute', input=0, dir"),
        ("{ joint='reach', dir", "{ jtype='prismatic', input=1, dir"),
        ("joint_vel_twists", "joint_velocities"),
        ("joint-vel-twist", "joint-vel"),
        (
            "{ joint='turn', polarity",
            "{ jtype='revolute', index=0, polarity",
        ),
        (
            "{ joint='reach', polarity",
            "{ jtype='prismatic', index=1, polarity",
        ),
        (
            "op='GJac-col', joint='turn'",
            "op='GJac-col', jtype='revolute'",
        ),
        (
            "op='GJac-col', joint='reach'",
            "op='GJac-col', jtype='prismatic'",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let (older, found) = read(&text, CONSTANTS);
    assert_eq!(found, "");
    let (cell, _) = read(SOLVER, CONSTANTS);
    let (older, cell) = (older.expect("a cell"), cell.expect("a cell"));
    assert_eq!(older.robot.coordinates, ["joint_0", "joint_1"]);
    assert_eq!(older.solvers[0].program, cell.solvers[0].program);
}

/// A velocity and an acceleration as ILK has them: along the axes of the frame, the angular part first, and the acceleration
/// without ω × v.
fn in_ilk(velocity: &[f64], acceleration: &[f64]) -> [Vec<f64>; 2] {
    let [v, spin] = [&velocity[..3], &velocity[3..]];
    let across =
        |at: usize| spin[(at + 1) % 3] * v[(at + 2) % 3] - spin[(at + 2) % 3] * v[(at + 1) % 3];
    let linear = (0..3).map(|at| acceleration[at] - across(at));
    let angular = acceleration[3..].iter().copied();
    [[spin, v].concat(), angular.chain(linear).collect()]
}

/// Velocities and accelerations are those of our own solvers, which are those of Pinocchio; away from the base, towards it, and
/// over both ways.
#[test]
fn printed_models_have_velocities_and_accelerations() {
    let (left, right) = (ARM, ARM);
    let mut text = String::from(
        "import \"left.urdf\" as left; import \"right.urdf\" as right; Kinematics cell {
        fixed right.base in left.base at 0.2, 800 mm, 0.1 rpy 0.1, 0, 2;",
    );
    let pairs = [
        ("left.wrist", "left.base"),
        ("left.base", "\"left.tool-0\""),
        ("left.slide", "left.wrist"),
        ("\"left.tool-0\"", "right.wrist"),
    ];
    for (at, (tip, base)) in pairs.iter().enumerate() {
        let what = format!("{tip} in {base}");
        text += &format!(
            "solver s{at} {{ acceleration {what}; velocity {what} expressed in {tip}; pose {what}; }};"
        );
        text += &format!(
            "solver own{at} {{ velocity {what} expressed in {tip}; acceleration {what} expressed in {tip}; }};"
        );
    }
    let robots = [("left.urdf", left), ("right.urdf", right)];
    let (cell, found) = crate::load_beside(&(text + "};"), &robots);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let files = ilk::print(&cell).expect("motions");
    let constants = &files.last().expect("constants").1;
    let mut random = fastrand::Rng::with_seed(44);
    let count = cell.robot.coordinates.len();
    for (solver, (name, text)) in files[..files.len() - 1].iter().enumerate().step_by(2) {
        let (again, found) = read(text, constants);
        assert_eq!(found, "", "{name}: {text}");
        let again = again.expect("a cell");
        assert!(again.solvers[0].takes_accelerations, "{text}");
        for _ in 0..20 {
            let mut some =
                || -> Vec<f64> { (0..count).map(|_| random.f64() * 4.0 - 2.0).collect() };
            let state = State {
                positions: some(),
                velocities: some(),
                accelerations: some(),
            };
            let run = |solver: &rc_kinematics::Solver| {
                let efforts = vec![0.0; count];
                solver.run(&state, &efforts, &[]).expect("its joints")
            };
            let own = run(&cell.solvers[solver + 1]);
            let found = run(&again.solvers[0]);
            let [velocity, acceleration] = in_ilk(&own[..6], &own[6..]);
            near(&found[..6], &acceleration);
            near(&found[6..12], &velocity);
            near(&found[12..], &run(&cell.solvers[solver])[12..]);
        }
        // Printed code takes what it needs.
        let c = rc_kinematics::c(&again);
        assert!(
            c.contains("velocities[") && c.contains("accelerations["),
            "{c}"
        );
        assert_eq!(laid_out(text).as_ref(), Ok(text));
    }
}

/// The same numbers as those of Pinocchio, whose vectors of a frame are along its own axes, too.
#[test]
fn motions_in_ilk_are_those_of_pinocchio() {
    let test = "motions_in_ilk_are_those_of_pinocchio";
    let packages = rc_test_support::python::packages;
    let Some(python) = packages("pinocchio", "pin==4.1.0\n", test) else {
        return;
    };
    let robot = include_str!("../../examples/six.urdf");
    let text = "import \"arm.urdf\"; Kinematics cell { solver s { acceleration tool in base; velocity tool in base; }; };";
    let (cell, found) = crate::load_with(text, robot);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let files = ilk::print(&cell).expect("motions");
    let (again, found) = read(&files[0].1, &files[1].1);
    assert_eq!(found, "");
    let again = again.expect("a cell");
    let mut random = fastrand::Rng::with_seed(7);
    let states: Vec<[Vec<f64>; 3]> = (0..50)
        .map(|_| [(); 3].map(|()| (0..6).map(|_| random.f64() * 4.0 - 2.0).collect()))
        .collect();
    let input = json!({
        "urdf": robot, "frame": "tool", "coordinates": cell.robot.coordinates, "states": states,
    });
    let mut child = Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/spatial.py"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python");
    let mut pipe = child.stdin.take().expect("its input");
    pipe.write_all(input.to_string().as_bytes())
        .expect("written");
    drop(pipe);
    let output = child.wait_with_output().expect("python");
    assert!(output.status.success(), "the script failed");
    let theirs: Vec<Vec<f64>> = serde_json::from_slice(&output.stdout).expect("numbers");
    for ([positions, velocities, accelerations], theirs) in states.into_iter().zip(theirs) {
        let state = State {
            positions,
            velocities,
            accelerations,
        };
        let own = again.solvers[0].run(&state, &[0.0; 6], &[]);
        near(&own.expect("its joints"), &theirs);
    }
}

#[test]
fn solvers_that_ilk_has_no_words_for_are_told() {
    for (outputs, what) in [
        ("efforts;", "`efforts`"),
        ("pose wrist in base as quaternion;", "quaternion"),
        ("jacobian wrist in base expressed in wrist;", "expressed"),
        (
            "acceleration wrist in base expressed in shoulder;",
            "expressed",
        ),
        ("velocity base in base;", "constant"),
        ("pose base in base;", "constant"),
        ("pose finger in base;", "follows another one"),
    ] {
        let (cell, _) = load(&format!(
            "import \"arm.urdf\"; Kinematics cell {{ solver s {{ {outputs} }}; }};"
        ));
        let error = ilk::print(&cell.expect("a cell")).expect_err("no words");
        assert!(error.to_string().contains(what), "{error}");
    }
    assert!(ARM.contains("mimic"));
}

#[test]
fn wrong_models_are_told_at_their_places() {
    let one = |from: &str, to: &str| {
        assert!(SOLVER.contains(from), "{from}");
        read(&SOLVER.replacen(from, to, 1), CONSTANTS).1
    };
    for (from, to, what) in [
        (
            "arg1='hook__reach'",
            "arg1='hook__rech'",
            "did you mean `hook__reach`?",
        ),
        (
            "res='hook__mast'",
            "res='hook__base'",
            "do not give `hook__base`",
        ),
        (
            "op='joint-vel-twist'",
            "op='joint-spin-twist'",
            "is not read",
        ),
        (
            "op='joint-vel-twist'",
            "op='joint-acc-twist'",
            "no acceleration `v__mast__base` is known",
        ),
        (
            "kind='revolute', coordinate",
            "kind='revolute', place",
            "`coordinate` is missing",
        ),
        (
            "{ joint='turn', polarity=1 }",
            "{ jtype='revolute', index=7 }",
            "there are 2 joints",
        ),
        ("kind='prismatic'", "kind='helical'", "expected `revolute`"),
        (
            "coordinate=1",
            "coordinate=2",
            "no joint has the coordinate 1",
        ),
        ("coordinate=1", "coordinate=1e9", "expected an integer"),
        ("col=0", "col=7", "has 2 columns"),
        ("dir='b_x_a'", "dir='c_x_a'", "expected `a_x_b`"),
        (
            "reach__mast={},",
            "reach__mst={},",
            "model-constants.lua has no pose",
        ),
        ("'forward'", "'inverse'", "only solvers of the type"),
        ("solverid = 'fk'", "solverid = 'while'", "cannot be a name"),
        ("joints = {", "joints = 5 + {", "expected"),
        ("polarity=1", "polarity=2", "a polarity is 1 or -1"),
        ("return {", "returns {", "`return { … }`"),
        ("J = {", "J = { },\n J = {", "occurs twice"),
        (
            "solverid = 'fk'",
            "solverid = 'co_await'",
            "cannot be a name",
        ),
    ] {
        let found = one(from, to);
        assert!(found.contains(what), "{from}: {found}");
        assert!(found.starts_with("fk.ilk:"), "{found}");
    }
    let found = read(
        SOLVER,
        &CONSTANTS.replace("0,0,1, 0,1,0, -1,0,0", "0,0,1, 0,1,0, -1,0,9"),
    )
    .1;
    assert!(found.contains("not a rotation matrix"), "{found}");
    let far = CONSTANTS.replace("0, 0, 2.0", "0, 0, 1e308");
    let far = far.replace("0.5, 0., 0e0", "0, 0, 1e308");
    let found = read(SOLVER, &far).1;
    assert!(found.contains("too great"), "{found}");
    // Nesting and length have bounds; a text without an end has one.
    for text in [
        "return ".to_owned() + &"{".repeat(9999),
        "return {'".to_owned(),
        String::new(),
        "return {} x".to_owned(),
    ] {
        assert!(
            read(&text, CONSTANTS).1.contains("syntax-error"),
            "{text:.20}"
        );
    }
}

/// Names of a model become names and comments of printed code.
#[test]
fn names_of_outputs_stay_names_in_printed_code() {
    let named = |names: &[&str]| {
        let (mut operations, mut outputs) = (String::new(), String::new());
        for name in names {
            let operation = "op='pose-compose', arg1='mast__turn', arg2='turn__base'";
            operations += &format!("{{ {operation}, res='{name}' }},");
            outputs += &format!("['{name}'] = {{ otype='pose' }},");
        }
        let text = SOLVER.replace("ops = {", &format!("ops = {{ {operations}"));
        read(
            &text.replace("outputs = {", &format!("outputs = {{ {outputs}")),
            CONSTANTS,
        )
    };
    let (cell, found) = named(&["of a\rimport os\r */ x"]);
    assert_eq!(found, "");
    let python = rc_kinematics::python(&cell.expect("a cell"));
    assert!(!python.contains('\r') && python.contains("of_a_import_os_____x:"));
    for (names, what) in [
        (&["a b", "a-b"][..], "is `a_b` in printed code"),
        (&["while"], "cannot be a name"),
        (&["7th"], "cannot be a name"),
    ] {
        let found = named(names).1;
        assert!(found.contains(what), "{found}");
    }
}

/// Reading takes time in proportion to the text.
#[test]
fn a_model_with_very_many_names_is_read() {
    let many: String = (0..200_000).map(|at| format!("p{at}={{}},")).collect();
    let text = format!("return {{ {many} }}");
    assert!(
        read(&text, CONSTANTS)
            .1
            .contains("`solver_type` is missing")
    );
}

fn laid_out(text: &str) -> Result<String, String> {
    let mut sources = SourceMap::new();
    let source = sources.add("fk.ilk", text);
    let formatted = ilk::format(&sources, source);
    formatted.map_err(|found| render(&sources, &found, Format::Short))
}

/// Comments stay, and so do empty lines between entries; the second layout changes nothing.
#[test]
fn models_are_laid_out() {
    let text = "-- about\nreturn{solverid='fk',\n\n\n  joints={turn={kind=\"revolute\";coordinate=0}}, -- one\n
  -- the operations
ops={{op='pose-compose',arg1='the_first_frame__the_second_frame',arg2='the_second_frame__the_third_frame',res='x'},
  --[[ none ]]
}, ['a b']={1.5e-3,-2;--last\n},poses={}}-- end";
    let expected = "-- about
return {
    solverid = 'fk',

    joints = { turn = { kind = \"revolute\", coordinate = 0 } }, -- one

    -- the operations
    ops = {
        {
            op = 'pose-compose',
            arg1 = 'the_first_frame__the_second_frame',
            arg2 = 'the_second_frame__the_third_frame',
            res = 'x',
        },
        --[[ none ]]
    },
    ['a b'] = {
        1.5e-3,
        -2, --last
    },
    poses = {},
}
-- end
";
    assert_eq!(laid_out(text).as_deref(), Ok(expected));
    for text in [expected, SOLVER, CONSTANTS] {
        let once = laid_out(text).expect("a table");
        assert_eq!(laid_out(&once).as_ref(), Ok(&once));
    }
    // The layout has the meaning of the text.
    let (cell, found) = read(&laid_out(SOLVER).expect("a table"), CONSTANTS);
    let program = |cell: Option<Cell>| cell.expect("a cell").solvers[0].program.clone();
    assert_eq!(found, "");
    assert_eq!(program(cell), program(read(SOLVER, CONSTANTS).0));
    let lines = laid_out("return {a=1,\r\n-- b\r\n}").expect("a table");
    assert_eq!(lines, "return {\r\n    a = 1,\r\n    -- b\r\n}\r\n");
    for wrong in ["return 5", "return {", "x", ""] {
        let found = laid_out(wrong).expect_err("no table");
        assert!(found.contains("syntax-error"), "{found}");
    }
}
