//! Loops that a joint closes: one mechanism moves in one way, wherever it is cut.

use crate::{load_beside, load_with};
use rc_kinematics::{Cell, Solver};
use rc_robot::State;

const SIX: &str = include_str!("../../examples/six.urdf");

fn cell(text: &str, robots: &[(&str, &str)]) -> Cell {
    let (cell, found) = load_beside(text, robots);
    assert_eq!(found, "");
    cell.expect("a cell")
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
        assert!((a - b).abs() <= most * (1.0 + b.abs()), "{one:?} {other:?}");
    }
}

/// A crank and a rod on an inclined ground, and what else moves.
fn crank(others: &str) -> String {
    let inertial = |centre: &str, mass: &str| {
        format!(
            "<inertial><origin xyz=\"{centre}\"/><mass value=\"{mass}\"/>\
            <inertia ixx=\"0.01\" iyy=\"0.02\" izz=\"0.025\" ixy=\"0.001\" ixz=\"0\" iyz=\"0\"/></inertial>"
        )
    };
    format!(
        "<robot name=\"crank\"><link name=\"world\"/><link name=\"ground\"/>\
        <link name=\"crank\">{}</link><link name=\"rod\">{}</link><link name=\"slider\">{}</link>\
        <joint name=\"tilt\" type=\"fixed\"><parent link=\"world\"/><child link=\"ground\"/><origin xyz=\"1 2 3\" rpy=\"0.3 0.4 0.5\"/></joint>\
        <joint name=\"turn\" type=\"continuous\"><parent link=\"ground\"/><child link=\"crank\"/><axis xyz=\"0 1 0\"/></joint>\
        <joint name=\"knee\" type=\"continuous\"><parent link=\"crank\"/><child link=\"rod\"/><origin xyz=\"0.2 0 0\"/><axis xyz=\"0 1 0\"/></joint>\
        {others}</robot>",
        inertial("0.1 0.02 0", "0.4"),
        inertial("0.3 0 0.01", "0.7"),
        inertial("0.05 0.01 0", "1.5")
    )
}

/// A crank that moves a slider is cut at the pin of the slider, and at its rail.
#[test]
fn a_slider_crank_moves_wherever_it_is_cut() {
    let pin_cut = crank(
        "<link name=\"end\"/><joint name=\"top\" type=\"fixed\"><parent link=\"rod\"/><child link=\"end\"/><origin xyz=\"0.6 0 0\"/></joint>\
        <joint name=\"slide\" type=\"prismatic\"><parent link=\"ground\"/><child link=\"slider\"/><axis xyz=\"1 0 0\"/>\
        <limit lower=\"-2\" upper=\"2\" effort=\"1\" velocity=\"1\"/></joint>",
    );
    let rail_cut = crank(
        "<joint name=\"pin\" type=\"continuous\"><parent link=\"rod\"/><child link=\"slider\"/><origin xyz=\"0.6 0 0\"/><axis xyz=\"0 1 0\"/></joint>",
    );
    let solvers = "solver close { closed_positions; holding turn; }; solver keep { loop_errors; };
        solver rates { closed_velocities; holding turn; }; solver go { accelerations; };";
    for choices in ["", "frames innermodel;"] {
        let of = |urdf: &str, joint: &str| {
            let text = format!(
                "import \"crank.urdf\"; Kinematics c {{ {choices} loop l {{ {joint} }}; {solvers} }};"
            );
            cell(&text, &[("crank.urdf", urdf)])
        };
        let pin = of(&pin_cut, "end = slider; revolute 0, 2, 0;");
        let rail = of(&rail_cut, "ground = slider; prismatic -1, 0, 0;");
        for turn in [0.4, 1.3, 2.6, 4.1] {
            let mut state = State::still(vec![turn, -turn - 0.2, 0.7]);
            for _ in 0..3 {
                state.positions = output(&pin.solvers[0], "closed_positions", &state, &[0.0; 3]);
            }
            state.velocities = vec![1.5, 0.0, 0.0];
            state.velocities = output(&pin.solvers[2], "closed_velocities", &state, &[0.0; 3]);
            let errors = output(&pin.solvers[1], "loop_errors", &state, &[0.0; 3]);
            near(&errors, &[0.0; 5], 1e-12);
            // The slider does not turn.
            let third = |all: &[f64]| vec![all[0], all[1], -all[0] - all[1]];
            let other = State {
                positions: third(&state.positions),
                velocities: third(&state.velocities),
                accelerations: vec![0.0; 3],
            };
            let errors = output(&rail.solvers[1], "loop_errors", &other, &[0.0; 3]);
            near(&errors, &[0.0; 5], 1e-12);
            let kept = output(&rail.solvers[2], "closed_velocities", &other, &[0.0; 3]);
            near(&kept, &other.velocities, 1e-9);
            let go = |cell: &Cell, state: &State| {
                let efforts = [3.0, -0.4, 0.0];
                output(&cell.solvers[3], "accelerations", state, &efforts)
            };
            let (one, two) = (go(&pin, &state), go(&rail, &other));
            near(&one[..2], &two[..2], 1e-7);
            near(&two, &third(&two), 1e-7);
            assert!(one[0].abs() > 0.1, "{one:?}");
        }
    }
}

