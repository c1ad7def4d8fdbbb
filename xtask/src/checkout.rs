//! The checkout whose programs a target folder has.
//!
//! Cargo names its artifacts by paths from the root of the workspace, and compares times. In a
//! target folder that another checkout has used, it considers the programs of that one fresh if
//! they are newer than the sources here, and tests then start them.

use crate::cargo;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The file in a target folder that names its checkout.
const MARK: &str = "checkout-of-tests";

/// Removes the programs of another checkout from the target folder.
///
/// # Errors
/// This program itself is one of another checkout, so that it would test that one.
pub(crate) fn own_target() -> Result<(), String> {
    let built = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let target = program.ancestors().nth(2).unwrap_or(Path::new("target"));
    // Cargo sets it for its children.
    if let Some(asked) = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from)
        && asked != built
    {
        return Err(format!(
            "cargo has taken the programs of {}, which it has found in {}, for those of {}: \
             delete the target folder {}, or give each checkout its own by CARGO_TARGET_DIR",
            built.display(),
            target.display(),
            asked.display(),
            target.display()
        ));
    }
    take(target, built, |other| {
        println!(
            "{} has programs of {other}, which are removed and built again",
            target.display()
        );
        cargo(&["clean", "--workspace"])
    })
}

/// Notes that the programs in the folder `target` are those of the checkout `root`. If they are
/// those of another one, `clean` removes them.
pub(crate) fn take(
    target: &Path,
    root: &Path,
    clean: impl FnOnce(&str) -> Result<(), String>,
) -> Result<(), String> {
    let mark = target.join(MARK);
    let failed = |error: io::Error| format!("{}: {error}", mark.display());
    let own = root.display().to_string();
    match fs::read_to_string(&mark) {
        Ok(other) if other == own => return Ok(()),
        Ok(other) => clean(&other)?,
        // It has programs even at the first run: this one. In a folder that was made by `cargo
        // build`, or restored by CI, they are most likely its own, and building all again would be
        // useless.
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(failed(error)),
    }
    fs::create_dir_all(target).map_err(failed)?;
    fs::write(&mark, own).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    #[test]
    fn programs_of_another_checkout_are_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("target");
        let cleaned = RefCell::new(Vec::new());
        let take = |root: &str| {
            take(&target, Path::new(root), |other| {
                cleaned.borrow_mut().push(other.to_owned());
                Ok(())
            })
        };
        for root in ["/a", "/a", "/b", "/b", "/a"] {
            take(root).expect("a mark");
        }
        assert_eq!(*cleaned.borrow(), ["/a", "/b"]);
    }

    #[test]
    fn what_cannot_be_removed_is_not_taken() {
        let folder = tempfile::tempdir().expect("a folder");
        let take = |root: &str, outcome: Result<(), String>| {
            take(folder.path(), Path::new(root), |_| outcome)
        };
        take("/a", Ok(())).expect("a mark");
        take("/b", Err("busy".to_owned())).expect_err("it is busy");
        take("/a", Err("busy".to_owned())).expect("it is still that of /a");
    }
}
