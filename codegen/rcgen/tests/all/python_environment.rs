//! Virtual environments of components in Python: made on request, and run only where they must be.

use crate::folders::rcgen;
use rc_test_support::python::skipped;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

const CDSL: &str = "import \"Laser.idsl\"; Component eyes { Communications { requires Laser; }; language python; };";

/// Writes a wheel without a line of code.
const WHEEL: &str = "
import sys, zipfile
info = 'tiny-1.2.dist-info'
files = {
    'tiny.py': 'SIZE = 7\\n',
    f'{info}/METADATA': 'Metadata-Version: 2.1\\nName: tiny\\nVersion: 1.2\\n',
    f'{info}/WHEEL': 'Wheel-Version: 1.0\\nGenerator: t\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n',
}
with zipfile.ZipFile(sys.argv[1], 'w') as wheel:
    for name, text in files.items():
        wheel.writestr(name, text)
    lines = [f'{name},,' for name in files] + [f'{info}/RECORD,,']
    wheel.writestr(f'{info}/RECORD', '\\n'.join(lines) + '\\n')
";

fn component() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("eyes.cdsl"), CDSL).expect("a file");
    let (code, _, err) = rcgen(folder.path(), &["eyes.cdsl"]);
    assert_eq!((code, err.as_str()), (0, ""));
    folder
}

/// Sets the packages of the component, and the versions of Python that it runs on.
fn needs(folder: &Path, python: &str, package: &str) {
    let text = format!(
        "[project]\nname = \"eyes\"\nrequires-python = \"{python}\"\ndependencies = [{package}]\n"
    );
    fs::write(folder.join("pyproject.toml"), text).expect("a file");
}

fn script(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, text).expect("a file");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("a mode");
}

/// Where `uv` is not; `venv` and `pip` come with Python.
fn path_without_uv() -> String {
    let path = std::env::var("PATH").expect("a path");
    let mut folders = path
        .split(':')
        .filter(|folder| !Path::new(folder).join("uv").exists());
    let first = folders.next().expect("a folder").to_owned();
    folders.fold(first, |all, folder| all + ":" + folder)
}

fn venv(folder: &Path, path: &str, more: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcgen"));
    command.args(["venv", "eyes.cdsl"]).args(more);
    command.current_dir(folder).env("PATH", path);
    command.env_remove("VIRTUAL_ENV").env("PIP_NO_INDEX", "1");
    let output = command.output().expect("rcgen starts");
    let said = [output.stdout, output.stderr].concat();
    (
        output.status.code(),
        String::from_utf8(said).expect("UTF-8"),
    )
}

