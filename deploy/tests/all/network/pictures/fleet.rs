//! Forty components on two hosts, in nested groups, over two middlewares.

use super::load;
use rc_deploy_graph::{Graph, GraphFormat};
use rc_diagnostics::{Format, render};
use std::path::Path;

/// The communications of each kind of component.
const KINDS: [(&str, &str); 11] = [
    ("lidar", "publishes LaserPub;"),
    ("eye", "publishes CameraPub;"),
    (
        "base",
        "implements DifferentialRobot; publishes FullPoseEstimationPub;",
    ),
    ("bus", "implements JointMotor;"),
    (
        "localiser",
        "subscribesTo LaserPub, FullPoseEstimationPub; implements FullPoseEstimation;",
    ),
    ("filter", "subscribesTo LaserPub; implements Laser;"),
    ("avoider", "requires Laser, DifferentialRobot;"),
    ("hand", "requires JointMotor; subscribesTo CameraPub;"),
    ("planner", "requires Laser, FullPoseEstimation, Speech;"),
    ("voice", "implements Speech;"),
    (
        "watcher",
        "subscribesTo FullPoseEstimationPub; requires Speech;",
    ),
];

fn component(name: &str, kind: &str, host: &str) -> String {
    format!("Component {name} {{ cdsl \"{kind}.cdsl\"; host {host}; }};\n")
}

fn text() -> String {
    let on_robot = |names: &[&str]| -> String {
        names
            .iter()
            .map(|name| component(name, name, "robot"))
            .collect()
    };
    let mut out = String::from(
        "Deployment fleet\n{\nmiddleware dds;\nHost robot { address \"10.0.0.2\"; user \"pi\"; };\n\
         Host station { address \"10.0.0.9\"; };\n",
    );
    for (side, exports) in [("front", "Laser, LaserPub"), ("rear", "Laser")] {
        let arm =
            "{ middleware iceoryx2;\n".to_owned() + &on_robot(&["eye", "hand", "bus"]) + "};\n";
        out += &format!(
            "Group {side} {{\n{}Group left {arm}Group right {arm}bind filter.LaserPub -> lidar.LaserPub;\nexport {exports};\n}};\n",
            on_robot(&["lidar", "filter"]),
        );
    }
    out += &format!(
        "Group drive {{\n{}bind avoider.Laser -> front.Laser;\n\
         export DifferentialRobot, FullPoseEstimationPub, FullPoseEstimation;\n}};\nGroup mission {{\n{}",
        on_robot(&["base", "localiser", "avoider"]),
        component("voice", "voice", "station")
    );
    for number in 0..6 {
        let side = if number % 2 == 0 { "front" } else { "rear" };
        out += &component(&format!("planner{number}"), "planner", "station");
        out += &format!("bind planner{number}.Laser -> {side}.Laser;\n");
    }
    out += "export Speech;\n};\n";
    for number in 0..14 {
        out += &component(&format!("watcher{number}"), "watcher", "station");
    }
    out + "};\n"
}

/// The graph of the network. Its files stay in the folder.
pub(super) fn fleet(folder: &Path) -> Graph {
    for (name, clauses) in KINDS {
        let words = clauses.split([' ', ',', ';']);
        let used = words.filter(|word| word.starts_with(char::is_uppercase));
        let imports: String = used
            .map(|interface| match interface {
                "CameraPub" => "import \"Camera.idsl\";\n".to_owned(),
                interface => format!("import \"{interface}.idsl\";\n"),
            })
            .collect();
        let cdsl = format!(
            "{imports}Component {name} {{ Communications {{ {clauses} }}; language rust; }};\n"
        );
        std::fs::write(folder.join(format!("{name}.cdsl")), cdsl).expect("a file");
    }
    let file = folder.join("fleet.ddsl");
    std::fs::write(&file, text()).expect("a file");
    let (network, sources, found) = load(&file);
    let graph = Graph::of(&network, &sources, &found);
    assert!(
        !graph.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    graph
}

#[test]
fn a_large_network_is_a_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let graph = fleet(folder.path());
    assert_eq!((graph.components.len(), graph.hosts.len()), (40, 2));
    let drawn = graph.draw(GraphFormat::Svg).expect("a picture");
    let page = roxmltree::Document::parse(&drawn).expect("XML");
    let boxes = |round: &str| {
        let all = page.descendants();
        all.filter(|n| n.attribute("rx") == Some(round)).count()
    };
    // Two hosts, and eight groups.
    assert_eq!((boxes("4"), boxes("10")), (40, 10));
    let names = |name: &str| {
        let all = page.descendants().filter(|n| n.has_tag_name("text"));
        all.filter(|n| n.text() == Some(name)).count()
    };
    assert_eq!(
        (names("hand"), names("LaserPub"), names("watcher13")),
        (4, 5, 1)
    );
    assert!(drawn.contains("stroke-dasharray"), "dds has dashes");
}
