//! Nodes, services and topics that coincide in ROS 2, and ends of a connection that do not, are
//! reported before the start, each once.

use rc_codegen::FileLoader;
use rc_codegen::note::Note;
use rc_deploy_network as network;
use rc_diagnostics::{Format, SourceMap, render};
use std::fs;

/// A component with these communications.
fn component(name: &str, communications: &str) -> (String, String) {
    let imports = [
        "Laser",
        "LaserPub",
        "FullPoseEstimationPub",
        "DifferentialRobot",
    ];
    let imports = imports
        .map(|name| format!("import \"{name}.idsl\";\n"))
        .concat();
    let text = format!(
        "{imports}Component {name} {{ Communications {{ {communications} }}; language rust; }};\n"
    );
    (format!("{name}.cdsl"), text)
}

/// The errors and warnings for a network `robot` of these components in `robot.ddsl`.
fn findings(further: &[(&str, &str)], content: &str) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut files = vec![
        component("lidar", "implements Laser;"),
        component("base", "implements Laser, DifferentialRobot;"),
        component("scans", "publishes LaserPub;"),
        component("poses", "publishes FullPoseEstimationPub;"),
        component("reader", "subscribesTo LaserPub;"),
        component("mixed", "implements Laser; publishes LaserPub(ros2);"),
        (
            "robot.ddsl".to_owned(),
            format!("Deployment robot {{\n{content}}};\n"),
        ),
    ];
    files.extend(
        further
            .iter()
            .map(|(n, t)| ((*n).to_owned(), (*t).to_owned())),
    );
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }
    let mut sources = SourceMap::new();
    let loader = FileLoader::new(&[]);
    let path = folder.path().join("robot.ddsl");
    let (network, mut found) =
        network::load(&path, &network::Overrides::default(), &mut sources, &loader)
            .expect("a file");
    let network = network.expect("a network");
    network.programs.check_generated(&mut found);
    rc_deploy::process::machine::check(&network, false, &mut found);
    let reported = render(&sources, &found, Format::Short);
    let reported = reported.replace(&format!("{}/", folder.path().display()), "");
    let unmeant = [
        ": note[",
        "[no-publisher]",
        "[unused-import]",
        "[missing-generated]",
        "[stale-generated]",
    ];
    let lines = reported.lines();
    let lines = lines.filter(|line| !unmeant.iter().any(|u| line.contains(u)));
    let without_help = lines.map(|line| line.split(" (").next().unwrap_or(line).to_owned());
    without_help.collect()
}

fn reported(content: &str) -> Vec<String> {
    findings(&[], content)
}

const NOTHING: [&str; 0] = [];

/// `a.b` and `a_b`, with additional clauses for the second one.
fn two_nodes(more: &str) -> String {
    format!(
        "middleware ros2;\nGroup a {{ Component b {{ cdsl \"poses.cdsl\"; }}; }};\nComponent a_b {{ cdsl \"poses.cdsl\"; {more} }};\n"
    )
}

#[test]
fn two_nodes_of_one_name_are_reported() {
    let expected = "robot.ddsl:4:11: warning[ros-same-node]: `a.b` and `a_b` are one node in ROS 2, `/robot/a_b`: tools of ROS 2 take them for the same; another one at robot.ddsl:3:21";
    assert_eq!(reported(&two_nodes("")), [expected]);
    for right in [
        "middleware ros2 { node \"other\"; };",
        "middleware ros2 { namespace \"/other\"; };",
        "domain 7;",
        "env { ROS_DOMAIN_ID \"7\"; };",
        "middleware iceoryx2;",
        "args \"--ros-args\", \"-r\", \"__node:=other\";",
    ] {
        assert_eq!(reported(&two_nodes(right)), NOTHING, "{right}");
    }
    let one_domain = "domain 7; }; Component x { cdsl \"reader.cdsl\"; middleware ros2 { node \"a_b\"; }; env { ROS_DOMAIN_ID \"7\"; };";
    let found = reported(&two_nodes(one_domain));
    assert!(found[0].contains("`a_b` and `x` are one node"), "{found:?}");
    assert_eq!(found.len(), 1, "{found:?}");
}

