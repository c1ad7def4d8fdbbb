//! Middleware settings of a network reach its components; settings of the components override them.

use rc_codegen::FileLoader;
use rc_deploy_network::{self as network, Network, Profile};
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
    let (network, found) = network::load(
        &folder.join("n.ddsl"),
        &network::Overrides::default(),
        &mut sources,
        &loader,
    )
    .expect("the files");
    let found = render(&sources, &found, Format::Short);
    let found = found.replace(&format!("{}/", folder.display()), "");
    (network.expect("a network"), found)
}

/// The middleware settings of an instance.
fn output(network: &Network, name: &str) -> Vec<String> {
    let plan = network.plan(Profile::Dev).expect("a plan");
    let mut components = plan.components.iter();
    let component = components.find(|c| c.name == name).expect("a component");
    let pairs = component.args.windows(2);
    let output = pairs.filter(|pair| pair[0] == "--set-middleware");
    output.map(|pair| pair[1].clone()).collect()
}

const NETWORK: &str = "Deployment n\n{\n    middleware dds { domain 7; peers \"10.0.0.2\", \"b:7410\"; };\n    \
    Component lidar { cdsl \"lidar.cdsl\"; executable \"x\"; };\n    \
    Component user { cdsl \"user.cdsl\"; executable \"x\"; config \"user.toml\"; };\n};\n";

#[test]
fn the_network_supplies_settings_that_a_configuration_omits() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = "[middleware.dds]\nlease = \"500ms\"\npeers = []\n";
    let (network, found) = load(folder.path(), NETWORK, config);
    assert_eq!(found, "");
    let both = ["dds.domain=7", "dds.peers=10.0.0.2,b:7410"];
    assert_eq!(output(&network, "lidar"), both);
    assert_eq!(output(&network, "user"), both[..1]);
    // A component that does not use DDS gets no settings of DDS.
    let text = NETWORK.replace("middleware dds", "middleware iceoryx2; middleware dds");
    let (network, found) = load(folder.path(), &text, config);
    assert_eq!(found, "");
    assert_eq!(output(&network, "lidar"), [""; 0]);
}

#[test]
fn a_rule_for_an_unknown_name_is_reported() {
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
fn qos_overrides_are_checked() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("to write");
    };
    write(
        "Scan.idsl",
        "module M { interface ScanPub { void newScan(float x); void newState(int s); }; };",
    );
    for (name, slots) in [
        ("source", "publishes ScanPub;"),
        ("sink", "subscribesTo ScanPub { deadline 100ms; };"),
    ] {
        let text = format!(
            "import \"Scan.idsl\";\nComponent {name} {{ Communications {{ {slots} }}; language rust; }};\n"
        );
        write(&format!("{name}.cdsl"), &text);
    }
    let check = |own: &str, config: &str| {
        write("sink.toml", config);
        let text = format!(
            "Deployment n {{\nmiddleware ros2 {{ domain 7; {own} }};\n\
             Component source {{ cdsl \"source.cdsl\"; executable \"x\"; }};\n\
             Component sink {{ cdsl \"sink.cdsl\"; executable \"x\"; config \"sink.toml\"; }};\n}};\n"
        );
        write("n.ddsl", &text);
        let mut sources = SourceMap::new();
        let path = folder.path().join("n.ddsl");
        let loaded = network::load(
            &path,
            &network::Overrides::default(),
            &mut sources,
            &FileLoader::default(),
        );
        let found = render(&sources, &loaded.expect("the files").1, Format::Short);
        found.replace(&format!("{}/", folder.path().display()), "")
    };
    // Without rules, no publisher offers the deadline.
    let lacks = |asked: &str| {
        format!(
            "n.ddsl:4:11: error[qos-mismatch]: `sink.ScanPub` requests deadline 100ms, but `source.ScanPub` offers none; \
             requested here at {asked}; offered here at source.cdsl:2:47\n"
        )
    };
    let written = "sink.cdsl:2:48";
    assert_eq!(check("", ""), lacks(written));
    let offered = "qos \"ScanPub.deadline:=50ms\";";
    assert_eq!(check(offered, "[middleware.ros2]\nqos = []\n"), "");
    let open = "[middleware.ros2.qos.\"ScanPub/newScan\"]\ndeadline = \"none\"\n";
    assert_eq!(check("", open), lacks(written));
    assert_eq!(
        check("", "[middleware.ros2.qos.ScanPub]\ndeadline = \"none\"\n"),
        ""
    );
    let found = check(
        "",
        "[middleware.ros2.qos.ScanPub]\nliveliness = \"1s\"\ndeadline = \"none\"\n",
    );
    assert_eq!(
        found,
        "n.ddsl:4:11: error[qos-mismatch]: `sink.ScanPub` requests liveliness 1s, but `source.ScanPub` offers none; \
         requested here at sink.toml:1:18; offered here at source.cdsl:2:47\n"
    );
    let found = check(
        offered,
        "[middleware.ros2]\nqos = [\"ScanPub/newScn.depth:=1\"]\n",
    );
    assert!(
        found.contains("error[unknown-slot]: `qos`: sink has no topic `ScanPub/newScn` (did you mean `ScanPub/newScan`?)"),
        "{found}"
    );
}

#[test]
fn ends_in_different_domains_are_reported() {
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

#[test]
fn an_address_for_a_slot_that_is_not_there_is_found_where_it_stands() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = "[bindings]\nLaser = \"n/laser\"\nLasr = \"n/laser\"\n";
    let (_, found) = load(folder.path(), NETWORK, config);
    assert_eq!(
        found,
        "user.toml:3:1: error[unknown-slot]: `Lasr` is not a slot of user (did you mean `Laser`?)\n"
    );
    let (_, found) = load(folder.path(), NETWORK, "[bindings]\nLaser = \"n laser\"\n");
    assert!(
        found.starts_with("user.toml:2:9: error[bad-address]: `n laser` is not an address"),
        "{found}"
    );
}

#[test]
fn paths_in_findings_have_no_detours() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().canonicalize().expect("a path");
    std::fs::create_dir_all(folder.join("networks")).expect("a folder");
    load(&folder, NETWORK, "[component]\npriod = 3\n");
    let text = NETWORK
        .replace("cdsl \"", "cdsl \"../")
        .replace("config \"", "config \"../");
    let path = folder.join("networks/n.ddsl");
    std::fs::write(&path, text).expect("to write");
    let mut sources = SourceMap::new();
    let overrides = network::Overrides::default();
    let loaded = network::load(&path, &overrides, &mut sources, &FileLoader::default());
    let (network, found) = loaded.expect("the files");
    let found = render(&sources, &found, Format::Short);
    let place = folder.join("user.toml").display().to_string();
    assert!(
        found.starts_with(&format!("{place}:2:1: error[unknown-key]")),
        "{found}"
    );
    let plan = network
        .expect("a network")
        .plan(Profile::Dev)
        .expect("a plan");
    assert!(plan.components[1].args.contains(&place), "{plan:?}");
}
