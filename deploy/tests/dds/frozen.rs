//! Components that an earlier `rcgen` generated run beside components of today: their generated code
//! (`deploy/tests/frozen`) is compiled with the framework as it is now.

use crate::cpp_worker::tool;
use rc_test_site::site::{CommandOutput, Site};
use rc_test_support::{cmake, python};
use std::fs;
use std::path::Path;

const FROZEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/frozen");
/// The package that the runtime of Python needs, as in the tests of `rc-python`.
const NUMPY: &str = "numpy==2.3.4";

/// The description of all of them, of which each program has the hash.
const DESCRIPTION: &str = r#"// Generated once and kept: a later framework has to run it.
import "BatteryStatus.idsl";
import "DifferentialRobot.idsl";
import "FullPoseEstimationPub.idsl";

Component NAME
{
    Communications
    {
        implements BatteryStatus;
        requires DifferentialRobot;
        subscribesTo FullPoseEstimationPub;
        publishes FullPoseEstimationPub as seen;
    };
    language LANGUAGE;
    parameters "NAME.pdsl";
    period 100ms;
};
"#;

const PARAMETERS: &str = r#"ComponentParams NAME
{
    /// How fast it drives.
    speed float 100.0 0:500 T unit "mm/s";
};
"#;

const NETWORK: &str = r#"Deployment frozen
{
    middleware iceoryx2;
    Component simulator { cdsl "COMPONENTS/simulator/simulator.cdsl"; };
    Component steady { cdsl "../NAME/NAME.cdsl"; PROGRAM after simulator; };
    bind steady.DifferentialRobot -> simulator.DifferentialRobot;
    bind steady.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;
};
"#;

/// A workspace around a component that is not in Rust.
const WORKSPACE: &str = r#"[workspace]
resolver = "3"
exclude = ["NAME"]

[workspace.dependencies]
rc-runtime = { path = "FRAMEWORK/runtime" }
"#;

/// A place with a component and its network. `program` is the clause that names its program.
fn place(name: &str, language: &str, program: &str) -> Site {
    let site = Site::new(name);
    let components = Site::components();
    let framework = components.parent().expect("the framework");
    for (path, text) in [
        (format!("{name}/{name}.cdsl"), DESCRIPTION),
        (format!("{name}/{name}.pdsl"), PARAMETERS),
        ("networks/patrol.ddsl".to_owned(), NETWORK),
        ("Cargo.toml".to_owned(), WORKSPACE),
    ] {
        let text = text
            .replace("Deployment frozen", &format!("Deployment {}", site.network))
            .replace("COMPONENTS", &components.to_string_lossy())
            .replace("FRAMEWORK", &framework.to_string_lossy())
            .replace("PROGRAM", program)
            .replace("LANGUAGE", language)
            .replace("NAME", name);
        let path = site.path(&path);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }
    site
}

/// Copies the frozen files of a component beside its description.
fn thaw(site: &Site, name: &str) {
    fn copy(from: &Path, to: &Path) {
        fs::create_dir_all(to).expect("a folder");
        for entry in fs::read_dir(from).expect("a folder").flatten() {
            let (from, to) = (entry.path(), to.join(entry.file_name()));
            if from.is_dir() {
                copy(&from, &to);
            } else {
                fs::copy(from, to).expect("a copy");
            }
        }
    }
    copy(&Path::new(FROZEN).join(name), &site.path(name));
}

/// Starts the network by `up ARGS…`, and uses each slot and the parameter of the component.
fn it_does_what_it_did(site: &Site, args: &[&str], run: &dyn Fn(&[&str]) -> CommandOutput) {
    let file = site.ddsl().display().to_string();
    let rcdeploy = |args: &[&str]| {
        let ran = run(args);
        assert_eq!(ran.code, 0, "{args:?} {ran:?}");
        ran.stdout
    };
    let start = ["up", "--detach", "--profile", "dev"];
    rcdeploy(&[&start, args, &[&file]].concat());
    // Its description has the hash that its program has.
    rcdeploy(&["check", "--profile", "dev", &file]);
    // Commands and queries that it sends, and samples that it hears.
    site.await_in_log("steady", "speed=100 x=");
    site.await_in_log("steady", "poses=3");
    // A query that it serves, its parameter, and a topic of its own.
    let query = "steady.BatteryStatus.getBatteryState";
    let battery = rcdeploy(&["call", &site.network, query]);
    assert!(battery.contains("77"), "{battery}");
    rcdeploy(&["params", "set", &site.network, "steady", "speed=50"]);
    site.await_in_log("steady", "parameter=50");
    let pose = rcdeploy(&["echo", &site.network, "steady.seen.newFullPose", "--once"]);
    assert!(pose.contains("rz"), "{pose}");
    rcdeploy(&["down", &site.network]);
    site.assert_nothing_left();
}

/// Builds the component from its frozen files, and nothing of it anew.
const BUILD: [&str; 2] = ["--build", "--no-generate"];

#[test]
fn a_component_of_an_earlier_version_runs_with_this_runtime() {
    let program = Site::executable("steady");
    let clause = format!("executable \"{}\";", program.display());
    let site = place("steady", "rust", &clause);
    let run = |args: &[&str]| site.rcdeploy(args, false);
    it_does_what_it_did(&site, &[], &run);
}

#[test]
fn a_component_in_python_of_an_earlier_version_runs_with_this_runtime() {
    let test = "a_component_in_python_of_an_earlier_version_runs_with_this_runtime";
    let Some(python) = python::packages("python-numpy", NUMPY, test) else {
        return;
    };
    let environment = python.ancestors().nth(2).expect("a virtual environment");
    crate::built();
    let site = place("steady_python", "python", "");
    thaw(&site, "steady_python");
    let run = |args: &[&str]| {
        let mut command = tool(&site, Path::new(""));
        command.args(args).env("VIRTUAL_ENV", environment);
        site.run(command)
    };
    it_does_what_it_did(&site, &BUILD, &run);
}

#[test]
fn a_component_in_cpp_of_an_earlier_version_runs_with_this_runtime() {
    let test = "a_component_in_cpp_of_an_earlier_version_runs_with_this_runtime";
    let Some(cmake) = cmake::folder(test) else {
        return;
    };
    crate::built();
    let site = place("steady_cpp", "cpp", "");
    thaw(&site, "steady_cpp");
    let run = |args: &[&str]| {
        let mut command = tool(&site, &cmake);
        command.args(args);
        site.run(command)
    };
    it_does_what_it_did(&site, &BUILD, &run);
}
