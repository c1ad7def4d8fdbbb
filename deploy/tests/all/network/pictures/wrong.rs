//! Invalid networks are drawn, with the diagnostics at the affected elements.

use super::load;
use rc_deploy_graph::{Finding, Graph};
use std::path::Path;
use std::process::{Command, Output};

/// Errors at a component, a slot, a connection, a group and a host.
const BROKEN: &str = r#"
Deployment broken
{
    middleware iceoryx2;
    Host pi { address "10.0.0.2"; };
    Host nobody { address "10.0.0.3"; };
    Component simulator { cdsl "COMPONENTS/simulator/simulator.cdsl"; host pi; };
    Component lonely { cdsl "COMPONENTS/joint_controller/joint_controller.cdsl"; host pi; };
    Component lost { cdsl "nowhere/lost.cdsl"; };
    Group watch
    {
        middleware dds;
        Component monitor { cdsl "COMPONENTS/pose_monitor/pose_monitor.cdsl"; };
        export Nothing;
    };
};
"#;

/// Where the parts of the project are, also from elsewhere.
fn write(folder: &Path, text: &str) -> std::path::PathBuf {
    let components = Path::new("../components")
        .canonicalize()
        .expect("components");
    let file = folder.join("broken.ddsl");
    let text = text.replace("COMPONENTS", &components.to_string_lossy());
    std::fs::write(&file, text).expect("a file");
    file
}

/// The graph of the invalid network.
pub(super) fn broken(folder: &Path) -> Graph {
    let file = write(folder, BROKEN);
    let (network, sources, found) = load(&file);
    Graph::of(&network, &sources, &found)
}

fn finding<'a>(graph: &'a Graph, code: &str) -> &'a Finding {
    let found = graph.findings.iter().find(|f| f.code == code);
    found.unwrap_or_else(|| panic!("no {code} in {:#?}", graph.findings))
}

#[test]
fn each_diagnostic_is_drawn_at_its_element() {
    let folder = tempfile::tempdir().expect("a folder");
    let graph = broken(folder.path());
    assert!(graph.has_errors());
    let slot = &finding(&graph, "no-provider").slots[0];
    assert_eq!(
        (slot.component.as_str(), slot.slot.as_str()),
        ("lonely", "JointMotor")
    );
    assert_eq!(finding(&graph, "component-not-found").components, ["lost"]);
    assert_eq!(
        finding(&graph, "unknown-export").group.as_deref(),
        Some("watch")
    );
    assert_eq!(
        finding(&graph, "unused-host").host.as_deref(),
        Some("nobody")
    );
    let mismatch = finding(&graph, "middleware-mismatch");
    let refused = &graph.connections[mismatch.connections[0]];
    assert_eq!(refused.from.component, "simulator");
    assert_eq!(refused.to.component, "watch.monitor");
    assert_eq!(refused.address, None);
    assert_eq!((mismatch.line, mismatch.severity), (13, "error"));
}

fn rcdeploy(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    command
        .current_dir(folder)
        .args(args)
        .output()
        .expect("rcdeploy")
}

#[test]
fn an_invalid_network_is_drawn_with_exit_code_1() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), BROKEN);
    let args = ["graph", "broken.ddsl", "--unbuilt", "-o", "broken.svg"];
    let drawn = rcdeploy(folder.path(), &args);
    assert_eq!(drawn.status.code(), Some(1), "{drawn:?}");
    assert!(
        String::from_utf8_lossy(&drawn.stderr).contains("no-provider"),
        "{drawn:?}"
    );
    let picture = std::fs::read_to_string(folder.path().join("broken.svg")).expect("a picture");
    let page = roxmltree::Document::parse(&picture).expect("XML");
    let texts: Vec<&str> = page.descendants().filter_map(|n| n.text()).collect();
    let has = |part: &str| texts.iter().any(|t| t.contains(part));
    assert!(
        has("lost [") && has("JointMotor [") && has("error[component-not-found]"),
        "{texts:?}"
    );
    let red = page
        .descendants()
        .filter(|n| n.attribute("stroke") == Some("#b00020"));
    assert!(red.count() >= 4);
    // Temporary files are removed.
    let left = std::fs::read_dir(folder.path())
        .expect("the folder")
        .count();
    assert_eq!(left, 2);

    let plan = rcdeploy(folder.path(), &["plan", "broken.ddsl", "--unbuilt"]);
    assert_eq!(
        (plan.status.code(), plan.stdout.len()),
        (Some(1), 0),
        "{plan:?}"
    );
    let usage = rcdeploy(folder.path(), &["graph", "broken.ddsl", "--format", "png"]);
    assert_eq!(usage.status.code(), Some(2), "{usage:?}");
    let nowhere = ["graph", "broken.ddsl", "--unbuilt", "-o", "no/where.svg"];
    let nowhere = rcdeploy(folder.path(), &nowhere);
    assert_eq!(nowhere.status.code(), Some(3), "{nowhere:?}");
    assert!(
        String::from_utf8_lossy(&nowhere.stderr).contains("no/where.svg"),
        "{nowhere:?}"
    );
}

#[test]
fn all_errors_of_many_components_are_reported_together() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut text = "Deployment broken {\n".to_owned();
    for number in 0..100 {
        let cdsl = format!("c{number}.cdsl");
        let component = format!(
            "import \"Laser.idsl\";\nComponent c{number} {{ Communications {{ requires Laser, Missing; }}; language rust; }};\n"
        );
        std::fs::write(folder.path().join(&cdsl), component).expect("a file");
        text += &format!("Component c{number} {{ cdsl \"{cdsl}\"; ready 0s; }};\n");
    }
    write(folder.path(), &(text + "};\n"));
    let check = rcdeploy(
        folder.path(),
        &["check", "broken.ddsl", "--format", "short"],
    );
    let said = String::from_utf8_lossy(&check.stderr).into_owned();
    assert_eq!(check.status.code(), Some(1));
    for number in [0, 57, 99] {
        let unknown = format!("c{number}.cdsl:2:");
        let time = format!("broken.ddsl:{}:", number + 2);
        assert!(
            said.contains(&unknown) && said.contains(&time),
            "{number}: {said}"
        );
    }
    let plan = rcdeploy(
        folder.path(),
        &["graph", "broken.ddsl", "--unbuilt", "--format", "json"],
    );
    let graph: serde_json::Value = serde_json::from_slice(&plan.stdout).expect("one document");
    assert_eq!(graph["components"].as_array().map(Vec::len), Some(100));
}