/// Two arms hold a bar that turns about its axis: two points of the axis stay together. For each kind of joint, the errors
/// change as the Jacobian says, and closed positions have none.
#[test]
fn arms_hold_a_bar_that_turns_or_slides() {
    let tip = "<link name=\"tip\"/><joint name=\"to_tip\" type=\"fixed\"><parent link=\"tool\"/><child link=\"tip\"/>\
        <origin xyz=\"0.12 -0.2 0.3\"/></joint></robot>";
    let arm = SIX.replace("</robot>", tip);
    let of = |loops: &str| {
        let text = format!(
            "import \"arm.urdf\" as left; import \"arm.urdf\" as right; Kinematics both {{
            fixed right.base in left.base at 0.8, 0.1, 0 rpy 0, 0, 3; {loops}
            solver close {{ closed_positions; }}; solver keep {{ loop_errors; loop_jacobian; }};
            solver rates {{ closed_velocities; }}; solver go {{ accelerations; }}; }};"
        );
        let (cell, found) = load_with(&text, &arm);
        assert_eq!(found, "");
        cell.expect("a cell")
    };
    let points =
        of("loop a { left.tool = right.tool; point; }; loop b { left.tip = right.tip; point; };");
    let hinge = of("loop a { left.tool = right.tool; revolute 0.12, -0.2, 0.3; };");
    let slide = of("loop a { left.tool = right.tool; prismatic 0.12, -0.2, 0.3; };");
    let whole = of("loop a { left.tool = right.tool; };");
    let mut random = fastrand::Rng::with_seed(17);
    let still = [0.0; 12];
    for _ in 0..4 {
        let mut some = |most: f64| -> Vec<f64> {
            (0..12).map(|_| (random.f64() * 2.0 - 1.0) * most).collect()
        };
        let bend = [0.3, -1.2, 1.1, 0.2, 0.7, 0.4];
        let noise = some(0.2);
        let bent = [bend, bend].concat();
        let (velocities, efforts) = (some(1.0), some(5.0));
        for cell in [&hinge, &slide, &whole, &points] {
            let positions = bent.iter().zip(&noise).map(|(one, by)| one + by);
            let mut state = State::still(positions.collect());
            for _ in 0..10 {
                state.positions = output(&cell.solvers[0], "closed_positions", &state, &still);
            }
            let rows = cell.solvers[1].outputs[0].shape.size();
            let errors = |state: &State| output(&cell.solvers[1], "loop_errors", state, &still);
            near(&errors(&state), &vec![0.0; rows], 1e-10);
            let jacobian = output(&cell.solvers[1], "loop_jacobian", &state, &still);
            for joint in 0..12 {
                let at = |by: f64| {
                    let mut moved = state.clone();
                    moved.positions[joint] += by;
                    errors(&moved)
                };
                let (before, after) = (at(-1e-6), at(1e-6));
                let rates = after.iter().zip(&before).map(|(b, a)| (b - a) / 2e-6);
                let column: Vec<f64> = (0..rows).map(|row| jacobian[12 * row + joint]).collect();
                near(&rates.collect::<Vec<_>>(), &column, 1e-7);
            }
        }
        let positions = bent.iter().zip(&noise).map(|(one, by)| one + by);
        let mut state = State::still(positions.collect());
        for _ in 0..10 {
            state.positions = output(&hinge.solvers[0], "closed_positions", &state, &still);
        }
        state.velocities = velocities;
        state.velocities = output(&hinge.solvers[2], "closed_velocities", &state, &still);
        let own = output(&hinge.solvers[3], "accelerations", &state, &efforts);
        let other = output(&points.solvers[3], "accelerations", &state, &efforts);
        near(&own, &other, 1e-6);
    }
}

