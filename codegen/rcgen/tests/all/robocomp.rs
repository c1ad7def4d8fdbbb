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
         language Cpp11;\n    gui Qt(QWidget);\n}; // { or }\n",
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
    // No other form of `etc/config`.
    write(
        path,
        "old/hand/etc/config.simulated",
        "Period.Compute = nan\nMotor.Device = \"/dev/null\"\n",
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
    let lonely = "import \"Grip.idsl\";\nComponent lonely\n{\n    Communications { requires Gripper; };\n    language Cpp;\n    statemachine \"../../outside.smdsl\";\n};\n";
    write(path, "outside.smdsl", "not of the folder");
    write(
        path,
        "old/walker/walker.cdsl",
        "Component walker { language Cpp; statemachine \"../machines/walk.smdsl\"; };\n",
    );
    write(path, "old/machines/walk.smdsl", "a machine");
    write(path, "old/lonely/lonely.cdsl", lonely);
    write(
        path,
        "old/lonely/etc/config",
        "Proxies.Gripper = \"gripper:tcp -h 10.0.0.8 -p 10777\"\n",
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
         <dependence alias=\"Hand\"/><dependence alias=\"storm\"/><workingDir path=\"/home/me/old/mind/src\"/><upCommand command=\"python mind.py etc/config\"/></node>\n\
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
    expect_test::expect![[r#"
        import "Grip.idsl";
        Component Hand
        {
            Communications
            {
                implements Gripper;
            };
            language Cpp11;
            gui Qt(QWidget);
            parameters "Hand.pdsl";
            period 50ms;
        }; // { or }
    "#]]
    .assert_eq(&text("components/Hand/Hand.cdsl"));
    expect_test::expect![[r#"
        ComponentParams Hand
        {
            group Motor
            {
                /// Where the motor is.
                Device string "/dev/ttyUSB0";
                Limits double[] [0.0, 1.5];
                Force int 3;
            };
        };
    "#]]
    .assert_eq(&text("components/Hand/Hand.pdsl"));
    expect_test::expect![[r#"
        #:schema ../generated/config.schema.json

        [parameters.Motor]
        Device = "/dev/ttyUSB1"
        Force = 3
    "#]]
    .assert_eq(&text("components/Hand/etc/config_left.toml"));
    expect_test::expect![[r#"
        // From sub.toml.
        // Left out: joy: bin/Joy etc/config

        Deployment sub
        {
            Component right
            {
                cdsl "../components/Hand/Hand.cdsl";
            };

            Component left
            {
                cdsl "../components/Hand/Hand.cdsl";
                config "../components/Hand/etc/config_left.toml";
            };

            Component mind
            {
                cdsl "../components/mind/mind.cdsl";
            };

            bind mind.Gripper -> left.Gripper;
        };
    "#]]
    .assert_eq(&text("deployments/sub.ddsl"));
    expect_test::expect![[r#"
        // From robot.xml.

        Deployment robot
        {
            Host p_10_0_0_9
            {
                address "10.0.0.9";
            };

            Component Mind_1
            {
                cdsl "../components/mind/mind.cdsl";
                host p_10_0_0_9;
                after Hand;
            };

            Component Hand
            {
                cdsl "../components/Hand/Hand.cdsl";
            };

            external Mind_1.Gripper;
        };
    "#]]
    .assert_eq(&text("deployments/robot.ddsl"));
    expect_test::expect![[r"
        # What stays to be done

        ## Hand

        - `Period.Emergency` is left out: `emergency` runs with the period of `compute`
        - `Period.Compute` is left out: it is no period in milliseconds
        - 3 lines of code in old/hand/src stay; move them into the worker that `rcgen generate` makes (docs/from-robocomp.md)

        ## lonely

        - its state machine `../../outside.smdsl` is no .smdsl of the imported folder
        - `Gripper`: no component of the folder serves 10.0.0.8:10777

        ## mind

        - its state machine `mind.smdsl` is missing
        - `Agent.id` is left out: it belongs to DSR, whose place the world of a network takes (docs/world.md)

        ## The network sub

        - `joy` is left out: no component of the folder is that of `bin/Joy etc/config`

        ## The network robot

        - host `10.0.0.9`: `rcdeploy up` reaches it by ssh; a `user` may be missing (docs/several-machines.md)
        - `Mind_1` does not wait for `storm`: the network has no such component
        - `Mind_1.Gripper` is external: no component of the network serves localhost:10501

        ## Other files

        - old/torn/torn.cdsl is left out: it is not a description of a component; `rcgen check` says why

        ## All components

        - `rcgen check` lists what their descriptions say otherwise. `rcgen generate` makes the code around the worker.
        - Programs that speak Ice cannot be reached. An `external` slot waits for a component that serves it.
    "]].assert_eq(&text("IMPORT.md"));
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
    let simulated = text("components/Hand/etc/config.simulated.toml");
    assert!(simulated.contains("\"/dev/null\""), "{simulated}");
    let walker = text("components/walker/walker.cdsl");
    assert!(walker.contains("statemachine \"walk.smdsl\""), "{walker}");
    assert_eq!(text("components/walker/walk.smdsl"), "a machine");
    assert!(!path.join("new/components/lonely/outside.smdsl").exists());
    // A file that the user has changed stays.
    for mine in ["components/Hand/Hand.pdsl", "IMPORT.md"] {
        write(path, &format!("new/{mine}"), "mine");
        rcgen(path, &["import", "robocomp", "old", "--out", "new"]);
        assert_eq!(text(mine), "mine");
    }
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
