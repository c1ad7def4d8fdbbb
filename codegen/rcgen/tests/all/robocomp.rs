//! `rcgen import robocomp`: a folder of RoboComp becomes components and networks.

use crate::folders::rcgen;
use std::path::Path;

fn write(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

/// A hand that two minds call, one of them with lines and one with TOML, and two networks.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let idsl = "module Grip { interface Gripper { void open(); }; };\n";
    write(path, "old/interfaces/Grip.idsl", idsl);
    write(
        path,
        "old/hand/hand.cdsl",
        "import \"/robocomp/interfaces/IDSLs/Grip.idsl\";\nComponent Hand\n{\n    Communications\n    {\n        implements Gripper;\n    };\n    \
         language Cpp11;\n    gui Qt(QWidget);\n};\n",
    );
    write(
        path,
        "old/hand/etc/config.toml",
        "[Endpoints]\nGripper = \"tcp -p 10500\"\n\n[Period]\nCompute = 50\nEmergency = 500\n\n[Motor]\n# Where the motor is.\nDevice = \"/dev/ttyUSB0\"\n\
         Limits = [0, 1.5]\n\n[Ice]\nWarn.Connections = \"0\"\n",
    );
    write(path, "old/hand/etc/config", "Period.Compute = 7\n");
    write(
        path,
        "old/hand/etc/config_left",
        "Endpoints.Gripper = \"tcp -p 10501\"\nMotor.Device = \"/dev/ttyUSB1\"\nMotor.Force = 3\n",
    );
    write(path, "old/hand/src/specificworker.cpp", "a\nb\nc\n");
    write(path, "old/hand/src/genericworker.cpp", "generated\n");
    let mind = "import \"Grip.idsl\";\nComponent mind\n{\n    Communications { requires Gripper; };\n    language Python;\n    statemachine \"mind.smdsl\";\n};\n";
    write(path, "old/mind/mind.cdsl", mind);
    write(
        path,
        "old/mind/etc/config",
        "# The hand\nGripperProxy = gripper:tcp -h localhost -p 10501\nAgent.id = 55 # Change id\nspeed=1\n",
    );
    write(path, "old/torn/torn.cdsl", "Component {");
    write(
        path,
        "old/sub.toml",
        "[[components]]\nname = \"right\"\ncwd = \"~/robot/old/hand\"\ncmd = \"bin/Hand etc/config\"\nice_name = \"Gripper:tcp -h localhost -p 10500\"\n\
         [[components]]\nname = \"left\"\ncwd = \"~/robot/old/hand\"\ncmd = \"bin/Hand etc/config_left\"\nice_name = \"Gripper:tcp -h localhost -p 10501\"\n\
         [[components]]\nname = \"mind\"\ncwd = \"~/robot/old/mind\"\ncmd = \"bin/mind etc/config\"\nice_name = \"Mind:tcp -p 1\"\n\
         [[components]]\nname = \"joy\"\ncwd = \"~/robot/joy\"\ncmd = \"bin/Joy etc/config\"\nice_name = \"Joy:tcp -p 2\"\n",
    );
    write(
        path,
        "old/robot.xml",
        "<?xml version=\"1.0\"?>\n<rcmanager>\n<node alias=\"Mind 1\" endpoint=\"mind:tcp -h 10.0.0.9 -p 9\">\
         <dependence alias=\"Hand\"/><workingDir path=\"/home/me/old/mind/src\"/><upCommand command=\"python mind.py etc/config\"/></node>\n\
         <node alias=\"Hand\" endpoint=\"hand:tcp -p 10500\"><upCommand command=\"/opt/bin/hand --Ice.Config=etc/config\"/></node>\n</rcmanager>\n",
    );
    folder
}

#[test]
fn a_folder_of_robocomp_becomes_components_and_networks() {
    let folder = folder();
    let path = folder.path();
    let (code, out, err) = rcgen(path, &["import", "robocomp", "old", "--out", "new"]);
    // The state machine is missing, which the check finds, too.
    assert_eq!(code, 1, "{out}{err}");
    assert!(err.contains("mind.smdsl"), "{err}");
    let text = |name: &str| std::fs::read_to_string(path.join("new").join(name)).expect(name);
    expect_test::expect![[r#""#]].assert_eq(&text("components/Hand/Hand.cdsl"));
    expect_test::expect![[r#""#]].assert_eq(&text("components/Hand/Hand.pdsl"));
    expect_test::expect![[r#""#]].assert_eq(&text("components/Hand/etc/config_left.toml"));
    expect_test::expect![[r#""#]].assert_eq(&text("deployments/sub.ddsl"));
    expect_test::expect![[r#""#]].assert_eq(&text("deployments/robot.ddsl"));
    expect_test::expect![[r#""#]].assert_eq(&text("IMPORT.md"));
    let hand = [
        "check",
        "new/components/Hand/Hand.cdsl",
        "new/components/Hand/etc/config.toml",
        "new/components/Hand/etc/config_left.toml",
        "-I",
        "new/interfaces",
    ];
    let (code, out, err) = rcgen(path, &hand);
    assert_eq!((code, err.contains("error")), (0, false), "{out}{err}");
    // What the user has changed stays.
    write(path, "new/components/Hand/Hand.pdsl", "mine");
    rcgen(path, &["import", "robocomp", "old", "--out", "new"]);
    assert_eq!(text("components/Hand/Hand.pdsl"), "mine");
}

#[test]
fn a_folder_without_robocomp_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "old/Cargo.toml", "[package]\n");
    let (code, out, err) = rcgen(
        folder.path(),
        &["import", "robocomp", "old", "--out", "new"],
    );
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("no file of RoboComp is there"), "{err}");
    let (code, _, err) = rcgen(
        folder.path(),
        &["import", "robocomp", "none", "--out", "new"],
    );
    assert_eq!((code, err.contains("none: ")), (3, true), "{err}");
    assert!(!folder.path().join("new").exists());
}