/// A four-bar linkage as a set of `robot-model-tools`: the joint that closes it is told, or chosen by the numbering.
#[test]
fn a_set_may_have_a_loop() {
    let pair = |joint: &str, one: &str, two: &str| {
        format!("  - joint: {joint}\n    link1: {one}\n    link2: {two}\n")
    };
    let kinds = ["turn", "knee", "top", "swing"]
        .map(|joint| format!("  - name: {joint}\n    kind: revolute\n"));
    let connect = format!(
        "name: four\nlinks:\n- ground\n- crank\n- coupler\n- rocker\njoints:\n{}pairs:\n{}{}{}{}",
        kinds.concat(),
        pair("turn", "ground", "crank"),
        pair("knee", "crank", "coupler"),
        pair("top", "rocker", "coupler"),
        pair("swing", "rocker", "ground"),
    );
    let pose = |joint: &str, link: &str, steps: &[(&str, &str)]| {
        let steps = steps
            .iter()
            .map(|(kind, amount)| format!("      - kind: {kind}\n        amount: {amount}\n"));
        format!(
            "  - target: {joint}\n    reference: {link}\n    steps:\n{}",
            steps.collect::<String>()
        )
    };
    let of_tree = pose("turn", "ground", &[("rotx", "-pi/2")])
        + &pose("knee", "crank", &[("trx", "0.2")])
        + &pose("swing", "ground", &[("trx", "0.6"), ("rotx", "-pi/2")]);
    let geometry = format!(
        "model: four\nmode: currentFrame\nposes:\n{of_tree}{}{}",
        pose("top", "coupler", &[("trx", "0.6")]),
        pose("top", "rocker", &[("trx", "0.4")]),
    );
    let body = |link: &str, [mass, x, iyy]: [f64; 3]| {
        format!(
            "  {link}:\n    mass: {mass}\n    com:\n      x: {x}\n    moments:\n      ixx: 0.001\n      iyy: {iyy}\n      izz: {iyy}\n"
        )
    };
    let inertia = format!(
        "inertia:\n{}{}{}",
        body("crank", [0.4, 0.1, 0.006]),
        body("coupler", [0.7, 0.3, 0.083]),
        body("rocker", [0.5, 0.2, 0.03])
    );
    let set =
        "robot: four\nconnectivity: connect.yaml\ngeometry: geometry.yaml\ninertia: inertia.yaml\n";
    let numbered = format!("{set}numbering: numbers.yaml\n");
    let numbers = "nums:\n  ground: 0\n  crank: 1\n  coupler: 2\n  rocker: 3\n  top: 4\n";
    let load = |set: &str, geometry: &str, numbers: &str| {
        let text = "import \"four.yaml\"; Kinematics four { solver close { closed_positions; holding turn; };
            solver keep { loop_errors; }; solver go { accelerations; }; };";
        load_beside(
            text,
            &[
                ("four.yaml", set),
                ("connect.yaml", &connect),
                ("geometry.yaml", geometry),
                ("inertia.yaml", &inertia),
                ("numbers.yaml", numbers),
            ],
        )
    };
    let (own, found) = load(set, &geometry, "");
    assert!(
        found.starts_with("connect.yaml:23:12: note[loop-joint]: the joint `top` closes a loop"),
        "{found}"
    );
    assert_eq!(found.lines().count(), 1, "{found}");
    let own = own.expect("a cell");
    assert_eq!(own.robot.coordinates, ["turn", "knee", "swing"]);
    let linkage = cell(crate::cells::FOUR, &[("bars.urdf", crate::cells::BARS)]);
    let mut state = State::still(vec![-1.0, -0.2, -1.2]);
    for _ in 0..5 {
        state.positions = output(&own.solvers[0], "closed_positions", &state, &[0.0; 3]);
    }
    let errors = output(&linkage.solvers[1], "loop_errors", &state, &[0.0; 3]);
    near(&errors, &[0.0; 3], 1e-12);
    let errors = output(&own.solvers[1], "loop_errors", &state, &[0.0; 3]);
    near(&errors, &[0.0; 5], 1e-12);
    let efforts = [0.4, -0.2, 0.1];
    let accelerations = output(&own.solvers[2], "accelerations", &state, &efforts);
    let same = output(&linkage.solvers[3], "accelerations", &state, &efforts);
    near(&accelerations, &same, 1e-8);

    let (chosen, found) = load(&numbered, &geometry, numbers);
    assert_eq!(found, "");
    assert_eq!(chosen.expect("a cell").robot, own.robot);
    // Another joint closes it: the coupler begins at `top` of the rocker then.
    let other = geometry
        .replace(
            "target: knee\n    reference: crank",
            "target: knee\n    reference: coupler",
        )
        .replace(
            "target: top\n    reference: coupler",
            "target: knee\n    reference: crank",
        );
    let (chosen, found) = load(&numbered, &other, &numbers.replace("top:", "knee:"));
    assert_eq!(found, "");
    let chosen = chosen.expect("a cell");
    assert_eq!(chosen.robot.coordinates, ["turn", "top", "swing"]);
    assert_eq!(chosen.robot.loops[0].name, "knee");

    let (_, found) = load(
        set,
        &format!("model: four\nmode: currentFrame\nposes:\n{of_tree}"),
        "",
    );
    let what =
        "error[bad-value]: the geometry has no pose of the joint `top` in `rocker` or `coupler`";
    assert!(found.contains(what), "{found}");
    let twice = geometry.replace("reference: rocker", "reference: coupler");
    let (_, found) = load(set, &twice, "");
    assert!(
        found.contains("the frame `top` has a place already"),
        "{found}"
    );
    let (_, found) = load(
        &numbered,
        &geometry,
        &format!("{numbers}  turn: 5\n  knee: 6\n"),
    );
    assert!(found.contains("no joint connects the links"), "{found}");
}

