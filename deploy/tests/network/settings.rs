//! What a network sets of a middleware reaches its components, and what they set themselves comes first.

use rc_codegen::FileLoader;
use rc_deploy::network::{self, Network, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use std::path::Path;

fn load(folder: &Path, ddsl: &str, config: &str) -> (Network, String) {
    let write = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).expect("to write");
    };
    for (name, slots) in [("lidar", "implements Laser;"), ("user", "requires Laser;")] {
        let text = format!(
            "import \"Laser.idsl\";\nComponent {name} {{ Communications {{ {slots} }}; language rust; }};\n"
        );
        write(&format!("{name}.cdsl"), &text);
    }
    write("user.toml", config);
    write("n.ddsl", ddsl);
    let mut sources = SourceMap::new();
    let loader = FileLoader::default();
    let (network, found) =
        network::load(&folder.join("n.ddsl"), None, &mut sources, &loader).expect("the files");
    let found = render(&sources, &found, Format::Short);
    let found = found.replace(&format!("{}/", folder.display()), "");
    (network.expect("a network"), found)
}

/// What an instance is told of middlewares.
fn told(network: &Network, name: &str) -> Vec<String> {
    let plan = network.plan(Profile::Dev).expect("a plan");
    let mut components = plan.components.iter();
    let component = components.find(|c| c.name == name).expect("a component");
    let pairs = component.args.windows(2);
    let told = pairs.filter(|pair| pair[0] == "--set-middleware");
    told.map(|pair| pair[1].clone()).collect()
}

const NETWORK: &str = "Deployment n\n{\n    middleware dds { domain 7; peers \"10.0.0.2\", \"b:7410\"; };\n    \
    Component lidar { cdsl \"lidar.cdsl\"; executable \"x\"; };\n    \
    Component user { cdsl \"user.cdsl\"; executable \"x\"; config \"user.toml\"; };\n};\n";

#[test]
fn what_a_configuration_leaves_open_comes_from_the_network() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = "[middleware.dds]\nlease = \"500ms\"\npeers = []\n";
    let (network, found) = load(folder.path(), NETWORK, config);
    assert_eq!(found, "");
    let both = ["dds.domain=7", "dds.peers=10.0.0.2,b:7410"];
    assert_eq!(told(&network, "lidar"), both);
    assert_eq!(told(&network, "user"), both[..1]);
    // Who has nothing to do with DDS hears nothing of it.
    let text = NETWORK.replace("middleware dds", "middleware iceoryx2; middleware dds");
    let (network, found) = load(folder.path(), &text, config);
    assert_eq!(found, "");
    assert_eq!(told(&network, "lidar"), [""; 0]);
}

#[test]
fn a_rule_for_a_name_that_is_not_there_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let config =
        "[middleware.ros2.remap]\nLaser = \"/front\"\n\"/any\" = \"/other\"\nLasr = \"/front\"\n";
    let (_, found) = load(folder.path(), NETWORK, config);
    assert_eq!(
        found,
        "user.toml:1:1: error[unknown-slot]: `remap`: user has no `Lasr` (did you mean `Laser`?)\n"
    );
}

#[test]
fn ends_in_different_domains_are_found_whoever_chooses_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, found) = load(folder.path(), NETWORK, "[middleware.dds]\ndomain = 3\n");
    assert_eq!(
        found,
        "n.ddsl:5:15: error[domain-mismatch]: `user.Laser` and `lidar.Laser` are in different domains: 3 and 7; \
         set here at user.toml:2:10; set here at n.ddsl:3:22\n"
    );
    let (_, found) = load(folder.path(), NETWORK, "[middleware.dds]\ndomain = 7\n");
    assert_eq!(found, "");
}