#[test]
fn an_environment_is_made_on_request() {
    let check = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))";
    let has_venv = Command::new("python3").args(["-c", check]).status();
    if !has_venv.is_ok_and(|status| status.success()) {
        return skipped(
            "an_environment_is_made_on_request",
            "there is no Python 3.11 with `venv` in the path",
        );
    }
    let component = component();
    let folder = component.path();
    assert!(!folder.join(".venv").exists());
    let wheel = folder.join("tiny-1.2-py3-none-any.whl");
    let made = Command::new("python3")
        .args(["-c", WHEEL])
        .arg(&wheel)
        .status();
    assert!(made.expect("python3").success());
    let path = path_without_uv();
    let package = format!("\"tiny @ file://{}\"", wheel.display());
    needs(folder, ">=3.11", &package);
    // Twice: the second one finds everything.
    for _ in 0..2 {
        let (code, said) = venv(folder, &path, &[]);
        assert_eq!(code, Some(0), "{said}");
        assert!(said.contains("/.venv is ready\n"), "{said}");
        assert!(
            said.contains("note: there is no wheel of the framework"),
            "{said}"
        );
    }
    let own = folder.join(".venv/bin/python");
    let print = Command::new(&own)
        .args(["-I", "-c", "import tiny; print(tiny.SIZE)"])
        .output();
    assert_eq!(print.expect("python").stdout, b"7\n");

    // The wheel of the framework, here another one, is installed anew each time.
    needs(folder, ">=3.11", "");
    fs::remove_dir_all(folder.join(".venv")).expect("to remove");
    for _ in 0..2 {
        let (code, said) = venv(folder, &path, &["--wheel", "tiny-1.2-py3-none-any.whl"]);
        assert_eq!(code, Some(0), "{said}");
        assert!(!said.contains("note: "), "{said}");
        assert!(said.contains("Successfully installed tiny-1.2"), "{said}");
    }
    let print = Command::new(&own)
        .args(["-I", "-c", "import tiny; print(tiny.SIZE)"])
        .output();
    assert_eq!(print.expect("python").stdout, b"7\n");

    // A package that cannot be installed is an error, and so is a version that the component does
    // not accept.
    needs(folder, ">=3.11", "\"no-such-package-of-anybody==1\"");
    let (code, said) = venv(folder, &path, &[]);
    assert_eq!(code, Some(3), "{said}");
    assert!(
        said.contains("no-such-package-of-anybody==1` failed"),
        "{said}"
    );
    needs(folder, ">=3.99", "");
    let (code, said) = venv(folder, &path, &[]);
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("has `requires-python = \">=3.99\"`"),
        "{said}"
    );
    needs(folder, ">=3.11", "\"--index-url=http://elsewhere\"");
    let (code, said) = venv(folder, &path, &[]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("is not a list of requirements"), "{said}");

    // An interpreter that is too old, or none.
    fs::remove_dir_all(folder.join(".venv")).expect("to remove");
    needs(folder, ">=3.11", "");
    let old = folder.join("old/python3");
    script(&old, "#!/bin/sh\necho 3.9.2\n");
    let (code, said) = venv(folder, &path, &["--python", &old.display().to_string()]);
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("is Python 3.9.2; this component needs Python 3.11 or newer"),
        "{said}"
    );
    let (code, said) = venv(folder, &path, &["--python", "nowhere/python"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("`nowhere/python` does not exist"), "{said}");
    assert!(!folder.join(".venv").exists());

    // One that fails leaves nothing; one that was killed is made again; another folder is kept.
    let own = folder.join(".venv");
    let lame = folder.join("lame/python3");
    let fails = "mkdir -p .venv/bin; touch .venv/bin/python; echo 'install venv'; exit 1";
    script(
        &lame,
        &format!("#!/bin/sh\ncase $1 in -m) {fails};; *) echo 3.13.1;; esac\n"),
    );
    let (code, said) = venv(folder, &path, &["--python", "lame/python3"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("failed: install venv\n"), "{said}");
    assert!(!own.exists());
    script(&own.join("bin/python"), "#!/bin/sh\necho 3.13.1\n");
    fs::write(own.join(".begun-by-rcgen"), "").expect("a file");
    let (code, said) = venv(folder, &path, &[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(own.join("pyvenv.cfg").exists() && !own.join(".begun-by-rcgen").exists());
    fs::remove_dir_all(&own).expect("to remove");
    fs::create_dir(&own).expect("a folder");
    fs::write(own.join("mine"), "").expect("a file");
    let (code, said) = venv(folder, &path, &[]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("is not a virtual environment"), "{said}");
    assert!(own.join("mine").exists());
    fs::remove_dir_all(&own).expect("to remove");

    // The `.cdsl` asks for more, and another interpreter of the path fits.
    let clause = |version: &str| {
        let clause = format!("language python; python \"{version}\" venv;");
        let text = CDSL.replace("language python;", &clause);
        fs::write(folder.join("eyes.cdsl"), text).expect("a file");
    };
    clause("3.999");
    let (code, said) = venv(folder, &path, &[]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("needs Python 3.999 or newer"), "{said}");
    clause("3.11");
    let find = Command::new("python3")
        .args(["-c", "import sys; print(sys.executable)"])
        .output()
        .expect("it starts");
    let real = String::from_utf8(find.stdout).expect("a path");
    let newer = folder.join("old/python3.12");
    script(&newer, &format!("#!/bin/sh\nexec {} \"$@\"\n", real.trim()));
    let two = format!("{}:{path}", folder.join("old").display());
    let (code, said) = venv(folder, &two, &[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(folder.join(".venv/bin/python").exists());

    // With uv, it installs.
    fs::remove_dir_all(folder.join(".venv")).expect("to remove");
    let uv = folder.join("uv/uv");
    script(&uv, "#!/bin/sh\necho \"uv: $*\"\n");
    needs(folder, ">=3.11", "\"tiny>=1\"");
    let with_uv = format!("{}:{path}", folder.join("uv").display());
    let (code, said) = venv(folder, &with_uv, &[]);
    assert_eq!(code, Some(0), "{said}");
    let line = "uv: pip install --python ./.venv/bin/python -- tiny>=1\n";
    assert!(said.contains(line), "{said}");
}

#[test]
fn a_check_runs_no_program_of_the_component() {
    let component = component();
    let own = component.path().join(".venv/bin/python");
    let trace = component.path().join("it-ran");
    script(&own, &format!("#!/bin/sh\ntouch '{}'\n", trace.display()));
    for command in ["check", "stubs"] {
        let mut rcgen = Command::new(env!("CARGO_BIN_EXE_rcgen"));
        rcgen.args([command, "eyes.cdsl"]);
        rcgen
            .current_dir(component.path())
            .env_remove("VIRTUAL_ENV");
        assert!(rcgen.output().is_ok());
        assert!(!trace.exists(), "{command} ran it");
    }
}

/// The component may be for another machine, so it is a warning.
#[test]
fn a_check_warns_of_an_interpreter_that_cannot_run_the_component() {
    let component = component();
    let folder = component.path();
    let check_with = |python_path: &Path| {
        let mut rcgen = Command::new(env!("CARGO_BIN_EXE_rcgen"));
        rcgen.args(["check", "eyes.cdsl", "--format", "short"]);
        rcgen.current_dir(folder).env_remove("VIRTUAL_ENV");
        rcgen.env("PYTHONPATH", python_path);
        let output = rcgen.output().expect("rcgen starts");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(0), "{said}");
        said
    };
    let check = || check_with(Path::new(""));
    let said = check();
    if said.contains("no-python") {
        return skipped(
            "a_check_warns_of_an_interpreter_that_cannot_run_the_component",
            "there is no Python 3.11 in the path",
        );
    }
    assert_eq!(said, "");
    let clause = CDSL.replace("language python;", "language python; python \"3.999\";");
    fs::write(folder.join("eyes.cdsl"), clause).expect("a file");
    let said = check();
    let needed = "; this component needs Python 3.999 or newer";
    assert!(
        said.contains("warning[old-python]: `python3` is Python 3.") && said.contains(needed),
        "{said}"
    );
    let own = folder.join(".venv");
    script(&own.join("bin/python"), "#!/bin/sh\nexit 1\n");
    fs::create_dir_all(own.join("lib/python3.999/site-packages")).expect("a folder");
    fs::write(own.join("pyvenv.cfg"), "version = 3.999.0\n").expect("a file");
    // A folder of this name where `rcgen` runs is not a package of the component.
    fs::create_dir(folder.join("numpy")).expect("a folder");
    let said = check();
    assert!(
        said.contains("warning[no-numpy]: `./.venv` has no NumPy"),
        "{said}"
    );
    let said = check_with(folder);
    assert!(!said.contains("no-numpy"), "{said}");
}
