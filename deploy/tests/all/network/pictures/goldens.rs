//! Golden output for the networks of the project.

use super::load;
use expect_test::expect_file;
use rc_deploy_graph::{Graph, GraphFormat};
use rc_deploy_network::preview::Preview;
use rc_deploy_network::{Network, Profile};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_middleware::RunDirectory;
use std::path::Path;

pub(super) const NETWORKS: [&str; 5] = ["patrol", "patrol_fast", "camera", "joints", "speech"];

/// A network of the project. Tests run in the folder of this crate.
fn shipped(name: &str) -> (Network, SourceMap, Diagnostics) {
    load(Path::new(&format!("../components/networks/{name}.ddsl")))
}

pub(super) fn draw(name: &str, format: GraphFormat) -> String {
    let (network, sources, found) = shipped(name);
    let graph = Graph::of(&network, &sources, &found);
    assert!(!graph.has_errors());
    graph.draw(format).expect("a picture")
}

#[test]
fn pictures_of_the_shipped_networks() {
    for name in NETWORKS {
        expect_file![format!("../../../golden/{name}.svg")]
            .assert_eq(&draw(name, GraphFormat::Svg));
        expect_file![format!("../../../golden/{name}.mmd")]
            .assert_eq(&draw(name, GraphFormat::Mermaid));
        expect_file![format!("../../../golden/{name}.dot")]
            .assert_eq(&draw(name, GraphFormat::Dot));
        expect_file![format!("../../../golden/{name}.json")]
            .assert_eq(&draw(name, GraphFormat::Json));
    }
}

/// Replaces paths, so that the text is the same on every machine.
fn stable(text: &str, network: &Network) -> String {
    let executable = network.programs.executable(0, Profile::Release);
    let executable = executable.expect("cargo").expect("a program");
    let target = executable.ancestors().nth(2).expect("a target folder");
    let root = Path::new("..").canonicalize().expect("the project");
    let run = RunDirectory::of(network.name());
    let places = [
        (target.canonicalize().unwrap_or(target.into()), "TARGET"),
        (target.into(), "TARGET"),
        (run.path().into(), "RUN"),
        (root, "ROOT"),
    ];
    places.iter().fold(text.to_owned(), |text, (path, word)| {
        text.replace(&*path.to_string_lossy(), word)
    })
}

#[test]
fn plans_of_the_shipped_networks() {
    for name in NETWORKS {
        let (network, _, _) = shipped(name);
        let preview = Preview::of(&network, Profile::Release).expect("a plan");
        let text = stable(&preview.to_string(), &network);
        expect_file![format!("../../../golden/{name}.plan.txt")].assert_eq(&text);
        let json = serde_json::to_string_pretty(&preview).expect("JSON");
        let json = stable(&json, &network) + "\n";
        expect_file![format!("../../../golden/{name}.plan.json")].assert_eq(&json);
        // Only paths of users may be longer.
        let long = text.lines().filter(|l| l.chars().count() > 100);
        assert_eq!(long.collect::<Vec<_>>(), Vec::<&str>::new());
    }
}