#[test]
fn nodes_that_do_not_speak_dds_are_reported_once() {
    let with = |implementation: &str| {
        reported(&format!(
            "middleware ros2;\nComponent a {{ cdsl \"poses.cdsl\"; env {{ RMW_IMPLEMENTATION \"{implementation}\"; }}; }};\n\
             Component b {{ cdsl \"scans.cdsl\"; }};\n"
        ))
    };
    let expected = "robot.ddsl:3:11: warning[other-rmw]: RMW_IMPLEMENTATION is rmw_zenoh_cpp: nodes of ROS 2 in this environment do not speak DDS, so they and `a` do not find each other";
    assert_eq!(with("rmw_zenoh_cpp"), [expected]);
    assert_eq!(with("rmw_fastrtps_cpp"), NOTHING);
}

#[test]
fn one_slot_makes_a_node_and_ten_equal_nodes_are_reported_once() {
    let one = |n: usize| {
        format!(
            "Component c{n} {{ cdsl \"mixed.cdsl\"; middleware iceoryx2; middleware ros2 {{ node \"x\"; }}; }};\n"
        )
    };
    let ten: String = (0..10).map(one).collect();
    let found = reported(&ten);
    assert_eq!(found.len(), 1, "{found:?}");
    let expected = "robot.ddsl:3:11: warning[ros-same-node]: `c0`, `c1`, `c2`, `c3`, `c4`, `c5`, `c6`, `c7` and 2 more are one node";
    assert!(found[0].starts_with(expected), "{found:?}");
}

#[test]
fn nodes_with_parameters_cannot_share_a_name() {
    let files = [
        ("p.pdsl", "ComponentParams p { gain int 1; };\n"),
        (
            "p.cdsl",
            "Component p { Communications { }; language rust; parameters \"p.pdsl\"; };\n",
        ),
    ];
    let found = findings(
        &files,
        "middleware ros2 { node \"p\"; };\nComponent a { cdsl \"p.cdsl\"; };\nComponent b { cdsl \"p.cdsl\"; };\n",
    );
    let expected = "robot.ddsl:4:11: error[ros-same-node]: `a` and `b` are one node in ROS 2, `/robot/p`: only one of those with parameters could start; another one at robot.ddsl:3:11; named here at robot.ddsl:2:19";
    assert_eq!(found, [expected]);
}

#[test]
fn two_servers_of_one_service_are_reported_once_per_slot() {
    let two = |more: &str| {
        format!(
            "middleware ros2;\nComponent a {{ cdsl \"base.cdsl\"; middleware ros2 {{ remap \"Laser:=/front\"; }}; }};\nComponent b {{ cdsl \"lidar.cdsl\"; {more} }};\n"
        )
    };
    let rule = "middleware ros2 { remap \"Laser:=/front\"; };";
    let found = reported(&two(rule));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].starts_with("robot.ddsl:4:11: error[ros-same-service]: `a.Laser/get")
            && found[0].ends_with(
                "`: a service has one server; the other one at robot.ddsl:3:11; renamed here at robot.ddsl:3:51; renamed here at robot.ddsl:4:52"
            ),
        "{found:?}"
    );
    assert_eq!(reported(&two(&format!("domain 7; {rule}"))), NOTHING);
    assert_eq!(
        reported(&two("middleware ros2 { remap \"Laser:=/rear\"; };")),
        NOTHING
    );
    // Names of a configuration in the namespace of its node.
    let config = [(
        "b.toml",
        "[middleware.ros2]\nnamespace = \"/\"\n[middleware.ros2.remap]\n\"Laser/getLaserData\" = \"front/getLaserData\"\n",
    )];
    let found = findings(&config, &two("config \"b.toml\";"));
    let expected = "robot.ddsl:4:11: error[ros-same-service]: `a.Laser/getLaserData` and `b.Laser/getLaserData` are one service in ROS 2, `/front/getLaserData`: a service has one server; the other one at robot.ddsl:3:11; renamed here at robot.ddsl:3:51; renamed here at b.toml:3:1";
    assert_eq!(found, [expected]);
}

#[test]
fn names_that_ros_cannot_distinguish_are_reported_once_per_component() {
    let found = reported(
        "middleware ros2;\nComponent base__1 { cdsl \"base.cdsl\"; };\nComponent base_1 { cdsl \"base.cdsl\"; };\n",
    );
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("error[ros-same-service]"), "{found:?}");
    // Also for topics, where subscribers would receive samples of both publishers.
    let two = |first: &str| {
        format!(
            "middleware ros2;\nComponent s__1 {{ cdsl \"scans.cdsl\"; }};\nComponent s_1 {{ cdsl \"scans.cdsl\"; {first} }};\nComponent x {{ cdsl \"reader.cdsl\"; }};\nComponent y {{ cdsl \"reader.cdsl\"; }};\nbind x.LaserPub -> s__1.LaserPub;\nbind y.LaserPub -> s_1.LaserPub;\n"
        )
    };
    let expected = "robot.ddsl:4:11: error[ros-same-topic]: `s__1.LaserPub/pushLaserData` and `s_1.LaserPub/pushLaserData` are one topic in ROS 2, `/robot/s_1/LaserPub/pushLaserData`: they would meet, though no connection joins them; the other one at robot.ddsl:3:11";
    assert_eq!(reported(&two("")), [expected]);
    assert_eq!(
        reported(&two("middleware ros2 { node \"other\"; };")),
        [expected]
    );
}

