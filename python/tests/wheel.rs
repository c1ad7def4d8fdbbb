//! The wheel: `cargo xtask dist` writes it, an empty environment gets it, and a client reaches a
//! component.

use rc_test_support::python;
use std::path::{Path, PathBuf};
use std::process::Command;

const TEST: &str = "a_wheel_is_all_that_a_client_needs";
const NUMPY: &str = "numpy==2.3.4";

fn run(command: &mut Command) -> String {
    let output = command.output().expect("a program that starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}\n{said}");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

/// Where an interpreter has its packages.
fn packages(python: &Path) -> PathBuf {
    let print = "import sysconfig; print(sysconfig.get_path('purelib'))";
    run(Command::new(python).args(["-c", print])).into()
}

/// The only file of a folder.
fn only_file(folder: &Path) -> PathBuf {
    let mut files = std::fs::read_dir(folder).expect("a folder");
    let file = files.next().expect("a file").expect("a file").path();
    assert!(files.next().is_none(), "{} has more", folder.display());
    file
}

#[test]
fn a_wheel_is_all_that_a_client_needs() {
    let Some(numpy) = python::packages("python-numpy", NUMPY, TEST) else {
        return;
    };
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a folder");
    let wheels = folder.path().join("wheels");
    let target = std::env::current_exe().expect("this program");
    let target = target.ancestors().nth(2).expect("the target folder");
    run(Command::new(target.join("dist"))
        .args(["--profile", "dev", "--built", "--only", "wheel", "--out"])
        .arg(&wheels));
    std::fs::remove_file(wheels.join("SHA256SUMS")).expect("the checksums");
    let wheel = only_file(&wheels);
    let name = wheel.file_name().expect("a name").to_string_lossy();
    assert!(
        name.starts_with("robocomp-") && name.contains("-cp311-abi3-"),
        "{name}"
    );

    // An environment without anything but NumPy, which it borrows.
    let environment = folder.path().join("environment");
    run(Command::new(numpy)
        .args(["-m", "venv", "--without-pip"])
        .arg(&environment));
    let own_python = environment.join("bin/python");
    let place = packages(&own_python);
    let borrowed = packages(numpy).display().to_string();
    std::fs::write(place.join("numpy.pth"), borrowed).expect("a file");
    let pip = match python::pip() {
        Ok(pip) => pip,
        Err(reason) => return python::skipped(TEST, &reason),
    };
    run(Command::new(pip)
        .args(["-m", "pip", "--python"])
        .arg(&own_python)
        .args([
            "install",
            "--quiet",
            "--no-index",
            "--disable-pip-version-check",
        ])
        .arg(&wheel));
    let print = "import robocomp; print(robocomp.__file__)";
    let package = run(Command::new(&own_python)
        .args(["-c", print])
        .current_dir(folder.path()));
    assert_eq!(PathBuf::from(package), place.join("robocomp/__init__.py"));
    for typed in ["py.typed", "_native.pyi"] {
        assert!(place.join("robocomp").join(typed).exists(), "{typed}");
    }
    // Modules that only some components need, and the tools.
    let modules = "import robocomp.innermodel, robocomp.graph";
    run(Command::new(&own_python).args(["-I", "-c", modules]));
    for tool in ["rcgen", "rcdeploy"] {
        run(Command::new(environment.join("bin").join(tool)).arg("--version"));
    }
    run(Command::new(&own_python)
        .args(["-B", "test_client.py"])
        .current_dir(own.join("tests/python"))
        .env("TEST_MIDDLEWARE", "iceoryx2")
        .env("TEST_DOMAIN", "0")
        .env_remove("PYTHONPATH")
        .env_remove("ROBOCOMP_NATIVE"));
}
