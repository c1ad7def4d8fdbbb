//! The table of the types of ROS 2 against their definitions.

use crate::python;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

const TABLE: &str = include_str!("../../src/ros/standard.txt");
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
    let share = python
        .ancestors()
        .nth(2)
        .expect("the environment")
        .join("share");
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
