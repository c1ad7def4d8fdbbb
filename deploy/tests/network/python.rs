//! Programs in Python with the package `iceoryx2`, which know of this project what its documents say.

use crate::outside::{run, skipped};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const PACKAGE: &str = "iceoryx2==0.10.0";

/// An interpreter that has the package, in an environment below the target folder which is made once; without Python,
/// or without a way to the package, `test` is listed as skipped.
pub(crate) fn interpreter(test: &str) -> Option<&'static Path> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match FOUND.get_or_init(install) {
        Ok(python) => Some(python),
        Err(reason) => {
            skipped(test, reason);
            None
        }
    }
}

fn install() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let place = folder.join(PACKAGE.replace("==", "-"));
    let python = place.join("bin/python");
    if run(&python, &["-c", "import iceoryx2"]).is_ok() {
        return Ok(python);
    }
    // Made under another name, so that what is found is whole, whoever else does the same now.
    let new = folder.join(format!("python-{}", std::process::id()));
    let path = new.display().to_string();
    let made = run(Path::new("python3"), &["-m", "venv", &path]).and_then(|()| {
        let pip = "-m pip install --quiet --disable-pip-version-check --only-binary :all: --retries 1 --timeout 15";
        let pip: Vec<&str> = pip.split(' ').chain([PACKAGE]).collect();
        run(&new.join("bin/python"), &pip)
    });
    if made.is_ok() && std::fs::rename(&new, &place).is_err() && place.exists() {
        // What is there is another one's, or was spoilt.
        let _ = std::fs::remove_dir_all(&place);
        let _ = std::fs::rename(&new, &place);
    }
    let _ = std::fs::remove_dir_all(&new);
    made.map(|()| python)
}
