//! Where relative paths start.

use crate::live::{load, of};
use rc_configuration::{PathFolders, UntypedValue, folder_of_paths};
use serde_json::json;
use std::path::{Path, PathBuf};

const PDSL: &str = r#"ComponentParams mapper
{
    map path "../maps/house.map";
    trace path "";
    search path[] ["meshes", "/usr/share"];
    name string "house.map";
    mode path plain {plain, fine};
    group log { file path "run.log"; };
    list floors { map path; };
};"#;

#[test]
fn paths_of_a_configuration_start_at_its_folder_and_those_in_etc_at_the_component() {
    for (file, folder) in [
        ("/robot/guard/etc/config.toml", "/robot/guard"),
        ("/robot/networks/guard.toml", "/robot/networks"),
        ("/etc/guard.toml", "/"),
        ("config.toml", ""),
    ] {
        assert_eq!(
            folder_of_paths(Path::new(file)),
            Path::new(folder),
            "{file}"
        );
    }
}

#[test]
fn a_worker_gets_absolute_paths_and_other_texts_as_they_are() {
    let model = load(PDSL);
    let text = "[[parameters.floors]]\nmap = \"first.map\"\n[[parameters.floors]]\nmap = \"/all/second.map\"\n";
    let live = of(model.clone(), text);
    let values = live.values();
    let folders = PathFolders {
        configuration: "/robot/networks".into(),
        defaults: "/robot/guard".into(),
    };
    let seen = values.with_paths_from(&folders, &model.parameters);
    let path = PathBuf::from;
    assert_eq!(seen.path("map"), path("/robot/guard/../maps/house.map"));
    assert_eq!(seen.path("trace"), path(""), "it names nothing");
    let search = [path("/robot/guard/meshes"), path("/usr/share")];
    assert_eq!(seen.paths("search"), search);
    assert_eq!(seen.text("name"), "house.map");
    assert_eq!(seen.group("log").path("file"), path("/robot/guard/run.log"));
    let floors: Vec<PathBuf> = seen.list("floors").iter().map(|f| f.path("map")).collect();
    let expected = [path("/robot/networks/first.map"), path("/all/second.map")];
    assert_eq!(floors, expected);
    // Those that tools show and save stay as they are written.
    assert_eq!(values.path("map"), path("../maps/house.map"));
}

#[test]
fn paths_of_a_command_line_start_at_the_folder_of_its_shell() {
    let live = of(load(PDSL), "");
    let given = |path: &str, text: &str| {
        let given = live.given(path, &UntypedValue::of_text(text), Path::new("/home/me"));
        given.expect("a parameter")
    };
    assert_eq!(given("map", "own.map"), json!("/home/me/own.map"));
    assert_eq!(given("map", "/own.map"), json!("/own.map"));
    assert_eq!(given("map", ""), json!(""));
    assert_eq!(given("log.file", "x"), json!("/home/me/x"));
    let all = given("search", r#"["a", "/b"]"#);
    assert_eq!(all, json!(["/home/me/a", "/b"]));
    assert_eq!(given("search[0]", "a"), json!("/home/me/a"));
    assert_eq!(given("name", "own.map"), json!("own.map"));
    assert_eq!(given("mode", "fine"), json!("fine"), "one of its choices");
}
