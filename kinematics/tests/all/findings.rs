//! What is wrong in a text.

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
        cell.kdsl:8:56: warning[without-effect]: `gravity` changes nothing: this solver gives no `efforts`
        cell.kdsl:8:64: error[bad-value]: expected an acceleration up to 1000000 m/s², found the number 1000000000
        cell.kdsl:9:44: error[duplicate-name]: `gravity` is said twice; first declared here at cell.kdsl:9:27
        cell.kdsl:10:5: error[unknown-declaration]: expected `solver`, found `slover` (did you mean `solver`?)
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
    let twice = format!("import \"arm.urdf\";\nimport \"arm.urdf\";\n{solver}");
    expect![[r#"
        cell.kdsl:2:8: error[second-robot]: a second robot is imported: solvers are those of one robot; the first one at cell.kdsl:1:8 (write a file for each robot, or connect them to one in a URDF)
    "#]].assert_eq(&of(&twice));
    expect![[r#"
        cell.kdsl:1:1: error[empty-file]: expected `Kinematics NAME { … };`, found an empty file
    "#]]
    .assert_eq(&of(""));
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
    for inside in ["jacobian base in base;", "efforts;", "mass_matrix;"] {
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
    solver hold { efforts; mass_matrix; gravity 0, 0, -1.62; };",
    );
    assert_eq!(found, "");
}
