//! `rcgen` with robots and their solvers.

use crate::folders::rcgen;
use crate::rcgen::succeeds;

const ARM: &str = r#"<robot name="arm">
    <link name="base"/>
    <link name="tool"/>
    <joint name="turn" type="revolute">
        <parent link="base"/> <child link="tool"/> <origin xyz="1 0 0"/> <axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="5" velocity="2"/>
    </joint>
</robot>
"#;

const CELL: &str = "import \"arm.urdf\";\nKinematics cell { solver fk { pose tool in base; jacobian tool in base; }; \
    solver reach { inverse pose tool in base; within limits; iterations 20; restarts 4; }; };\n";

#[test]
fn solvers_are_checked_laid_out_printed_and_exported() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    std::fs::write(path.join("arm.urdf"), ARM).expect("a file");
    std::fs::write(path.join("cell.kdsl"), CELL).expect("a file");
    assert_eq!(succeeds(path, &["check", "cell.kdsl", "arm.urdf", "."]), "");
    succeeds(path, &["fmt", "cell.kdsl"]);
    let laid_out = std::fs::read_to_string(path.join("cell.kdsl")).expect("a file");
    assert!(
        laid_out.contains("\n    solver fk\n    {\n        pose tool in base;\n"),
        "{laid_out}"
    );
    let view = succeeds(path, &["view", "cell.kdsl"]);
    let view: serde_json::Value = serde_json::from_str(&view).expect("JSON");
    assert_eq!(view["joints"][0]["upper"], 1.0);
    assert_eq!(
        view["solvers"][0]["outputs"][1]["shape"],
        serde_json::json!([6, 1])
    );
    assert_eq!(view["inverses"][0]["joints"], serde_json::json!(["turn"]));
    assert_eq!(view["inverses"][0]["mostMotions"], 100);
    let with_loop = CELL.replace(
        "{ solver fk",
        "{ loop bar { tool = base; point; }; solver fk",
    );
    std::fs::write(path.join("closed.kdsl"), with_loop).expect("a file");
    let view = succeeds(path, &["view", "closed.kdsl"]);
    let view: serde_json::Value = serde_json::from_str(&view).expect("JSON");
    assert_eq!(
        view["loops"],
        serde_json::json!([{ "name": "bar", "type": "point", "frames": ["tool", "base"] }])
    );
    for (to, file) in [
        ("rust", "cell.rs"),
        ("c", "cell.h"),
        ("cpp", "cell.hpp"),
        ("python", "cell.py"),
        ("ctypes", "cell_ctypes.py"),
    ] {
        let export = ["export", "cell.kdsl", "--to", to, "--out", "out"];
        let written = succeeds(path, &export);
        assert!(written.contains(&format!("out/{file}")), "{written}");
        // A second export changes nothing; a file of somebody else stays.
        assert_eq!(succeeds(path, &export), "");
        std::fs::write(path.join("out").join(file), "mine\n").expect("a file");
        assert_eq!(rcgen(path, &export).0, 2);
    }
    let (code, _, _) = rcgen(
        path,
        &["export", "cell.kdsl", "--to", "dds", "--out", "out"],
    );
    assert_eq!(code, 2);
    let (code, _, errors) = rcgen(path, &["export", "arm.urdf", "--to", "c", "--out", "out"]);
    assert_eq!(code, 2);
    assert!(
        errors.contains("arm.urdf is not a .kdsl or .ilk file"),
        "{errors}"
    );
}