/// Axes that point against each other are not one, in a plane neither: there, rounding alone says about what the frames turn.
#[test]
fn half_a_turn_across_an_axis_is_an_error_of_a_loop() {
    for (roll, wanted) in [
        ("3.141592653589793", 2.0),
        ("3.0", 2.0 * f64::sin(1.5)),
        ("0.001", 2.0 * f64::sin(0.0005)),
    ] {
        let bar = |joint: &str, link: &str| {
            format!(
                "<link name=\"{link}\"/><joint name=\"{joint}\" type=\"continuous\"><parent link=\"ground\"/><child link=\"{link}\"/>\
                <axis xyz=\"0 0 1\"/></joint>"
            )
        };
        let urdf = format!(
            "<robot name=\"bars\"><link name=\"ground\"/>{}{}<link name=\"end\"/><joint name=\"turned\" type=\"fixed\">\
            <parent link=\"two\"/><child link=\"end\"/><origin rpy=\"{roll} 0 0\"/></joint></robot>",
            bar("first", "one"),
            bar("second", "two")
        );
        let text = "import \"bars.urdf\"; Kinematics c { loop l { one = end; revolute 0, 0, 1; }; solver keep { loop_errors; }; };";
        let bars = cell(text, &[("bars.urdf", &urdf)]);
        let state = State::still(vec![0.4, -0.3]);
        let errors = output(&bars.solvers[0], "loop_errors", &state, &[0.0; 2]);
        near(&errors[..3], &[0.0; 3], 1e-15);
        near(&[errors[3].hypot(errors[4])], &[wanted], 1e-12);
    }
}

