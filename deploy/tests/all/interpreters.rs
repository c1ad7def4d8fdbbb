//! Interpreters of components in Python that are missing, too old or without `NumPy`: found before
//! anything starts.

use rc_test_site::site::Site;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// A network with one component in Python, and a path with no program but its own.
struct Eyes {
    site: Site,
    ddsl: PathBuf,
}

impl Eyes {
    fn new(name: &str) -> Self {
        let site = Site::new(name);
        let folder = site.path("networks");
        let network = format!(
            "Deployment {}\n{{\n    Component eyes {{ cdsl \"eyes/eyes.cdsl\"; }};\n}};\n",
            site.network
        );
        let ddsl = site.write("eyes.ddsl", &network);
        fs::write(folder.join("Cargo.toml"), "[workspace]\n").expect("a manifest");
        for made in ["eyes", "bin"] {
            fs::create_dir(folder.join(made)).expect("a folder");
        }
        let eyes = Self { site, ddsl };
        eyes.declare("language python;");
        eyes
    }

    /// Writes the component and generates it.
    fn declare(&self, clauses: &str) {
        let cdsl = format!("Component Eyes {{ Communications {{ }}; {clauses} }};");
        let path = self.site.write("eyes/eyes.cdsl", &cdsl);
        let mut rcgen = self.site.command(&Site::executable("rcgen"));
        let ran = self.site.run({
            rcgen.arg(path);
            rcgen
        });
        assert_eq!(ran.code, 0, "{ran:?}");
    }

    /// A program that prints, and leaves a trace.
    fn program(&self, name: &str, prints: &str) {
        let path = self.site.path("networks").join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        let trace = self.trace(name);
        let text = format!("#!/bin/sh\n: > '{}'\necho {prints}\n", trace.display());
        fs::write(&path, text).expect("a program");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a mode");
    }

    fn trace(&self, program: &str) -> PathBuf {
        self.site.path(&program.replace('/', "-"))
    }

    /// Findings of `rcdeploy` about interpreters, in one line each.
    fn found(&self, args: &[&str], environment: Option<&Path>) -> Vec<String> {
        let active = environment.map(|environment| ("VIRTUAL_ENV", environment));
        self.found_with(args, active.as_slice())
    }

    /// The findings with these variables of Python.
    fn found_with(&self, args: &[&str], variables: &[(&str, &Path)]) -> Vec<String> {
        let mut rcdeploy = self.site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
        rcdeploy.args(args).arg(&self.ddsl);
        rcdeploy.env("PATH", self.site.path("networks/bin"));
        for name in ["PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"] {
            rcdeploy.env_remove(name);
        }
        rcdeploy.envs(variables.iter().copied());
        let ran = self.site.run(rcdeploy);
        assert_eq!(ran.code, 1, "nothing is built: {ran:?}");
        let folder = format!("{}/", self.site.path("networks").display());
        let lines = ran.stderr.replace(&folder, "");
        let codes = ["no-python", "old-python", "no-numpy"];
        let is_ours = |line: &&str| codes.iter().any(|code| line.contains(code));
        lines.lines().filter(is_ours).map(str::to_owned).collect()
    }

    fn check(&self) -> Vec<String> {
        self.found(&["check", "--format", "short"], None)
    }
}

