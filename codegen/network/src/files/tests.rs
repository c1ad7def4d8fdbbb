//! Networks with components of this repository whose parameters name files.

use crate::load::{Overrides, load};
use rc_codegen::FileLoader;
use rc_diagnostics::{Format, SourceMap, render};
use std::path::{Path, PathBuf};

const ARM: &str = r#"<innerModel><transform id="base">
    <joint id="elbow" min="-1" max="1"/><laser id="front"/>
</transform></innerModel>"#;

/// The findings about one component in a network beside some files, a line each.
fn found(component: &str, fields: &str, files: &[(&str, &str)]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    let cdsl = folder_of(component).join(format!("{component}.cdsl"));
    check(folder.path(), &cdsl, fields)
}

/// The folder of a component of this repository.
fn folder_of(component: &str) -> PathBuf {
    let components = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../components");
    components.join(component)
}

/// The findings about one component in a network in a folder.
fn check(folder: &Path, cdsl: &Path, fields: &str) -> String {
    let ddsl = format!(
        "Deployment n\n{{\n    Component c\n    {{\n        cdsl \"{}\";\n{fields}\n    }};\n}};\n",
        cdsl.display()
    );
    let path = folder.join("n.ddsl");
    std::fs::write(&path, ddsl).expect("a file");
    let mut sources = SourceMap::new();
    let read = load(
        &path,
        &Overrides::default(),
        &mut sources,
        &FileLoader::new(&[]),
    );
    let (_, found) = read.expect("a file");
    let lines = render(&sources, &found, Format::Short);
    let here = format!("{}/", folder.display());
    let lines = lines.replace(&here, "");
    let ours = lines.lines().filter(|line| {
        line.contains("[bad-file]") || line.contains("[unknown-element]") || line.contains("scene")
    });
    ours.map(|line| format!("{line}\n")).collect()
}

#[test]
fn a_tree_that_cannot_be_read_is_found() {
    let file = "parameters { file \"arm.xml\"; };";
    assert_eq!(found("inner_model", file, &[("arm.xml", ARM)]), "");
    assert_eq!(
        found("inner_model", file, &[]),
        "n.ddsl:6:14: error[bad-file]: `c` cannot read its `file`: arm.xml: No such file or directory\n"
    );
    let broken = found("inner_model", file, &[("arm.xml", "<innerModel><jiont/>")]);
    assert!(
        broken.starts_with("n.ddsl:6:14: error[bad-file]: `c` cannot read its `file`: arm.xml: "),
        "{broken}"
    );
    assert_eq!(found("inner_model", "", &[]), "", "no file is named");
}

#[test]
fn an_included_file_is_searched_as_the_component_searches_it() {
    let files = [
        (
            "world.xml",
            "<innerModel><include path=\"arm.xml\"/></innerModel>",
        ),
        ("parts/arm.xml", ARM),
    ];
    let without = "parameters { file \"world.xml\"; };";
    assert!(found("inner_model", without, &files).contains("error[bad-file]"));
    let with = "config \"c.toml\"; parameters { file \"world.xml\"; };";
    let config = ("c.toml", "[parameters]\nsearch = [\"parts\"]\n");
    assert_eq!(
        found("inner_model", with, &[files[0], files[1], config]),
        ""
    );
}

#[test]
fn a_map_that_cannot_be_read_is_found() {
    for component in ["simulator", "pose_monitor"] {
        let map = "parameters { map \"a.map\"; };";
        assert_eq!(
            found(component, map, &[]),
            "n.ddsl:6:14: error[bad-file]: `c` cannot read its `map`: a.map: No such file or directory\n"
        );
        let wrong = found(component, map, &[("a.map", "robot 0 0 0\nwal 0 0 1 1\n")]);
        assert!(
            wrong.contains("error[bad-file]: `c` cannot read its `map`: a.map:2: "),
            "{wrong}"
        );
        assert_eq!(found(component, "", &[]), "", "the map of the repository");
    }
}

/// Behind a link, `..` is the folder of what it leads to.
#[test]
fn a_component_behind_a_link_has_its_files() {
    for component in ["simulator", "arm_monitor"] {
        let folder = tempfile::tempdir().expect("a folder");
        let link = folder.path().join(component);
        std::os::unix::fs::symlink(folder_of(component), &link).expect("a link");
        let cdsl = link.join(format!("{component}.cdsl"));
        assert_eq!(check(folder.path(), &cdsl, ""), "", "{component}");
    }
}

#[test]
fn a_joint_that_the_scene_does_not_have_is_found() {
    let of = |joint: &str| {
        let config = format!(
            "[parameters]\ninner_model = \"arm.xml\"\n\n[[parameters.joints]]\nmotor = \"m\"\njoint = \"{joint}\"\n"
        );
        let files = [("arm.xml", ARM), ("c.toml", &config)];
        found("arm_monitor", "config \"c.toml\";", &files)
    };
    assert_eq!(of("elbow"), "");
    assert_eq!(
        of("elbwo"),
        "n.ddsl:3:15: error[unknown-element]: the `joints[0].joint` of `c`: its `inner_model` has no node `elbwo` (did you mean `elbow`?)\n"
    );
    assert!(of("front").contains("`front` of its `inner_model` is not a joint"));
    // The scene itself is reported once.
    let none = "parameters { inner_model \"arm.xml\"; };";
    let none = found("arm_monitor", none, &[]);
    assert!(none.contains("error[bad-scene]"), "{none}");
    assert!(!none.contains("[bad-file]"), "{none}");
}
