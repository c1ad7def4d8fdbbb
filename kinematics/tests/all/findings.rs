//! Errors in texts.

use crate::load;
use expect_test::expect;

fn inside(solvers: &str) -> String {
    load(&format!(
        "import \"arm.urdf\";\nKinematics cell\n{{\n{solvers}\n}};"
    ))
    .1
}

#[test]
fn a_wrong_text_is_told_at_its_place() {
    let found = inside(
        "    solver fk { pose tol in base; jacobian wrist base; };
    solver fk { efforts; };
    solver one { pose wrist in base; pose wrist in base; };
    solver none { };
    solver sin { pose wrist in base expressed in tool; gravity 1e9, 0, 0; };
    solver two { efforts; gravity 0, 0, 1; gravity 0, 0, 2; };
    slover three { };",
    );
    expect![[r#"
        cell.kdsl:4:22: error[unknown-link]: the robot `arm` has no link `tol` (expected one of `base`, `shoulder`, `slide`, `wrist`, `tool-0`, `finger`)
        cell.kdsl:4:50: error[syntax-error]: expected `in`, found `base`
        cell.kdsl:5:12: error[duplicate-name]: `fk` is declared twice, or has the type of another one; first declared here at cell.kdsl:4:12
        cell.kdsl:6:38: error[duplicate-name]: the solver gives `pose_wrist_in_base` twice; first declared here at cell.kdsl:6:18
        cell.kdsl:7:12: error[empty-solver]: the solver `none` gives nothing (write what it computes, such as `pose TIP in BASE;`)
        cell.kdsl:8:12: error[reserved-in-code]: `sin` cannot be the name of a solver: printed code has it for something else
        cell.kdsl:8:50: error[unknown-link]: the robot `arm` has no link `tool` (expected one of `base`, `shoulder`, `slide`, `wrist`, `tool-0`, `finger`)
        cell.kdsl:8:56: warning[without-effect]: `gravity` changes nothing: this solver gives no `efforts`, `accelerations` or `loop_forces`
        cell.kdsl:8:64: error[bad-value]: expected an acceleration up to 1000000 m/s², found the number 1000000000
        cell.kdsl:9:44: error[duplicate-name]: `gravity` occurs twice; first declared here at cell.kdsl:9:27
        cell.kdsl:10:5: error[unknown-declaration]: expected one of `solver`, `posture`, `fixed`, `planar`, `floating`, `spherical`, `loop`, `math`, `scalars`, `lengths`, `matrices`, `frames`, found `slover` (did you mean `solver`?)
    "#]].assert_eq(&found);
}

#[test]
fn inverses_are_told_what_they_cannot_be() {
    let found = inside(
        "    posture home { turn = 190 deg; reach = 20 rad; grip = 1; bend = 1; bend = 2; turm 3; };
    posture last { };
    solver a { inverse pose wrist in base; pose wrist in base; gravity 0, 0, 1; damped 0.1; };
    solver b { inverse pose wrist in base expressed in slide; };
    solver c { inverse pose \"tool-0\" in wrist; };
    solver d { inverse pose wrist in base; tolerance 1e-6 rad 1e-6 m; iterations 0; restarts 1e9; seed hom; seed last; };
    solver e { inverse velocity wrist in base; within limits; damped 0; null posture last; };
    solver f { inverse velocity wrist in base; period 1 ms; null posture home gain -1; seed home; };
    solver g { pose wrist in base; within limits; };
    solver h { inverse jacobian wrist in base; };
    solver i { inverse pose wrist in base; within walls; };
    solver k { inverse velocity wrist in base; within limits; period 0 s; };
    solver l { pose wrist in base; payload part at wrist; payload part at tol; payload efforts at wrist; };
    solver m { inverse pose wrist in base; payload part at wrist; };
    solver n { payload part in wrist; };
    solver o { pose wrist in base as quaternino; };
    solver p { velocity wrist in base expressed inn slide; };",
    );
    expect![[r#"
        cell.kdsl:4:27: error[bad-value]: `turn` goes from -2.9 to 2.9 rad, found 3.3161255787892263 rad
        cell.kdsl:4:47: error[bad-value]: expected a number in `m`, found `rad` (write `m`, or a unit that converts into it)
        cell.kdsl:4:52: error[unknown-joint]: the robot `arm` has no joint `grip` that moves on its own (expected one of `turn`, `reach`, `bend`)
        cell.kdsl:4:72: error[duplicate-name]: the joint `bend` occurs twice in the posture; first declared here at cell.kdsl:4:62
        cell.kdsl:4:87: error[syntax-error]: expected `=`, found `3`
        cell.kdsl:5:13: error[reserved-in-code]: `last` cannot be the name of a posture: it is the one before
        cell.kdsl:6:44: error[mixed-solver]: an inverse solver gives nothing else; the inverse at cell.kdsl:6:16 (write a solver of its own for it)
        cell.kdsl:6:64: error[mixed-solver]: an inverse solver gives nothing else; the inverse at cell.kdsl:6:16 (write a solver of its own for it)
        cell.kdsl:6:81: error[without-effect]: `damped` changes nothing: this inverse has `within`, `tolerance`, `iterations`, `restarts`, `seed`
        cell.kdsl:7:56: error[without-effect]: a pose has no `expressed in`: it is in the frame after `in`
        cell.kdsl:8:16: error[empty-solver]: no joint moves `tool-0` in `wrist`
        cell.kdsl:9:59: error[bad-value]: expected a number in `m`, found `rad` (write `m`, or a unit that converts into it)
        cell.kdsl:9:68: error[bad-value]: expected a number in `rad`, found `m` (write `rad`, or a unit that converts into it)
        cell.kdsl:9:82: error[bad-value]: expected an integer from 1 to 10000, found the number 0
        cell.kdsl:9:94: error[bad-value]: expected an integer from 0 to 1000, found the number 1000000000
        cell.kdsl:9:104: error[unknown-posture]: there is no posture `hom` (did you mean `home`?)
        cell.kdsl:9:109: error[duplicate-name]: `seed` occurs twice; first declared here at cell.kdsl:9:99
        cell.kdsl:10:48: error[missing-period]: the period within which the limits hold is missing (write the period of the loop, such as `period 1 ms;`)
        cell.kdsl:10:70: error[bad-value]: expected a number from 1e-6 to 1000, found the number 0
        cell.kdsl:10:86: error[unknown-posture]: there is no posture `last` (expected `home`)
        cell.kdsl:11:48: error[without-effect]: `period` changes nothing without `within limits`
        cell.kdsl:11:84: error[bad-value]: expected a number from 1e-12 to 1000000 1/s, found -1
        cell.kdsl:11:88: error[without-effect]: `seed` changes nothing: this inverse has `within`, `damped`, `null`, `period`
        cell.kdsl:12:36: error[without-effect]: `within` changes nothing: this solver is not an inverse
        cell.kdsl:13:24: error[syntax-error]: expected `pose` or `velocity`, found `jacobian`
        cell.kdsl:14:51: error[syntax-error]: expected `limits`, found `walls`
        cell.kdsl:15:70: error[bad-value]: expected a number from 1e-12 to 1000 s, found 0
        cell.kdsl:16:36: error[without-effect]: `payload` changes nothing: this solver computes no masses
        cell.kdsl:16:67: error[duplicate-name]: the payload `part` is declared twice; first declared here at cell.kdsl:16:44
        cell.kdsl:16:88: error[reserved-in-code]: `efforts` is the name of another argument
        cell.kdsl:17:44: error[mixed-solver]: an inverse solver gives nothing else; the inverse at cell.kdsl:17:16 (write a solver of its own for it)
        cell.kdsl:18:29: error[syntax-error]: expected `at`, found `in`
        cell.kdsl:19:38: error[syntax-error]: expected `quaternion`, found `quaternino` (did you mean `quaternion`?)
        cell.kdsl:20:49: error[syntax-error]: expected `in`, found `inn` (did you mean `in`?)
    "#]].assert_eq(&found);
}

#[test]
fn robots_are_told_where_they_are_imported() {
    let of = |text: &str| load(text).1;
    let solver = "Kinematics cell { solver fk { pose wrist in base; }; };";
    expect![[r#"
        cell.kdsl:1:12: error[missing-robot]: no robot is imported (write `import "robot.urdf";` before it)
    "#]].assert_eq(&of(solver));
    expect![[r#"
        cell.kdsl:1:8: error[import-not-found]: cannot find `amr.urdf`; searched in memory (did you mean `arm.urdf`?)
    "#]].assert_eq(&of(&format!("import \"amr.urdf\";\n{solver}")));
    let second = format!("import \"arm.urdf\";\nimport \"amr.urdf\";\n{solver}");
    expect![[r#"
        cell.kdsl:2:8: error[import-not-found]: cannot find `amr.urdf`; searched in memory (did you mean `arm.urdf`?)
    "#]].assert_eq(&of(&second));
    let second = crate::load_beside(
        &second,
        &[("arm.urdf", crate::ARM), ("amr.urdf", crate::ARM)],
    )
    .1;
    expect![[r#"
        cell.kdsl:2:8: error[second-robot]: a second robot is imported without a name; the first one at cell.kdsl:1:8 (write `import "FILE" as NAME;`, which makes its links and joints `NAME.LINK` and `NAME.JOINT`)
    "#]].assert_eq(&second);
    // One file by two paths is one robot.
    let twice = format!("import \"arm.urdf\";\nimport \"../a/arm.urdf\";\n{solver}");
    assert_eq!(of(&twice), "");
    expect![[r#"
        cell.kdsl:1:1: error[empty-file]: expected `Kinematics NAME { … };`, found an empty file
    "#]]
    .assert_eq(&of(""));
}

/// Robots, how they are held, and what stays together.
#[test]
fn cells_are_told_what_they_cannot_be() {
    let found = load(
        "import \"arm.urdf\" as left;
import \"arm.urdf\" as left;
import \"arm.urdf\" as right;
Kinematics cell
{
    fixed right.wrist in left.base;
    fixed right.base in right.wrist;
    fixed right.bas in left.base;
    fixed right.base in left.base at 1 rad, 0, 1e300;
    planar left.base in floor at 0, 1 m;
    loop none { };
    loop twice { left.wrist = left.base; right.wrist = right.base; };
    loop far { left.wrist = right.wrist; point; point; };
    loop still { left.wrist = left.wrist; };
    solver fk { pose left.wrist in right.base; jacobian left.wrist in left.bse; };
    solver go { loop_errors; };
    solver hold { efforts; holding left.turn; holding left.trun; };
    solver reach { inverse pose left.wrist in left.base; holding left.turn; };
    loop { left.wrist = left.base; };
};",
    )
    .1;
    expect![[r#"
        cell.kdsl:2:22: error[duplicate-name]: two robots have the name `left`; first declared here at cell.kdsl:1:22
        cell.kdsl:6:11: error[not-a-root]: something holds `right.wrist` already (the root of its tree is `right.base`)
        cell.kdsl:7:25: error[not-a-root]: `right.wrist` moves with `right.base`, and cannot hold it (write a link of another robot, or a new name, such as `world`)
        cell.kdsl:8:11: error[unknown-link]: the robot `arm and arm` has no link `right.bas` (did you mean `right.base`?)
        cell.kdsl:9:5: error[bad-value]: expected numbers up to 1e9
        cell.kdsl:9:40: error[bad-value]: expected a number in `m`, found `rad` (write `m`, or a unit that converts into it)
        cell.kdsl:10:40: error[syntax-error]: expected `,`, found `;`
        cell.kdsl:11:10: error[bad-loop]: the loop `none` connects 0 pairs of frames (write one pair: `loop NAME { FRAME = FRAME; };`)
        cell.kdsl:12:10: error[bad-loop]: the loop `twice` connects 2 pairs of frames (write one pair: `loop NAME { FRAME = FRAME; };`)
        cell.kdsl:13:29: error[unconnected-frames]: nothing connects `left.wrist` and `right.wrist`: they are parts of different robots (write where one is, such as `fixed right.base in left.wrist at 1 m, 0, 0;`)
        cell.kdsl:13:49: error[duplicate-name]: a loop has one joint; first declared here at cell.kdsl:13:42
        cell.kdsl:14:31: error[bad-loop]: no joint moves `left.wrist` in `left.wrist`
        cell.kdsl:15:17: error[unconnected-frames]: nothing connects `right.base` and `left.wrist`: they are parts of different robots (write where one is, such as `fixed left.base in right.base at 1 m, 0, 0;`)
        cell.kdsl:15:71: error[unknown-link]: the robot `arm and arm` has no link `left.bse` (did you mean `left.base`?)
        cell.kdsl:17:28: error[without-effect]: `holding` changes nothing: this solver gives no `closed_positions` and no `closed_velocities`
        cell.kdsl:17:47: error[duplicate-name]: `holding` occurs twice; first declared here at cell.kdsl:17:28
        cell.kdsl:17:55: error[unknown-joint]: the robot `arm and arm` has no joint `left.trun` that moves on its own (did you mean `left.turn`?)
        cell.kdsl:18:58: error[mixed-solver]: an inverse solver gives nothing else; the inverse at cell.kdsl:18:20 (write a solver of its own for it)
        cell.kdsl:19:10: error[syntax-error]: expected a name, found `{`
    "#]].assert_eq(&found);
}

/// Joints without a motor need loops that move them.
#[test]
fn joints_without_a_motor_are_moved_by_loops() {
    let found = load(
        "import \"arm.urdf\";
Kinematics cell
{
    loop bar { wrist = base; point; };
    solver push { efforts; passive turn, reach, bend; };
    solver fk { pose wrist in base; passive turn; passive bned; };
    solver reach { inverse pose wrist in base; passive turn; };
    solver alone { efforts; passive ; };
};",
    )
    .1;
    expect![[r#"
        cell.kdsl:5:28: error[bad-loop]: the loops move 2 of 3 joints without a motor (leave the joints that have a motor out of `passive`)
        cell.kdsl:6:37: error[without-effect]: `passive` changes nothing: this solver gives no `efforts`
        cell.kdsl:6:51: error[duplicate-name]: `passive` occurs twice; first declared here at cell.kdsl:6:37
        cell.kdsl:6:59: error[unknown-joint]: the robot `arm` has no joint `bned` that moves on its own (did you mean `bend`?)
        cell.kdsl:7:48: error[mixed-solver]: an inverse solver gives nothing else; the inverse at cell.kdsl:7:20 (write a solver of its own for it)
        cell.kdsl:8:37: error[syntax-error]: expected the name of a link, found `;`
    "#]].assert_eq(&found);
    let found = load(
        "import \"arm.urdf\";
Kinematics cell { solver push { efforts; passive turn; }; };",
    )
    .1;
    expect![[r#"
        cell.kdsl:2:33: error[bad-loop]: there is no loop (write `loop NAME { FRAME = FRAME; };` before the solvers)
    "#]].assert_eq(&found);
}

/// Printed code compiles whatever the names are.
#[test]
fn names_that_printed_code_has_are_refused() {
    let solver = |name: &str| format!("    solver {name} {{ pose wrist in base; }};");
    for name in [
        "joints",
        "UPPER",
        "list",
        "fk_result",
        "FkResult",
        "def",
        "sin",
        "v3",
    ] {
        let found = inside(&solver(name));
        assert!(found.contains("error[reserved-in-code]"), "{name}: {found}");
    }
    let found = inside(&format!("{}\n{}", solver("a_b"), solver("aB")));
    assert!(
        found.contains("cell.kdsl:5:12: error[duplicate-name]"),
        "{found}"
    );
}

/// A name may break no comment of printed code.
#[test]
fn a_line_break_in_a_name_ends_no_comment() {
    let robot = crate::ARM.replace("\"tool-0\"", "\"a&#10;*/ b\"");
    let text =
        "import \"arm.urdf\";\nKinematics cell { solver fk { pose \"a\\n*/ b\" in base; }; };";
    let (cell, found) = crate::load_with(text, &robot);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    assert!(rc_kinematics::rust(&cell).contains("/// Where `a */ b` is in"));
    assert!(rc_kinematics::c(&cell).contains("/* Where `a * / b` is in"));
    assert!(rc_kinematics::python(&cell).contains("# Where `a */ b` is in"));
}

/// Recorded operations need memory: their number has a bound for a solver, and for a file.
#[test]
fn work_without_a_bound_is_refused() {
    let mut robot = String::from("<robot name=\"chain\"><link name=\"l0\"/>");
    for at in 1..=300 {
        robot += &format!(
            "<link name=\"l{at}\"/><joint name=\"j{at}\" type=\"continuous\">\
            <parent link=\"l{}\"/><child link=\"l{at}\"/></joint>",
            at - 1
        );
    }
    robot += "</robot>";
    let of = |solvers: &str| {
        let text = format!("import \"arm.urdf\";\nKinematics cell {{ {solvers} }};");
        crate::load_with(&text, &robot).1
    };
    assert_eq!(of("solver fk { pose l300 in l0; };"), "");
    let found = of("solver m { mass_matrix; };");
    assert!(found.contains("error[too-many-numbers]"), "{found}");
    let many: String = (0..80)
        .map(|at| format!("solver s{at} {{ pose l300 in l0; }};"))
        .collect();
    assert!(of(&many).contains("error[too-many-numbers]"));
}

/// Products of what a file says may be beyond all numbers.
#[test]
fn numbers_that_no_float_has_are_refused() {
    let joint = |parent: &str, child: &str| {
        format!(
            "<joint name=\"{child}\" type=\"fixed\"><origin xyz=\"1e308 0 0\"/>\
            <parent link=\"{parent}\"/><child link=\"{child}\"/></joint>"
        )
    };
    let links = "<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>";
    let joints = joint("a", "b") + &joint("b", "c");
    let robot = format!("<robot name=\"arm\">{links}{joints}</robot>");
    let text = "import \"arm.urdf\";\nKinematics cell { solver fk { pose c in a; }; };";
    let found = crate::load_with(text, &robot).1;
    assert!(
        found.contains("error[bad-value]: the numbers of the robot `arm` are too great"),
        "{found}"
    );
}

/// An acceleration is an effort over a mass.
#[test]
fn joints_that_move_no_mass_have_no_accelerations() {
    let robot = "<robot name=\"thin\"><link name=\"base\"/><link name=\"arm\"><inertial><mass value=\"1\"/></inertial></link>
    <joint name=\"turn\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/></joint></robot>";
    let text = "import \"arm.urdf\";\nKinematics cell { solver go { accelerations; }; };";
    let found = crate::load_with(text, robot).1;
    assert!(
        found.contains("2:31: error[weightless-joint]: the joint `turn` moves no mass"),
        "{found}"
    );
    let text = text.replace("accelerations", "mass_matrix");
    assert_eq!(crate::load_with(&text, robot).1, "");
}

/// A robot without joints has poses, and nothing else.
#[test]
fn nothing_is_asked_of_joints_that_are_not_there() {
    let robot = "<robot name=\"stone\"><link name=\"base\"/></robot>";
    let solvers = |inside: &str| {
        let text =
            format!("import \"arm.urdf\";\nKinematics cell {{ solver fk {{ {inside} }}; }};");
        crate::load_with(&text, robot).1
    };
    assert_eq!(solvers("pose base in base;"), "");
    for inside in [
        "jacobian base in base;",
        "efforts;",
        "mass_matrix;",
        "accelerations;",
    ] {
        let found = solvers(inside);
        assert!(
            found.contains("error[empty-solver]: the robot `stone` has no joint"),
            "{found}"
        );
    }
}

#[test]
fn all_that_is_right_is_read() {
    let found = inside(
        "    // The pose of the tool.
    solver fk { pose \"tool-0\" in base; jacobian \"tool-0\" in base expressed in wrist; };
    solver motion { velocity finger in shoulder; acceleration wrist in base; };
    solver hold { efforts; mass_matrix; gravity 0, 0, -1.62; };
    solver drive { accelerations; payload part at \"tool-0\"; };
    posture home { reach = 20 cm; bend = 90 \"°\"; turn = 0.5; };
    solver find { inverse pose wrist in base; within limits; seed home; tolerance 1 mm 0.1 deg; iterations 9; restarts 0; };
    solver go { inverse velocity wrist in base expressed in slide; within limits; period 1ms; null posture home gain 2; };",
    );
    assert_eq!(found, "");
}
