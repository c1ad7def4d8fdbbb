//! Networks with the simulator of this repository, and scenes of their own.

use crate::load::{Overrides, load};
use crate::model::Network;
use rc_codegen::FileLoader;
use rc_diagnostics::{Format, SourceMap, render};
use std::path::Path;

const SCENE: &str = r#"<innerModel>
    <differentialrobot id="base"><laser id="front"/><laser id="back"/></differentialrobot>
</innerModel>"#;

/// Loads a network with a scene `world.xml`, and returns what was found, a line each.
fn loaded(scene: Option<&str>, fields: &str, set: &[String]) -> (Option<Network>, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let cdsl = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../components/rcis/rcis.cdsl");
    let ddsl = format!(
        "Deployment n\n{{\n    Component rcis\n    {{\n        cdsl \"{}\";\n{fields}\n    }};\n}};\n",
        cdsl.display()
    );
    if let Some(scene) = scene {
        std::fs::write(folder.path().join("world.xml"), scene).expect("a file");
    }
    let path = folder.path().join("n.ddsl");
    std::fs::write(&path, ddsl).expect("a file");
    let overrides = Overrides {
        parameters: set,
        ..Overrides::default()
    };
    let mut sources = SourceMap::new();
    let read = load(&path, &overrides, &mut sources, &FileLoader::new(&[]));
    let (network, found) = read.expect("a file");
    let lines = render(&sources, &found, Format::Short);
    let here = format!("{}/", folder.path().display());
    (network, lines.replace(&here, ""))
}

const WORLD: &str = "        parameters { inner_model \"world.xml\"; };\n";

fn found(scene: Option<&str>, slots: &str) -> String {
    loaded(scene, &format!("{WORLD}        slots {{ {slots} }};"), &[]).1
}

const REST: &str = "poses \"base\"; bases \"base\"; generic_bases \"base\"; pose_topics \"base\";";

#[test]
fn all_members_are_the_devices_of_the_scene() {
    let fields = format!("{WORLD}        slots {{ all; }};");
    let (network, found) = loaded(Some(SCENE), &fields, &[]);
    assert!(!found.contains("error"), "{found}");
    let network = network.expect("a network");
    let arrays = network.deployment.instances[0].arrays.iter();
    let listed = arrays.filter(|array| !array.members.is_empty());
    let listed: Vec<(&str, Vec<&str>)> = listed
        .map(|array| {
            let members = array.members.iter().map(|member| member.text.as_str());
            (array.name.text.as_str(), members.collect())
        })
        .collect();
    let base = vec!["base"];
    let expected = [
        ("lasers", vec!["front", "back"]),
        ("poses", base.clone()),
        ("bases", base.clone()),
        ("generic_bases", base.clone()),
        ("pose_topics", base),
    ];
    assert_eq!(listed, expected);
}

#[test]
fn lists_that_differ_from_the_scene_are_found() {
    let right = format!("lasers \"front\", \"back\"; {REST}");
    assert!(!found(Some(SCENE), &right).contains("error"));
    let missing = found(Some(SCENE), &format!("lasers \"front\"; {REST}"));
    assert!(
        missing.contains("n.ddsl:7:17: error[unknown-member]: the scene world.xml has the member `back` of `lasers`, which the network does not list"),
        "{missing}"
    );
    assert!(
        missing.contains("slots { lasers \"front\", \"back\"; }"),
        "{missing}"
    );
    let other = found(
        Some(SCENE),
        &format!("lasers \"front\", \"bakc\", \"back\"; {REST}"),
    );
    assert!(
        other.contains("n.ddsl:7:33: error[unknown-member]: the scene world.xml has no member `bakc` of `lasers`"),
        "{other}"
    );
    let none = found(Some(SCENE), &format!("{right} imus \"imu\";"));
    assert!(
        none.contains("has no member `imu` of `imus`") && none.contains("(remove `imus`"),
        "{none}"
    );
    let (_, nothing) = loaded(Some(SCENE), WORLD, &[]);
    assert_eq!(nothing.matches("unknown-member").count(), 5, "{nothing}");
    let both = found(Some(SCENE), "all; lasers \"front\";");
    assert!(
        both.contains("error[duplicate-name]: `all` has the members of `lasers` as well"),
        "{both}"
    );
}

#[test]
fn scenes_that_cannot_be_read_are_found() {
    let none = found(None, "all;");
    assert!(
        none.contains("n.ddsl:6:22: error[bad-scene]: `rcis` cannot start with its scene: world.xml: No such file"),
        "{none}"
    );
    let wrong = found(Some("<innerModel><lsaer id='a'/></innerModel>"), "all;");
    assert!(
        wrong.contains("error[bad-scene]") && wrong.contains("lsaer"),
        "{wrong}"
    );
    let name = found(
        Some("<innerModel><laser id='my-laser'/></innerModel>"),
        "all;",
    );
    assert!(
        name.contains(
            "error[bad-member]: the id `my-laser` of the scene cannot be a member of `lasers`"
        ),
        "{name}"
    );
    // The command line names another scene.
    let set = ["rcis.inner_model=\"other.xml\"".to_owned()];
    let fields = format!("{WORLD}        slots {{ all; }};");
    let (_, other) = loaded(Some(SCENE), &fields, &set);
    assert!(
        other.contains("error[bad-scene]") && other.contains("other.xml"),
        "{other}"
    );
}
