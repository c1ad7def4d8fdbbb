//! The table of the types of ROS 2 against their definitions.

use crate::folders::rcgen;
use rc_codegen::ros::definitions;
use rc_codegen::{FileLoader, export};
use rc_diagnostics::SourceMap;
use rc_ros_types::{STANDARD, TypeDescription, Types};
use rc_test_support::python;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const TABLE: &str = include_str!("../../../../middleware/ros2/types/src/standard.txt");
/// `PyPI` has no wheels of these packages.
const WITHOUT_WHEEL: [&str; 2] = ["tf2_msgs", "example_interfaces"];

/// The lines of the table, by the package of the type.
fn table() -> BTreeMap<&'static str, Vec<&'static str>> {
    let lines = TABLE.lines().filter(|line| !line.starts_with('#'));
    let mut table: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for line in lines.filter(|line| !line.is_empty()) {
        let (package, _) = line.split_once('/').expect("a package");
        table.entry(package).or_default().push(line);
    }
    table
}

/// The definitions that the wheels of ROS 2 Jazzy install: every message and every service of
/// every package of the table.
#[test]
fn the_table_is_that_of_ros() {
    let Some(python) = python::ros("the_table_is_that_of_ros") else {
        return;
    };
    let share = share(python);
    for (package, mut ours) in table() {
        if WITHOUT_WHEEL.contains(&package) {
            continue;
        }
        let mut theirs = Vec::new();
        for kind in ["msg", "srv"] {
            let folder = share.join(package).join(kind);
            let files = std::fs::read_dir(&folder).into_iter().flatten().flatten();
            theirs.extend(files.filter_map(|file| definition(package, kind, &file.path())));
        }
        theirs.sort_unstable();
        ours.sort_unstable();
        assert_eq!(ours, theirs);
    }
}

/// The folder of the packages in the environment of an interpreter.
fn share(python: &Path) -> PathBuf {
    let environment = python.ancestors().nth(2);
    environment.expect("the environment").join("share")
}

/// The descriptions and hashes that the wheels of ROS 2 Jazzy install, of every type that the table
/// has, and of the parts of services.
#[test]
fn descriptions_and_hashes_are_those_of_ros() {
    let Some(python) = python::ros("descriptions_and_hashes_are_those_of_ros") else {
        return;
    };
    let (share, none) = (share(python), Types::default());
    let mut compared = 0;
    for name in STANDARD.names() {
        let path = share.join(name).with_extension("json");
        let Ok(text) = std::fs::read_to_string(&path) else {
            let package = name.split('/').next().expect("a package");
            assert!(WITHOUT_WHEEL.contains(&package), "{name}");
            continue;
        };
        let described: Value = serde_json::from_str(&text).expect("JSON");
        for hash in described["type_hashes"].as_array().expect("hashes") {
            let name = hash["type_name"].as_str().expect("a name");
            let ours = TypeDescription::of(name, &none).expect("a type");
            assert_eq!(hash["hash_string"], ours.hash(), "{name}");
            compared += 1;
        }
        let ours = TypeDescription::of(name, &none).expect("a type");
        let theirs = &described["type_description_msg"]["type_description"];
        let fields = theirs["fields"].as_array().expect("fields");
        let names = fields.iter().map(|field| field["name"].as_str());
        assert!(names.eq(ours.main.fields.iter().map(|f| Some(&*f.name))));
    }
    assert!(compared > 300, "{compared}");
}

const TYPE_DESCRIPTION: &str = include_str!("../ros/type_description.txt");