/// A model in ILK is written, read again and printed as code.
#[test]
fn solvers_become_models_in_ilk_and_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    std::fs::write(path.join("arm.urdf"), ARM).expect("a file");
    let text = |outputs: &str| {
        format!("import \"arm.urdf\";\nKinematics cell {{ solver fk {{ {outputs} }}; }};\n")
    };
    std::fs::write(
        path.join("cell.kdsl"),
        text("pose tool in base; jacobian tool in base; acceleration tool in base;"),
    )
    .expect("a file");
    let export = ["export", "cell.kdsl", "--to", "ilk", "--out", "models"];
    let written = succeeds(path, &export);
    assert!(written.contains("models/fk.ilk") && written.contains("models/model-constants.lua"));
    assert_eq!(succeeds(path, &["check", "models"]), "");
    // What is written is laid out.
    assert_eq!(succeeds(path, &["fmt", "--check", "models"]), "");
    let model = path.join("models/fk.ilk");
    let text_of_model = std::fs::read_to_string(&model).expect("a file");
    std::fs::write(&model, text_of_model.replace(" = ", "=")).expect("a file");
    assert!(succeeds(path, &["fmt", "models"]).contains("fk.ilk"));
    assert_eq!(
        std::fs::read_to_string(&model).expect("a file"),
        text_of_model
    );
    let view = succeeds(path, &["view", "models/fk.ilk"]);
    assert!(view.contains("\"fr_turn\""), "{view}");
    let code = succeeds(
        path,
        &["export", "models/fk.ilk", "--to", "c", "--out", "code"],
    );
    assert!(code.contains("arm_fk.h"), "{code}");
    std::fs::write(path.join("cell.kdsl"), text("efforts;")).expect("a file");
    let (code, _, errors) = rcgen(path, &export);
    assert_eq!(code, 2);
    assert!(errors.contains("ILK has poses and Jacobians"), "{errors}");
}

/// The robot is a graph of the domain `kinematics`, without a file in between.
#[test]
fn a_robot_is_asked_as_a_graph() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    std::fs::write(path.join("arm.urdf"), ARM).expect("a file");
    let ask = |query: &[&str]| succeeds(path, &[&["query", "arm.urdf"], query].concat());
    assert!(ask(&[]).contains("pose_wrt_predecessor(joint Joint)"));
    let pose = ask(&["pose_wrt_predecessor", "joint=turn"]);
    assert!(pose.contains("[1.0, 0.0, 0.0,"), "{pose}");
    let text = "MATCH (b:Frame {name: 'base'}), (t:Frame {name: 'tool'}) RETURN pose(t, b) AS back";
    let back = ask(&[text]);
    assert!(back.contains("[-1.0, "), "{back}");
    std::fs::write(path.join("arm.urdf"), "<robot name=\"arm\"/>").expect("a file");
    let (code, _, errors) = rcgen(path, &["query", "arm.urdf"]);
    assert!(code == 1 && errors.contains("arm.urdf:1"), "{errors}");
}

/// Two robots with one set of solvers have a header and a namespace each, and `check` refuses a namespace that
/// C++ has already.
#[test]
fn a_component_in_cpp_has_its_robots_as_namespaces() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    std::fs::write(path.join("arm.urdf"), ARM).expect("a file");
    std::fs::write(path.join("cell.kdsl"), CELL).expect("a file");
    let component = |other: &str| {
        let text = format!(
            "Component c {{ Communications {{ }}; language cpp; kinematics \"cell.kdsl\" as limb; \
             kinematics \"cell.kdsl\" as {other}; }};\n"
        );
        std::fs::write(path.join("c.cdsl"), text).expect("a file");
    };
    component("other");
    assert_eq!(succeeds(path, &["check", "c.cdsl"]), "");
    succeeds(path, &["c.cdsl"]);
    let read = |name: &str| {
        let file = path.join("generated").join(name);
        std::fs::read_to_string(file).expect("a file")
    };
    for name in ["limb", "other"] {
        let header = read(&format!("kinematics/{name}.h"));
        assert!(
            header.contains(&format!("\nnamespace {name}\n")),
            "{header}"
        );
        let include = format!("#include \"kinematics/{name}.h\"");
        assert!(read("genericworker.h").contains(&include));
    }
    assert!(read("component.cmake").contains("\nrobocomp_kinematics(c)\n"));
    for taken in ["std", "limb", "class"] {
        component(taken);
        let (code, _, errors) = rcgen(path, &["check", "c.cdsl"]);
        assert_eq!(code, 1, "{errors}");
        assert!(errors.contains("error["), "{errors}");
    }
}
