//! The numbers of actuators and of joints, over transmissions.

use crate::load_with;
use rc_kinematics::Cell;
use rc_robot::State;

/// Links in a row, with a joint of each kind.
fn robot(transmissions: &str) -> String {
    let link = |name: &str| format!("<link name=\"{name}\"/>");
    let joint = |name: &str, kind: &str, parent: &str, child: &str, more: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"0 0 1\"/>\
            <limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>{more}</joint>"
        )
    };
    [
        "<robot name=\"r\">".to_owned(),
        ["a", "b", "c", "d", "tool"].map(link).concat(),
        joint("turn", "revolute", "a", "b", ""),
        joint("lift", "prismatic", "b", "c", ""),
        joint("follow", "revolute", "c", "d", "<mimic joint=\"turn\"/>"),
        joint("ball", "spherical", "d", "tool", ""),
        transmissions.to_owned(),
        "</robot>".to_owned(),
    ]
    .concat()
}

fn simple(joint: &str, inside: &str, reduction: &str) -> String {
    format!(
        "<transmission name=\"t_{joint}\"><type>transmission_interface/SimpleTransmission</type>\
        <joint name=\"{joint}\">{inside}</joint><actuator name=\"m_{joint}\">{reduction}</actuator></transmission>"
    )
}

const TEXT: &str = "import \"arm.urdf\";
Kinematics cell
{
    solver out { actuator positions; actuator velocities; actuator efforts; };
    solver back { joint positions; joint velocities; joint efforts; };
};";

fn load(transmissions: &str, text: &str) -> (Option<Cell>, String) {
    load_with(text, &robot(transmissions))
}

#[test]
fn actuators_turn_as_their_reductions_say() {
    let turn = simple(
        "turn",
        "<hardwareInterface>x</hardwareInterface><offset> 0.25 </offset>",
        "<mechanicalReduction>-50</mechanicalReduction>",
    );
    // The form of ros2_control, and that of the PR2.
    let lift = format!(
        "<ros2_control name=\"s\" type=\"system\"><hardware/>{}</ros2_control>",
        simple(
            "lift",
            "<mechanical_reduction>400</mechanical_reduction>",
            "<mechanical_reduction>1</mechanical_reduction>"
        )
        .replace("type>", "plugin>")
    );
    let yaw = "<transmission name=\"t\" type=\"pr2_mechanism_model/SimpleTransmission\"><actuator name=\"m\"/>\
        <joint name=\"ball.yaw\"/><mechanicalReduction>2</mechanicalReduction></transmission>";
    let (cell, found) = load(&format!("{turn}{lift}{yaw}"), TEXT);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let coordinates = ["turn", "lift", "ball.roll", "ball.pitch", "ball.yaw"];
    assert_eq!(cell.robot.coordinates, coordinates);
    let names: Vec<&str> = cell
        .robot
        .transmissions
        .iter()
        .map(|own| own.actuator.as_str())
        .collect();
    assert_eq!(names, ["m_turn", "m_lift", "m"]);
    let state = State {
        positions: vec![0.75, 0.5, 0.1, 0.2, 0.3],
        velocities: vec![1.0, 0.25, 0.4, 0.5, 0.6],
        accelerations: vec![0.0; 5],
    };
    let efforts = [100.0, 80.0, 1.0, 2.0, 3.0];
    let motors = cell.solvers[0].run(&state, &efforts, &[]).expect("numbers");
    let expected = [
        [-25.0, 200.0, 0.1, 0.2, 0.6],
        [-50.0, 100.0, 0.4, 0.5, 1.2],
        [-2.0, 0.2, 1.0, 2.0, 1.5],
    ];
    let near = |one: &[f64], other: &[f64]| {
        for (a, b) in one.iter().zip(other) {
            assert!((a - b).abs() < 1e-12, "{one:?} {other:?}");
        }
    };
    near(&motors, &expected.concat());
    // The way back.
    let turned = State {
        positions: motors[..5].to_vec(),
        velocities: motors[5..10].to_vec(),
        accelerations: vec![0.0; 5],
    };
    let back = cell.solvers[1]
        .run(&turned, &motors[10..], &[])
        .expect("numbers");
    near(
        &back,
        &[&state.positions[..], &state.velocities, &efforts].concat(),
    );

    // In millimetres, a motor that lifts turns as far for a thousand times the number.
    let text = TEXT
        .replace("solver out", "lengths mm; solver out")
        .replace("actuator efforts;", "")
        .replace("joint efforts;", "");
    let lift = simple(
        "lift",
        "<offset>0.1</offset>",
        "<mechanicalReduction>400</mechanicalReduction>",
    );
    let (cell, found) = load(&lift, &text);
    assert_eq!(found, "");
    let state = State::still(vec![0.75, 500.0, 0.1, 0.2, 0.3]);
    let cell = cell.expect("a cell");
    let motors = cell.solvers[0].run(&state, &efforts, &[]).expect("numbers");
    near(&motors[..2], &[0.75, 160.0]);
    let back = cell.solvers[1].run(&State::still(motors[..5].to_vec()), &efforts, &[]);
    near(&back.expect("numbers"), &state.positions);
}