/// The hashes of exported packages, as the generator of ROS 2 computes them from the exported
/// files.
#[test]
fn hashes_of_exported_packages_are_those_of_ros() {
    let test = "hashes_of_exported_packages_are_those_of_ros";
    let Some(ros) = python::ros(test) else {
        return;
    };
    let Some(python) = python::wheels("ros-type-description", TYPE_DESCRIPTION, test) else {
        return;
    };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (idsl, least) in [
        ("tests/compile/everything/Everything.idsl", 20),
        ("tests/export/Exported.idsl", 20),
        ("../../components/interop/Interop.idsl", 20),
    ] {
        let idsl = here.join(idsl);
        let folder = tempfile::tempdir().expect("a folder");
        let path = idsl.to_string_lossy();
        let args = ["export", &path, "--to", "ros2", "--out", "."];
        let (code, _, err) = rcgen(folder.path(), &args);
        assert_eq!(code, 0, "{err}");
        let mut command = Command::new(python);
        let command = command.arg(here.join("tests/ros/hashes.py"));
        let output = command.arg(share(ros)).arg(folder.path()).output();
        let output = output.expect("Python");
        assert!(output.status.success(), "{output:?}");
        let printed = String::from_utf8(output.stdout).expect("a text");
        let mut sources = SourceMap::new();
        let (library, found) =
            export::load(&idsl, &mut sources, &FileLoader::new(&[])).expect("a file");
        assert!(!found.has_errors());
        let hashes = printed
            .lines()
            .map(|line| line.split_once(' ').expect("a hash"));
        let wanted: Vec<String> = hashes.clone().map(|(name, _)| name.to_owned()).collect();
        assert!(wanted.len() >= least, "{printed}");
        let lines = definitions(&library, &wanted);
        let types = Types::read(lines.iter().map(String::as_str));
        for (name, hash) in hashes {
            let ours = TypeDescription::of(name, &types).expect("a type");
            assert_eq!(ours.hash(), hash, "{name}");
        }
    }
}

/// The line of the table for a file, if it defines a type.
fn definition(package: &str, kind: &str, file: &Path) -> Option<String> {
    let name = file.file_stem()?.to_str()?;
    // A wheel also has the two messages of each service.
    let is_part = ["_Request", "_Response"]
        .iter()
        .any(|part| name.ends_with(part));
    if is_part || file.extension()? != kind {
        return None;
    }
    let text = std::fs::read_to_string(file).expect("a definition");
    // The first line may separate request and response.
    let text = format!("\n{text}");
    let parts = text.split("\n---").map(|part| fields(package, part));
    let mut line = format!(
        "{package}/{kind}/{name}: {}",
        parts.collect::<Vec<_>>().join(" --- ")
    );
    while line.contains("  ") {
        line = line.replace("  ", " ");
    }
    Some(line.trim_end().to_owned())
}

/// `TYPE FIELD, TYPE FIELD …` of a text without constants and defaults.
fn fields(package: &str, text: &str) -> String {
    let lines = text.lines().filter_map(|line| {
        let line = line.split('#').next()?.trim();
        let mut words = line.split_whitespace();
        let (ty, name) = (words.next()?, words.next()?);
        let is_constant = name.contains('=') || words.next().is_some_and(|w| w.starts_with('='));
        let ty = match ty {
            own if own.starts_with("Header") => format!("std_msgs/{own}"),
            own if own.starts_with(char::is_uppercase) => format!("{package}/{own}"),
            other => other.to_owned(),
        };
        (!is_constant).then(|| format!("{ty} {name}"))
    });
    lines.collect::<Vec<_>>().join(", ")
}

/// `tf2_msgs`, as the Python package `rosbags` defines it for Jazzy.
#[test]
fn messages_of_transforms_are_those_of_ros() {
    let test = "messages_of_transforms_are_those_of_ros";
    let Some(python) = python::interpreter("rosbags==0.11.9", test) else {
        return;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros/standard.py");
    let output = Command::new(python).arg(script).arg("tf2_msgs").output();
    let output = output.expect("Python");
    assert!(output.status.success(), "{output:?}");
    let defined = String::from_utf8(output.stdout).expect("a text");
    let ours = &table()["tf2_msgs"];
    let ours = ours.iter().filter(|line| line.contains("/msg/"));
    assert!(ours.copied().eq(defined.lines()), "{defined}");
}