#[test]
fn an_interpreter_that_cannot_run_a_component_is_found_by_a_check() {
    let eyes = Eyes::new("interpreters");
    let place = "eyes.ddsl:3:27: error";
    let install = "install it, or activate a virtual environment that has it";
    let missing = format!(
        "{place}[no-python]: `python3` does not exist; this component needs Python 3.11 or newer ({install})"
    );
    assert_eq!(eyes.check(), [missing]);
    eyes.program("bin/python3", "3.9.2");
    let help = "with a newer one in the path, `rcgen venv eyes/eyes.cdsl` makes an environment";
    let old = |needed: &str| {
        format!(
            "{place}[old-python]: `python3` is Python 3.9.2; this component needs Python {needed} or newer ({help})"
        )
    };
    assert_eq!(eyes.check(), [old("3.11")]);
    eyes.declare("language python; python \"3.13\" venv;");
    assert_eq!(eyes.check(), [old("3.13")]);
    assert!(eyes.trace("bin/python3").exists());

    // The environment of the component is read, and nothing in it runs.
    eyes.program(".venv/bin/python", "3.13.0");
    fs::create_dir_all(eyes.site.path("networks/eyes")).expect("a folder");
    let own = eyes.site.path("networks/eyes/.venv");
    fs::rename(eyes.site.path("networks/.venv"), &own).expect("a folder");
    assert_eq!(eyes.check(), [""; 0], "its files say nothing");
    let settings = |text: &str| fs::write(own.join("pyvenv.cfg"), text).expect("a file");
    settings("home = /usr/bin\nversion = 3.12.1\n");
    let old = "`eyes/.venv/bin/python` is Python 3.12; this component needs Python 3.13 or newer (delete this environment; `rcgen venv eyes/eyes.cdsl` makes a new one)";
    assert_eq!(eyes.check(), [format!("{place}[old-python]: {old}")]);
    let packages = own.join("lib/python3.13/site-packages");
    fs::create_dir_all(&packages).expect("a folder");
    fs::write(packages.join("distutils-precedence.pth"), "").expect("a file");
    settings("uv = 0.9\nversion_info = 3.13.0.final.0\ninclude-system-site-packages = false\n");
    let without = format!(
        "{place}[no-numpy]: `eyes/.venv` has no NumPy (`rcgen venv eyes/eyes.cdsl` installs it)"
    );
    assert_eq!(eyes.check(), [without.as_str()]);
    assert!(!eyes.trace(".venv/bin/python").exists(), "it ran");

    // Before a build as well. The active environment comes behind that of the component.
    let built = eyes.found(&["up", "--build"], None).join("\n");
    assert!(built.contains("error[no-numpy]: `eyes/.venv`"), "{built}");
    let active = eyes.site.path("networks/active");
    eyes.program("active/bin/python", "3.13.0");
    fs::write(active.join("pyvenv.cfg"), "version = 3.10.0\n").expect("a file");
    let found = || eyes.found(&["check", "--format", "short"], Some(&active));
    assert_eq!(found(), [without.as_str()]);
    let away = own.with_file_name("away");
    fs::rename(&own, &away).expect("to rename");
    let help = "deactivate this environment, or activate another one";
    let old = format!(
        "`active/bin/python` is Python 3.10; this component needs Python 3.13 or newer ({help})"
    );
    assert_eq!(found(), [format!("{place}[old-python]: {old}")]);
    fs::rename(&away, &own).expect("to rename");

    // What may have the package is not refused.
    let foreign = packages.join("foreign.pth");
    fs::write(&foreign, "/elsewhere\n").expect("a file");
    assert_eq!(eyes.check(), [""; 0]);
    fs::remove_file(foreign).expect("to remove");
    assert_eq!(eyes.check(), [without.as_str()]);
    fs::create_dir(packages.join("numpy")).expect("a folder");
    assert_eq!(eyes.check(), [""; 0]);

    // No interpreter starts with the home of another one.
    let home = eyes.site.path("networks/home");
    let found = eyes.found_with(&["check", "--format", "short"], &[("PYTHONHOME", &home)]);
    let wrong = "PYTHONHOME is home, with which `eyes/.venv/bin/python` does not start: it has no library of Python 3.13 (unset it: `unset PYTHONHOME`)";
    assert_eq!(found, [format!("{place}[no-python]: {wrong}")]);
    fs::create_dir_all(home.join("lib/python3.13")).expect("a folder");
    fs::write(home.join("lib/python3.13/os.py"), "").expect("a file");
    let found = eyes.found_with(&["check", "--format", "short"], &[("PYTHONHOME", &home)]);
    assert_eq!(found, [""; 0]);
}
