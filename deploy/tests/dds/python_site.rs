//! A workspace of a test with one component in Python, which has an environment with `NumPy`.

use rc_test_site::site::{CommandOutput, Site};
use rc_test_support::python;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The requirements of the Python runtime, as in the tests of `rc-python`.
const NUMPY: &str = "numpy==2.3.4";

/// Makes the workspace with a component, which these files describe: names and texts. `None`
/// without Python 3.11 or `NumPy`: `test` is listed as skipped.
pub(crate) fn workspace(
    network: &str,
    component: &str,
    files: &[(&str, &str)],
    test: &str,
) -> Option<Site> {
    let python = python::packages("python-numpy", NUMPY, test)?;
    workspace_in(python, network, component, files)
}

/// As [`workspace`], with the environment of an interpreter.
pub(crate) fn workspace_in(
    python: &Path,
    network: &str,
    component: &str,
    files: &[(&str, &str)],
) -> Option<Site> {
    let environment = python.ancestors().nth(2)?;
    let site = Site::new(network);
    let framework = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let framework = framework.canonicalize().expect("the framework");
    let folder = site.path("networks").join(component);
    fs::create_dir_all(folder.join("src")).expect("a folder");
    let manifest = format!(
        "[workspace]\n\n[workspace.dependencies]\nrc-runtime = {{ path = \"{}\" }}\n",
        framework.join("runtime").display()
    );
    site.write("Cargo.toml", &manifest);
    for (name, text) in files {
        fs::write(folder.join(name), text).expect("to write");
    }
    let mut rcgen = site.command(&Site::executable("rcgen"));
    rcgen.arg(folder.join(format!("{component}.cdsl")));
    let ran = site.run(rcgen);
    assert_eq!(ran.code, 0, "{ran:?}");
    symlink(environment, folder.join(".venv")).expect("a link");
    Some(site)
}

/// Held by a test whose components have the names of another test's: their programs are the same files.
pub(crate) fn names_of_others() -> MutexGuard<'static, ()> {
    static NAMES: Mutex<()> = Mutex::new(());
    NAMES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adds another component to a workspace, with the environment of the first one.
pub(crate) fn second_component(site: &Site, component: &str, files: &[(&str, &str)]) {
    let first = fs::read_dir(site.path("networks")).expect("the components");
    let mut first = first.flatten().map(|entry| entry.path().join(".venv"));
    let environment = first.find_map(|link| fs::read_link(link).ok());
    let folder = site.path("networks").join(component);
    fs::create_dir_all(folder.join("src")).expect("a folder");
    for (name, text) in files {
        fs::write(folder.join(name), text).expect("to write");
    }
    let mut rcgen = site.command(&Site::executable("rcgen"));
    rcgen.arg(folder.join(format!("{component}.cdsl")));
    let ran = site.run(rcgen);
    assert_eq!(ran.code, 0, "{ran:?}");
    symlink(environment.expect("an environment"), folder.join(".venv")).expect("a link");
}

/// `rcdeploy up` without an active environment and without a display, with these variables.
pub(crate) fn up(site: &Site, variables: &[(&str, &Path)]) -> CommandOutput {
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl()).env("CARGO_NET_OFFLINE", "true");
    for name in ["VIRTUAL_ENV", "PYTHONPATH", "DISPLAY"] {
        up.env_remove(name);
    }
    up.envs(variables.iter().copied());
    site.run(up)
}
