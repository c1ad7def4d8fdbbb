//! `cargo xtask semver`: compares the public API of the library crates with that of an earlier state,
//! by cargo-semver-checks.
//!
//! That program would build each crate twice, each time with all its dependencies. Here, rustdoc describes
//! the crates of both states in JSON, with one target folder for the dependencies, and the program compares
//! the descriptions.

use crate::tools;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

const NAME: &str = "cargo-semver-checks";
const VERSION: &str = "0.51.0";
pub(crate) const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const USAGE: &str = "usage: cargo xtask semver [--since REVISION] [--package NAME]…";
/// Settings of a developer's cargo that are not those of the published crates.
const UNSTABLE: [&str; 3] = ["CARGO_UNSTABLE_", "CARGO_RESOLVER_", "__CARGO_TEST_"];

/// The library crates of a state: the name of each package, and that of its library.
type Libraries = BTreeMap<String, String>;

/// Runs the comparison with a revision of git; with the last tag if none is named. Of the library crates,
/// it compares those that are named; all without names.
///
/// # Errors
/// The revision is missing, or the API has changed in a way that its version forbids.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    let (mut since, mut only) = (None, Vec::new());
    let (pairs, rest) = words.as_chunks::<2>();
    for pair in pairs {
        match *pair {
            ["--since", revision] => since = Some(revision.to_owned()),
            ["--package", name] => only.push(name),
            _ => return Err(USAGE.to_owned()),
        }
    }
    if !rest.is_empty() {
        return Err(USAGE.to_owned());
    }
    let since = match since {
        Some(revision) => revision,
        None => last_tag()?,
    };
    let published = libraries(&metadata(Path::new(ROOT))?);
    if let Some(name) = only.iter().find(|name| !published.contains_key(**name)) {
        return Err(format!("`{name}` is no library crate that is published"));
    }
    let program = match tools::installed(NAME, VERSION) {
        Ok(program) => program,
        Err(why) => {
            println!("skipped: semver: {why}");
            return Ok(());
        }
    };
    let folder = tools::target().join("semver");
    let sources = folder.join("sources");
    unpack(&since, &sources)?;
    let both = [(&*sources, "before"), (Path::new(ROOT), "now")];
    let [before, now] = both.map(|(root, name)| {
        let libraries = selected(libraries(&metadata(root)?), &only);
        let descriptions = folder.join(name);
        describe(root, &libraries, &folder.join("target"), &descriptions)?;
        Ok::<_, String>((libraries, descriptions))
    });
    let ((before, old), (now, new)) = (before?, now?);
    let same = compare(&before, &now, |library| {
        let file = |of: &Path| of.join(format!("{library}.json"));
        let mut check = Command::new(&program);
        check.arg("semver-checks").arg("--baseline-rustdoc");
        check
            .arg(file(&old))
            .arg("--current-rustdoc")
            .arg(file(&new));
        let output = stable(&mut check)
            .output()
            .map_err(|error| format!("{NAME}: {error}"))?;
        if output.status.success() {
            return Ok(true);
        }
        let texts = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
        println!("{}{}", texts[0], texts[1]);
        Ok(false)
    })?;
    println!("semver: the API of {same} crates fits that of {since}");
    Ok(())
}

/// Compares the crates of two states by `fits`, which gets the name of a library. Returns how many fit.
///
/// # Errors
/// A crate is gone, or does not fit.
fn compare(
    before: &Libraries,
    now: &Libraries,
    fits: impl Fn(&str) -> Result<bool, String>,
) -> Result<usize, String> {
    let (mut same, mut other) = (0, Vec::new());
    for (name, library) in before {
        match now.get(name) {
            None => other.push(format!("{name} (it is gone)")),
            Some(_) if fits(library)? => same += 1,
            Some(_) => other.push(name.clone()),
        }
    }
    for name in now.keys().filter(|name| !before.contains_key(*name)) {
        println!("new: {name}");
    }
    if other.is_empty() {
        return Ok(same);
    }
    Err(format!(
        "{same} crates have a public API that fits; {} have another one: {}",
        other.len(),
        other.join(", ")
    ))
}

/// The sources of a revision, without those of an earlier run.
fn unpack(revision: &str, to: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: {error}", to.display());
    match fs::remove_dir_all(to) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(failed(error)),
        _ => fs::create_dir_all(to).map_err(failed)?,
    }
    let archive = to.with_extension("tar");
    let mut git = Command::new("git");
    git.args(["archive", "--output"]).arg(&archive);
    git.arg(revision).current_dir(ROOT);
    done(&mut git)?;
    let mut tar = Command::new("tar");
    tar.arg("-xf").arg(&archive).arg("-C").arg(to);
    done(&mut tar)?;
    fs::remove_file(&archive).map_err(failed)
}

