//! What tests of several crates share: packages of Python and Debian below the target folder, and
//! workspaces that share the compiled crates of this one.

pub mod cable;
pub mod cmake;
pub mod debian;
pub mod python;
pub mod ros_packages;
pub mod screen;
mod shared_builds;

pub use shared_builds::share_builds;

use std::path::PathBuf;

/// The folder of cargo for files of tests, `target/tmp`, which cargo creates for tests only.
///
/// # Errors
///
/// The running program is not in a target folder.
pub fn folder() -> Result<PathBuf, String> {
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    // Programs of tests are one folder deeper than others: `target/debug/deps`.
    let profile = own.parent().map(|folder| {
        let is_deps = folder.file_name() == Some("deps".as_ref());
        folder.parent().filter(|_| is_deps).unwrap_or(folder)
    });
    let target = profile.and_then(|profile| profile.parent());
    Ok(target.ok_or("there is no target folder")?.join("tmp"))
}
