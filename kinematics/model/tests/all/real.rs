//! Robots of real makers, read from packages of `PyPI`.

use crate::mujoco;
use crate::pinocchio::{Case, compare, driven};
use rc_diagnostics::{Format, SourceMap, render};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages. Pinocchio of another version reads the same files.
const PACKAGES: &str = "example-robot-data==6.0.0\npin==4.1.0\n";
const MORE: &str = "rtb-data==2.0.0\npybullet==3.2.7\npin==4.1.0\n";

/// What is refused here, and not by Pinocchio: joints that follow nothing, which it does not look for without them; joints
/// without a position; text before the declaration of XML, and a byte 0 behind the last element.
const REFUSED: [&str; 4] = [
    "error[unknown-joint]: there is no joint",
    "error[bad-value]: `lower` is greater than `upper`",
    "error[malformed-xml]: malformed XML: unexpected XML declaration",
    "error[malformed-xml]: malformed XML: unknown token",
];

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
    let data = "cmeel.prefix/share/example-robot-data/robots";
    robots_move_as_those_of_pinocchio(python, &[data], 60);
}

/// Those of the Robotics Toolbox for Python, and of Bullet.
#[test]
#[ignore = "`cargo xtask soak kinematics` runs it: the packages have 150 MB"]
fn robots_of_toolboxes_move_as_those_of_pinocchio() {
    let test = "robots_of_toolboxes_move_as_those_of_pinocchio";
    let python = rc_test_support::python::packages("more-robots", MORE, test);
    let Some(python) = python else { return };
    robots_move_as_those_of_pinocchio(python, &["rtbdata", "pybullet_data"], 80);
}

/// Robots of the package beside `MuJoCo`. It knows no joints of several coordinates, and refuses masses that no body has and moving bodies
/// without one: at least 30 remain.
#[test]
#[ignore = "`cargo xtask soak kinematics` runs it: the package has 400 MB of meshes"]
fn real_robots_move_as_those_of_mujoco() {
    let test = "real_robots_move_as_those_of_mujoco";
    let packages = rc_test_support::python::packages;
    let (Some(files), Some(python)) = (
        packages("example-robots", PACKAGES, test),
        mujoco::python(test),
    ) else {
        return;
    };
    let folder = "cmeel.prefix/share/example-robot-data/robots";
    let (files, count) = files_of(files, &[folder], 2);
    let mut cases = Vec::new();
    for path in &files {
        let mut sources = SourceMap::new();
        let source = sources.add(path, std::fs::read_to_string(path).expect("a text"));
        let (robot, found) = rc_robot::read(&sources, source);
        if !found.has_errors() && driven(&robot).1.is_empty() && !robot.coordinates.is_empty() {
            let source = ("file", path.display().to_string());
            cases.push(Case { robot, source });
        }
    }
    let least = if count.is_some() { 12 } else { 30 };
    let mut random = fastrand::Rng::with_seed(6);
    let refused = mujoco::compare(python, &cases, count.unwrap_or(2), &mut random);
    for (case, reason) in cases.iter().zip(&refused) {
        println!("{}: {reason:?}", case.source.1);
    }
    let compared = refused.iter().filter(|reason| reason.is_none()).count();
    assert!(compared >= least, "{compared} of {}", cases.len());
}

/// The files of robots below folders of packages, and how many states each has. With `KINEMATICS_STATES`, they are one of so many.
fn files_of(python: &Path, folders: &[&str], share: usize) -> (Vec<PathBuf>, Option<usize>) {
    let program = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let output = Command::new(python).args(["-c", program]).output();
    let output = String::from_utf8(output.expect("python").stdout).expect("a text");
    let mut files = Vec::new();
    for folder in folders {
        urdfs(&Path::new(output.trim()).join(folder), &mut files);
    }
    // A thousand things of one link.
    files.retain(|path| !path.iter().any(|part| part == "random_urdfs"));
    let count = std::env::var("KINEMATICS_STATES").map(|text| text.parse().expect("a number"));
    if count.is_ok() {
        files = files.into_iter().step_by(share).collect();
    }
    (files, count.ok())
}

/// Compares the robots below folders of packages, which are at least `least`.
fn robots_move_as_those_of_pinocchio(python: &Path, folders: &[&str], least: usize) {
    let (files, count) = files_of(python, folders, 5);
    let least = if count.is_some() { least / 5 } else { least };
    assert!(files.len() > least, "{}", files.len());
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
            let is_refused =
                own.is_some_and(|found| REFUSED.iter().any(|text| found.contains(text)));
            (own.is_some() != (theirs.is_some() || is_refused))
                .then(|| format!("{}: {own:?}, {theirs:?}", path.display()))
        })
        .collect();
    assert!(differ.is_empty(), "{differ:#?}");
}
