//! The frames of poses are types of printed Rust.

use crate::load_with;
use crate::printed::compiled;
use std::process::Command;

/// Names of links that are no names of types, or equal ones.
const ROBOT: &str = r#"<robot name="r">
    <link name="base"/><link name="tool-0"/><link name="tool_0"/><link name="2f"/><link name="loop"/>
    <joint name="a" type="continuous"><parent link="base"/><child link="tool-0"/><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><axis xyz="1 0 1"/></joint>
    <joint name="b" type="continuous"><parent link="tool-0"/><child link="tool_0"/><origin xyz="0.1 0 0.2"/><axis xyz="0 1 1"/></joint>
    <joint name="c" type="fixed"><parent link="tool_0"/><child link="2f"/><origin xyz="0 0 1" rpy="1 0 0"/></joint>
    <joint name="d" type="fixed"><parent link="tool_0"/><child link="loop"/></joint>
</robot>"#;

const MAIN: &str = "mod cell;
fn near(one: &[[f64; 4]; 4], other: &[[f64; 4]; 4]) {
    for (a, b) in one.iter().flatten().zip(other.iter().flatten()) {
        assert!((a - b).abs() < 1e-12, \"{one:?} {other:?}\");
    }
}
fn main() {
    let at = cell::fk(&[0.3, -0.7]);
    let (first, second) = (at.pose_tool_0_in_base, at.pose_2f_in_tool_0);
    let whole: cell::Pose<cell::frames::frame_2f, cell::frames::base> = first.then(&second);
    near(&whole, &at.pose_2f_in_base);
    near(&whole.inverse(), &at.pose_base_in_2f);
    near(&first.then(&first.inverse()), &at.pose_base_in_base);
    let mut target = first;
    target[0][3] = 1.0;
    assert_eq!(std::mem::size_of_val(&target), 16 * 8);
    assert!(cell::reach(&at.pose_2f_in_base, &[0.2, -0.6]).reached);
    // WRONG
}
";

#[test]
fn poses_of_other_frames_do_not_compile() {
    for choices in ["", "matrices column_major; frames innermodel;"] {
        let text = format!(
            "import \"arm.urdf\"; Kinematics cell {{ {choices} solver fk {{ pose \"tool-0\" in base; pose \"2f\" in \"tool-0\"; pose \"2f\" in base;
            pose base in \"2f\"; pose base in base; pose loop in base; }};
            solver one {{ pose tool_0 in \"2f\"; }};
            solver reach {{ inverse pose \"2f\" in base; tolerance 1 um 1e-6 rad; }}; }};"
        );
        let (cell, found) = load_with(&text, ROBOT);
        assert_eq!(found, "");
        let printed = rc_kinematics::rust(&cell.expect("a cell"));
        for name in ["tool_0", "tool_0_", "frame_2f", "frame_loop", "base"] {
            assert!(printed.contains(&format!("pub enum {name} {{}}")), "{name}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("cell.rs"), printed).expect("a file");
        std::fs::write(at("main.rs"), MAIN).expect("a file");
        let options = ["--edition=2021", "-Dwarnings"];
        compiled("rustc", &options, &at("main.rs"), &at("main"));
        let output = Command::new(at("main")).output().expect("it starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        for wrong in [
            "second.then(&first);",
            "let _: cell::Pose<cell::frames::base, cell::frames::base> = whole;",
            "cell::reach(&first, &[0.0; 2]);",
        ] {
            std::fs::write(at("main.rs"), MAIN.replace("// WRONG", wrong)).expect("a file");
            let mut rustc = Command::new("rustc");
            let rustc = rustc
                .args(options)
                .arg("--emit=metadata")
                .arg(at("main.rs"));
            let output = rustc
                .current_dir(folder.path())
                .output()
                .expect("a compiler");
            let errors = String::from_utf8_lossy(&output.stderr);
            assert!(!output.status.success());
            assert!(
                errors.contains("error[E0308]: mismatched types"),
                "{errors}"
            );
        }
    }
}