#[test]
fn wrong_joints_of_loops_are_told() {
    let text = |joint: &str| {
        format!(
            "import \"arm.urdf\"; Kinematics c {{ loop l {{ tool = base; {joint} }}; solver s {{ loop_errors; }}; }};"
        )
    };
    for (joint, what) in [
        (
            "revolute 0, 0, 0;",
            "error[bad-value]: no axis has the direction [0.0, 0.0, 0.0]",
        ),
        (
            "prismatic 1e300, 0, 0;",
            "error[bad-value]: no axis has the direction",
        ),
        (
            "point; revolute 0, 0, 1;",
            "error[duplicate-name]: a loop has one joint",
        ),
        ("revolute 0, 1;", "error[syntax-error]: expected `,`"),
        ("prismatic;", "error[syntax-error]: expected"),
    ] {
        let (_, found) = load_with(&text(joint), SIX);
        assert!(found.contains(what), "{joint}: {found}");
    }
}

/// Two arms carry a bar while motors move them: it stays in their hands. The time is in steps of 1 ms.
pub(crate) fn keep_a_bar((arm, root): (&str, &str), steps: usize) {
    let text = "import \"arm.urdf\" as left; import \"arm.urdf\" as right; Kinematics both {
        fixed right.ROOT in left.ROOT at 0.8, 0.1, 0 rpy 0, 0, 3; loop bar { left.tool = right.tool; };
        solver close { closed_positions; loop_errors; }; solver rates { closed_velocities; };
        solver go { accelerations; }; solver hold { efforts; }; };";
    let (cell, found) = load_with(&text.replace("ROOT", root), arm);
    assert!(!found.contains("error["), "{found}");
    let cell = cell.expect("a cell");
    let still = [0.0; 12];
    let bend = [0.3, -1.2, 1.1, 0.2, 0.7, 0.4];
    let mut state = State::still([bend, bend].concat());
    for _ in 0..10 {
        state.positions = output(&cell.solvers[0], "closed_positions", &state, &still);
    }
    let first = state.positions.clone();
    let (mut worst, mut farthest) = (0.0_f64, 0.0_f64);
    for step in 0..steps {
        let time = 1e-3 * step as f64;
        let held = State::still(state.positions.clone());
        let weight = output(&cell.solvers[3], "efforts", &held, &still);
        let efforts: Vec<f64> = (0..12)
            .map(|at| {
                let push = 6.0 * (time * (1.0 + 0.1 * at as f64)).sin();
                let back = 20.0 * (first[at] - state.positions[at]) - 8.0 * state.velocities[at];
                weight[at] + push + back
            })
            .collect();
        let rates = output(&cell.solvers[2], "accelerations", &state, &efforts);
        for (at, rate) in rates.iter().enumerate() {
            state.velocities[at] += 1e-3 * rate;
            state.positions[at] += 1e-3 * state.velocities[at];
        }
        state.positions = output(&cell.solvers[0], "closed_positions", &state, &still);
        state.velocities = output(&cell.solvers[1], "closed_velocities", &state, &still);
        let errors = output(&cell.solvers[0], "loop_errors", &state, &still);
        // The greatest of numbers ignores those that are none.
        assert!(errors.iter().all(|error| error.is_finite()), "{errors:?}");
        worst = errors
            .iter()
            .fold(worst, |most, error| most.max(error.abs()));
        let moved = state
            .positions
            .iter()
            .zip(&first)
            .map(|(a, b)| (a - b).abs());
        farthest = moved.fold(farthest, f64::max);
    }
    println!("{steps} steps: closed within {worst:e}, moved by {farthest} rad");
    assert!(worst < 1e-8, "{worst}");
    assert!(farthest > 0.02 && farthest < 3.0, "{farthest}");
}

/// `KINEMATICS_STEPS` is the number of milliseconds.
#[test]
fn two_arms_keep_their_bar() {
    let steps = std::env::var("KINEMATICS_STEPS").map(|text| text.parse().expect("a number"));
    keep_a_bar((SIX, "base"), steps.unwrap_or(200));
}