#[test]
fn slots_of_one_component_are_compared() {
    let files = [component(
        "two",
        "implements Laser as front__1, Laser as front_1, Laser as rear;",
    )];
    let [(name, text)] = &files;
    let files = [(name.as_str(), text.as_str())];
    let found = findings(
        &files,
        "middleware ros2;\nComponent a { cdsl \"two.cdsl\"; };\n",
    );
    assert_eq!(found.len(), 1, "{found:?}");
    let expected = "robot.ddsl:3:11: error[ros-same-service]: `a.front__1/getLaserAndBStateData` and `a.front_1/getLaserAndBStateData` are one service in ROS 2, `/robot/a/front_1/getLaserAndBStateData`: a service has one server; one of both at two.cdsl:5:";
    assert!(found[0].starts_with(expected), "{found:?}");
}

/// Operations may be equal; the ends of a service refuse each other because of a different one.
#[test]
fn services_of_one_name_have_one_type() {
    let idsl =
        |more: &str| format!("module M {{ interface Arm {{ idempotent int get(); {more} }}; }};\n");
    let cdsl = |role: &str| {
        format!(
            "import \"Arm.idsl\"; Component c {{ Communications {{ {role} Arm; }}; language rust; }};\n"
        )
    };
    let (one, other) = (idsl(""), idsl("idempotent int more();"));
    let (serves, calls) = (cdsl("implements"), cdsl("requires"));
    let files = [
        ("one/Arm.idsl", one.as_str()),
        ("one/serves.cdsl", &serves),
        ("one/calls.cdsl", &calls),
        ("other/Arm.idsl", &other),
        ("other/serves.cdsl", &serves),
        ("other/calls.cdsl", &calls),
    ];
    let group = |name: &str, rule: &str| {
        format!(
            "Group {name} {{ Component s {{ cdsl \"{name}/serves.cdsl\"; {rule} }};\nComponent c {{ cdsl \"{name}/calls.cdsl\"; {rule} }}; }};\n"
        )
    };
    let network = |rule: &str| {
        format!(
            "middleware ros2;\n{}{}",
            group("one", ""),
            group("other", rule)
        )
    };
    assert_eq!(findings(&files, &network("")), NOTHING);
    // Only the client of one of them: its service has one server, of another type.
    let strange = network("").replace(
        "\"other/calls.cdsl\";",
        "\"other/calls.cdsl\"; middleware ros2 { remap \"Arm/get:=/robot/one/s/Arm/get\"; };",
    );
    let expected = "robot.ddsl:6:11: error[ros-same-service]: `one.s.Arm/get` and `other.c.Arm/get` are one service in ROS 2, `/robot/one/s/Arm/get`: their types differ, so they cannot meet there; the other one at robot.ddsl:3:23; renamed here at robot.ddsl:6:58";
    assert_eq!(findings(&files, &strange), [expected]);
}

#[test]
fn topics_of_one_name_have_one_type() {
    let at_scan = |second: &str| {
        format!(
            "middleware ros2;\nComponent a {{ cdsl \"scans.cdsl\"; middleware ros2 {{ remap \"LaserPub/pushLaserData:=/scan\"; }}; }};\nComponent b {{ {second} }};\n"
        )
    };
    let found = reported(&at_scan(
        "cdsl \"poses.cdsl\"; middleware ros2 { remap \"FullPoseEstimationPub/newFullPose:=/scan\"; };",
    ));
    let expected = "robot.ddsl:4:11: error[ros-same-topic]: `a.LaserPub/pushLaserData` and `b.FullPoseEstimationPub/newFullPose` are one topic in ROS 2, `/scan`: their types differ, so they cannot meet there; the other one at robot.ddsl:3:11; renamed here at robot.ddsl:3:52; renamed here at robot.ddsl:4:52";
    assert_eq!(found, [expected]);
    // Equal types at one name are intended, and a service is not a topic.
    for right in [
        "cdsl \"scans.cdsl\"; middleware ros2 { remap \"LaserPub/pushLaserData:=/scan\"; };",
        "cdsl \"lidar.cdsl\"; middleware ros2 { remap \"Laser/getLaserData:=/scan\"; };",
    ] {
        assert_eq!(reported(&at_scan(right)), NOTHING, "{right}");
    }
}

