//! Robots of real makers, read from the package `example-robot-data` of `PyPI`.

use crate::pinocchio::{Case, compare};
use rc_diagnostics::{Format, SourceMap, render};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages. Pinocchio of another version reads the same files.
const PACKAGES: &str = "example-robot-data==6.0.0\npin==4.1.0\n";

/// The files below a folder that end in `.urdf`, sorted.
fn urdfs(folder: &Path, out: &mut Vec<PathBuf>) {
    let all = std::fs::read_dir(folder).expect("a folder");
    let mut all: Vec<PathBuf> = all.map(|entry| entry.expect("an entry").path()).collect();
    all.sort();
    for path in all {
        if path.is_dir() {
            urdfs(&path, out);
        } else if path.extension().is_some_and(|ending| ending == "urdf") {
            out.push(path);
        }
    }
}

/// The robots of the package: each one that is read moves as Pinocchio says, and each one that is refused
/// is refused by Pinocchio.
///
/// With `KINEMATICS_STATES`, there are so many states of each fifth robot.
#[test]
#[ignore = "`cargo xtask soak kinematics` runs it: the package has 400 MB of meshes"]
fn real_robots_move_as_those_of_pinocchio() {
    let test = "real_robots_move_as_those_of_pinocchio";
    let python = rc_test_support::python::packages("example-robots", PACKAGES, test);
    let Some(python) = python else { return };
    let program = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let output = Command::new(python).args(["-c", program]).output();
    let output = String::from_utf8(output.expect("python").stdout).expect("a text");
    let data = "cmeel.prefix/share/example-robot-data/robots";
    let mut files = Vec::new();
    urdfs(&Path::new(output.trim()).join(data), &mut files);
    assert!(files.len() > 60, "{}", files.len());
    let count = std::env::var("KINEMATICS_STATES").map(|text| text.parse().expect("a number"));
    if count.is_ok() {
        files = files.into_iter().step_by(5).collect();
    }
    let (mut cases, mut wrong) = (Vec::new(), Vec::new());
    for path in &files {
        let mut sources = SourceMap::new();
        let source = sources.add(path, std::fs::read_to_string(path).expect("a text"));
        let (mut robot, found) = rc_robot::read(&sources, source);
        if found.has_errors() {
            robot = rc_robot::Robot::default();
            wrong.push((path, render(&sources, &found, Format::Short)));
        }
        cases.push(Case {
            robot,
            source: ("file", path.display().to_string()),
        });
    }
    let count = count.unwrap_or(2);
    let mut random = fastrand::Rng::with_seed(5);
    let refused = compare(python, &cases, (count, 4), &mut random);
    let differ: Vec<String> = files
        .iter()
        .zip(&refused)
        .filter_map(|(path, theirs)| {
            let own = wrong.iter().find(|(file, _)| *file == path);
            let own = own.map(|(_, found)| found);
            // Without joints that follow, Pinocchio does not look for their leaders.
            let is_leaderless =
                own.is_some_and(|found| found.contains("error[unknown-joint]: there is no joint"));
            (own.is_some() != (theirs.is_some() || is_leaderless))
                .then(|| format!("{}: {own:?}, {theirs:?}", path.display()))
        })
        .collect();
    assert!(differ.is_empty(), "{differ:#?}");
}