#[test]
fn transmissions_of_other_kinds_are_left_out() {
    let right = simple("turn", "", "<mechanicalReduction>50</mechanicalReduction>");
    let differential = right.replace("Simple", "Differential");
    for (transmissions, what) in [
        (
            differential.clone(),
            "its type is `transmission_interface/DifferentialTransmission`, not `SimpleTransmission`",
        ),
        (
            format!("{right}{right}"),
            "the joint `turn` has the transmission `t_turn` already",
        ),
        (
            simple("follow", "", ""),
            "there is no joint `follow` of one coordinate that moves on its own",
        ),
        (
            simple("ball", "", ""),
            "there is no joint `ball` of one coordinate",
        ),
        (right.replace("type>", "kind>"), "it has no type"),
        (right.replace("50", "0"), "its reduction is 0, its offset 0"),
        (
            right.replace("50", "fifty"),
            "expected a number, found `fifty`",
        ),
        (right.replace("50", "NaN"), "expected a number, found `NaN`"),
        (
            right.replace(
                "<joint name=\"turn\">",
                "<joint name=\"turn\"/><joint name=\"lift\">",
            ),
            "it has a second `<joint>`",
        ),
        (right.replace("actuator", "motor"), "it has no `<actuator>`"),
    ] {
        let (_, found) = load(&transmissions, TEXT);
        let what = format!("note[transmission-not-read]: this transmission is not read: {what}");
        assert!(found.contains(&what), "{found}");
    }
    let (_, found) = load(
        &format!("{differential}{right}{}", simple("ball", "", "")),
        TEXT,
    );
    assert!(
        found.contains("not `SimpleTransmission`; nor is one other"),
        "{found}"
    );
    let (_, found) = load(&differential, TEXT);
    assert!(
        found.contains("error[bad-value]: the robot `r` has no transmission"),
        "{found}"
    );
    let mixed =
        "import \"arm.urdf\"; Kinematics c { solver s { pose tool in a; joint positions; }; };";
    let (_, found) = load(&right, mixed);
    let what = "error[bad-value]: an output of `joint` takes the numbers of actuators";
    assert!(found.contains(what), "{found}");
    let (_, found) = load(
        &right,
        &TEXT.replace("actuator velocities", "actuator speeds"),
    );
    let what =
        "error[syntax-error]: expected `efforts`, `positions` or `velocities`, found `speeds`";
    assert!(found.contains(what), "{found}");
    let metres = TEXT.replace("solver out", "lengths mm; solver out");
    let (_, found) = load(&right, &metres);
    assert!(found.contains("not with `lengths mm`"), "{found}");
}
