//! Debian packages for tests: those of the system, or unpacked below the target folder, which needs
//! no root permissions.

use crate::python::run;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Where what `packages` hold is: `None` for the system, or a folder with the unpacked packages and
/// those of their dependencies that are not installed, created once. `works` tries either.
///
/// # Errors
///
/// Why there is neither.
pub fn provided(
    packages: &str,
    works: &dyn Fn(Option<&Path>) -> bool,
) -> Result<Option<PathBuf>, String> {
    if works(None) {
        return Ok(None);
    }
    unpacked(packages, &|folder| works(Some(folder))).map(Some)
}

/// The path of a program of `packages`, of the system or unpacked, that runs with `--version`.
///
/// # Errors
///
/// Why there is none.
pub fn program(packages: &str, name: &str) -> Result<PathBuf, String> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let at = |place: Option<&Path>| match place {
        None => {
            let mut paths = std::env::split_paths(&path).map(|folder| folder.join(name));
            paths.find(|path| path.is_file()).unwrap_or_default()
        }
        Some(place) => place.join("usr/bin").join(name),
    };
    let works = |place: Option<&Path>| run(&at(place), &["--version"]).is_ok();
    let place = provided(packages, &works)?;
    Ok(at(place.as_deref()))
}

fn unpacked(packages: &str, works: &dyn Fn(&Path) -> bool) -> Result<PathBuf, String> {
    // One test at a time, because all use the same folder.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = crate::folder()?;
    let name = packages.split(' ').next().unwrap_or(packages);
    let place = folder.join(name);
    if works(&place) {
        return Ok(place);
    }
    // Created under another name and renamed, so that an existing folder is complete.
    let new = folder.join(format!("{name}-{}", std::process::id()));
    let script = format!(
        "set -e; mkdir \"$0\"; cd \"$0\"
        missing=$(apt-get --simulate install --no-upgrade {packages})
        missing=$(echo \"$missing\" | sed -n 's/^Inst \\([^ ]*\\).*/\\1/p')
        test \"$missing\" || {{ echo 'it is installed, and does not run' >&2; exit 1; }}
        apt-get download $missing
        for package in *.deb; do dpkg --extract $package .; done"
    );
    let made = run(
        Path::new("sh"),
        &["-c", &script, &new.display().to_string()],
    );
    // The script would not be readable in a list.
    let made = made.map_err(|error| {
        let last = error.rsplit("`: ").next().unwrap_or_default();
        format!("Debian's {packages}: {last}")
    });
    let made = made.and_then(|()| {
        if works(&new) {
            Ok(())
        } else {
            Err(format!(
                "Debian's {packages}: what they hold does not run here"
            ))
        }
    });
    if made.is_ok() && std::fs::rename(&new, &place).is_err() {
        // The existing folder is damaged, or belongs to a concurrent run.
        let _ = std::fs::remove_dir_all(&place);
        let _ = std::fs::rename(&new, &place);
    }
    let _ = std::fs::remove_dir_all(&new);
    made.map(|()| place)
}

#[test]
fn an_installed_package_is_used_and_not_unpacked() {
    assert_eq!(
        provided("no-such-package", &|place| place.is_none()),
        Ok(None)
    );
    if run(Path::new("apt-get"), &["--version"]).is_ok() {
        // It belongs to each Debian, so there is nothing to unpack.
        let found = provided("dpkg", &|_| false);
        let reason = "Debian's dpkg: it is installed, and does not run";
        assert_eq!(found, Err(reason.to_owned()));
    }
}