/// What cargo says of the packages of a workspace.
pub(crate) fn metadata(root: &Path) -> Result<Value, String> {
    let mut cargo = cargo(root);
    cargo.args(["metadata", "--no-deps", "--format-version", "1"]);
    serde_json::from_str(&output(&mut cargo)?).map_err(|error| format!("cargo metadata: {error}"))
}

/// The packages that may be published, with the names of their libraries.
fn libraries(metadata: &Value) -> Libraries {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let public = packages.filter(|package| package["publish"].is_null());
    let named = public.filter_map(|package| {
        let is_library = |target: &&Value| {
            let kinds = target["kind"].as_array().into_iter().flatten();
            kinds.into_iter().any(|kind| kind == "lib")
        };
        let library = package["targets"].as_array()?.iter().find(is_library)?;
        Some((text(&package["name"]), text(&library["name"])))
    });
    named.collect()
}

fn selected(mut all: Libraries, only: &[&str]) -> Libraries {
    all.retain(|name, _| only.is_empty() || only.contains(&name.as_str()));
    all
}

/// Describes the libraries of a workspace as `LIBRARY.json` in the folder `to`.
fn describe(root: &Path, libraries: &Libraries, target: &Path, to: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: {error}", to.display());
    // Both states have the same names in the target folder: cargo would consider what is newer than its
    // sources fresh, though it is of the other state.
    let mut clean = cargo(root);
    clean.args(["clean", "--quiet", "--workspace", "--target-dir"]);
    done(clean.arg(target))?;
    let mut doc = cargo(root);
    doc.args(["doc", "--quiet", "--lib", "--no-deps", "--target-dir"])
        .arg(target)
        // JSON is unstable, and its form fits the version of cargo-semver-checks.
        .env("RUSTC_BOOTSTRAP", "1")
        .env(
            "RUSTDOCFLAGS",
            "-Zunstable-options --output-format=json --cap-lints=allow",
        );
    for name in libraries.keys() {
        doc.args(["--package", name]);
    }
    println!("describes {} crates of {}", libraries.len(), root.display());
    done(&mut doc)?;
    let _ = fs::remove_dir_all(to);
    fs::rename(target.join("doc"), to).map_err(failed)
}

fn cargo(root: &Path) -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    stable(cargo.current_dir(root));
    cargo
}

/// A command without the unstable settings of this cargo: crates have other features with them.
fn stable(command: &mut Command) -> &mut Command {
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if UNSTABLE.iter().any(|start| text.starts_with(start)) {
            command.env_remove(&name);
        }
    }
    command
}

fn done(command: &mut Command) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(format!("{command:?} failed")),
        Err(error) => Err(format!("{command:?}: {error}")),
    }
}

fn output(command: &mut Command) -> Result<String, String> {
    let output = command.stderr(Stdio::inherit()).output();
    let output = output.map_err(|error| format!("{command:?}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{command:?} failed"));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn last_tag() -> Result<String, String> {
    let mut git = Command::new("git");
    git.args(["describe", "--tags", "--abbrev=0"]);
    match output(git.current_dir(ROOT).stderr(Stdio::null())) {
        Ok(tag) => Ok(tag.trim().to_owned()),
        Err(_) => Err(format!(
            "this repository has no tag to compare with; name a commit: {USAGE}"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn states(before: &[&str], now: &[&str]) -> [Libraries; 2] {
        let of = |names: &[&str]| {
            let pairs = names.iter().map(|name| (*name, name.replace('-', "_")));
            pairs
                .map(|(name, library)| (name.to_owned(), library))
                .collect()
        };
        [of(before), of(now)]
    }

    #[test]
    fn all_libraries_that_are_published_are_compared() {
        let metadata = metadata(Path::new(ROOT)).expect("a workspace");
        let all = libraries(&metadata);
        assert!(all.len() > 50, "{all:?}");
        assert_eq!(all["rc-runtime"], "rc_runtime");
        // `publish = false`, and a program.
        for name in ["xtask", "rcgen", "avoider"] {
            assert!(!all.contains_key(name), "{name}");
        }
        assert_eq!(selected(all, &["rc-runtime"]).len(), 1);
    }

    #[test]
    fn a_crate_that_is_gone_or_does_not_fit_is_named() {
        let [before, now] = states(&["a-b", "c", "d"], &["a-b", "c", "e"]);
        let fits = |library: &str| Ok(library != "c");
        let said = compare(&before, &now, fits).expect_err("two do not fit");
        assert!(
            said.ends_with("2 have another one: c, d (it is gone)"),
            "{said}"
        );
        let [before, now] = states(&["a-b"], &["a-b", "e"]);
        assert_eq!(compare(&before, &now, fits), Ok(1));
    }
}