/// The errors of generation for ROS 2, for components that were generated for another middleware.
#[test]
fn types_that_coincide_in_ros_are_reported_once() {
    let idsl = "module M { struct Data { int a; }; struct D_Ata { int a; }; interface A { void push(Data x, D_Ata y); }; };\n";
    let cdsl =
        "import \"A.idsl\"; Component c { Communications { publishes A; }; language rust; };\n";
    let note = Note {
        component: "c".to_owned(),
        model: "0".repeat(16),
        middleware: "iceoryx2".to_owned(),
    };
    let generated = format!("const NOTE: &[u8] = b\"{}\";\n", note.to_byte_string());
    let files = [
        ("A.idsl", idsl),
        ("one.cdsl", cdsl),
        ("other.cdsl", cdsl),
        ("Cargo.toml", ""),
        ("generated/src/backend.rs", generated.as_str()),
    ];
    let network = |middleware: &str| {
        format!(
            "middleware {middleware};\nComponent a {{ cdsl \"one.cdsl\"; }};\nComponent b {{ cdsl \"other.cdsl\"; }};\n"
        )
    };
    assert_eq!(findings(&files, &network("iceoryx2")), NOTHING);
    let expected = "A.idsl:1:43: error[ros-name]: `Data` and `D_Ata` become `msg/Data` and `msg/DAta` in ROS 2, which differ only in case; other declaration at A.idsl:1:19";
    assert_eq!(findings(&files, &network("ros2")), [expected]);
}

#[test]
fn ends_of_a_connection_must_have_one_name() {
    let renamed = "middleware ros2 { remap \"LaserPub:=/scan\"; };";
    let two = |publisher: &str, subscriber: &str| {
        format!(
            "middleware ros2;\nComponent a {{ cdsl \"scans.cdsl\"; {publisher} }};\nComponent b {{ cdsl \"reader.cdsl\"; {subscriber} }};\n"
        )
    };
    let meet = "`a.LaserPub/pushLaserData` and `b.LaserPub/pushLaserData` are connected, and do not meet in ROS 2: one is `/scan/pushLaserData`, the other one `/robot/a/LaserPub/pushLaserData`";
    let expected = format!(
        "robot.ddsl:4:11: warning[ros-renamed-alone]: {meet}; renamed here at robot.ddsl:3:52"
    );
    assert_eq!(reported(&two(renamed, "")), [expected]);
    let found = reported(&two("", renamed));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].contains("3:11: warning[ros-renamed-alone]"),
        "{found:?}"
    );
    // Both ends renamed to one name, or to names that a program in between uses, or one end
    // unknown.
    let other = "middleware ros2 { remap \"LaserPub:=/filtered\"; };";
    let alone = "args \"--ros-args\", \"-r\", \"LaserPub:=/scan\";";
    for (publisher, subscriber) in [(renamed, renamed), (renamed, other), (alone, "")] {
        assert_eq!(reported(&two(publisher, subscriber)), NOTHING);
    }
}

#[test]
fn refused_connections_are_not_reported_again() {
    let idsl = |ty: &str| format!("module M {{ interface Pub {{ void push({ty} value); }}; }};\n");
    let cdsl = |role: &str| {
        format!(
            "import \"Pub.idsl\"; Component c {{ Communications {{ {role} Pub; }}; language rust; }};\n"
        )
    };
    let (one, other) = (idsl("int"), idsl("float"));
    let (sends, hears) = (cdsl("publishes"), cdsl("subscribesTo"));
    let files = [
        ("one/Pub.idsl", one.as_str()),
        ("one/c.cdsl", &sends),
        ("other/Pub.idsl", &other),
        ("other/c.cdsl", &hears),
    ];
    let found = findings(
        &files,
        "middleware ros2 { remap \"Pub:=/x\"; };\nComponent a { cdsl \"one/c.cdsl\"; };\nComponent b { cdsl \"other/c.cdsl\"; };\n",
    );
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("error[type-mismatch]"), "{found:?}");
}
