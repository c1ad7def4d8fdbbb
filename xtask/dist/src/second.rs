//! A second compilation of the packages, of a copy of the sources in another folder: both have equal bytes.

use crate::build::{Build, output};
use crate::named;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Compiles again, lets `write` write the packages into a folder, and compares them with the first ones,
/// which are in `out`. After a difference, the second ones stay.
pub(crate) fn compare(
    build: &Build,
    first: &[PathBuf],
    out: &Path,
    write: impl Fn(&Build, &Path) -> Result<Vec<PathBuf>, String>,
) -> Result<(), String> {
    // A folder for temporary files may be in memory.
    let folder = tempfile::Builder::new()
        .prefix("second-build-")
        .tempdir_in(&build.target)
        .map_err(named(&build.target))?;
    let root = folder.path().join("sources");
    copy(&build.root, &root)?;
    println!("compiles a second time, in {}", root.display());
    let again = folder.path().join("packages");
    std::fs::create_dir(&again).map_err(named(&again))?;
    let second = write(&build.of(&root), &again)?;
    let different = different(first, out, &second, &again)?;
    if different.is_empty() {
        println!(
            "two compilations in two folders: {} packages with equal bytes",
            first.len()
        );
        return Ok(());
    }
    let kept = folder.keep().join("packages");
    Err(format!(
        "two compilations in two folders differ in {}; `diffoscope {} {}` shows where",
        different.join(", "),
        out.display(),
        kept.display()
    ))
}

/// Copies the sources, without what git ignores. The copy is of the same commit, which cargo notes in the
/// packages of crates.
fn copy(from: &Path, root: &Path) -> Result<(), String> {
    std::fs::create_dir(root).map_err(named(root))?;
    let git = |words: &[&str], work: &Path| {
        let mut git = Command::new("git");
        git.arg("--git-dir").arg(root.join(".git"));
        git.arg("--work-tree").arg(work).args(words);
        output(git.current_dir(work)).map(drop)
    };
    git(&["init", "--quiet"], root)?;
    if from.join(".git").exists() {
        let repository = from.to_string_lossy();
        let fetch = ["fetch", "--quiet", "--depth=1", "--no-tags", "--"];
        git(&[&fetch[..], &[&*repository, "HEAD"]].concat(), root)?;
        git(&["update-ref", "HEAD", "FETCH_HEAD"], root)?;
    }
    git(&["add", "--all"], from)?;
    git(&["checkout-index", "--all"], root)
}

/// The names of the files that one side lacks, or that differ.
fn different(
    first: &[PathBuf],
    out: &Path,
    second: &[PathBuf],
    again: &Path,
) -> Result<Vec<String>, String> {
    let name = |path: &Path, of: &Path| path.strip_prefix(of).unwrap_or(path).to_path_buf();
    let mut different = Vec::new();
    for path in first {
        let name = name(path, out);
        let other = again.join(&name);
        let is_there = second.contains(&other);
        let read = |path: &Path| std::fs::read(path).map_err(named(path));
        if !is_there || read(path)? != read(&other)? {
            different.push(name.display().to_string());
        }
    }
    let added = second.iter().map(|path| name(path, again));
    let added = added.filter(|name| !first.contains(&out.join(name)));
    different.extend(added.map(|name| name.display().to_string()));
    Ok(different)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_is_of_the_same_commit_with_the_same_changes() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let git = |words: &[&str], work: &str| {
            let mut git = Command::new("git");
            git.args(["-c", "user.name=Mia", "-c", "user.email=mia@example.org"]);
            output(git.args(words).current_dir(path(work))).expect("git")
        };
        std::fs::create_dir(path("one")).expect("a folder");
        let write = |name: &str, text: &str| {
            std::fs::write(path("one").join(name), text).expect("written");
        };
        // Sources of an archive have no commit.
        write("a", "1");
        copy(&path("one"), &path("archive")).expect("a copy");
        assert!(path("archive/a").is_file());
        git(&["init", "--quiet"], "one");
        git(&["add", "--all"], "one");
        git(&["commit", "--quiet", "--message=a"], "one");
        for (changed, name) in [("", "same"), ("?? b\n", "changed")] {
            if !changed.is_empty() {
                write("b", "2");
            }
            copy(&path("one"), &path(name)).expect("a copy");
            assert_eq!(git(&["status", "--porcelain"], "one"), changed);
            let copied = git(&["status", "--porcelain"], name);
            assert_eq!(copied.is_empty(), changed.is_empty(), "{copied}");
            let commit = |of: &str| git(&["rev-parse", "HEAD"], of);
            assert_eq!(commit("one"), commit(name));
        }
    }

    #[test]
    fn packages_that_differ_are_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |side: &str, files: &[(&str, &str)]| {
            let side = folder.path().join(side);
            std::fs::create_dir(&side).expect("a folder");
            let write = |(name, text): &(&str, &str)| {
                let path = side.join(name);
                std::fs::write(&path, text).expect("written");
                path
            };
            (files.iter().map(write).collect::<Vec<_>>(), side.clone())
        };
        let (first, out) = write("one", &[("a.deb", "a"), ("b.deb", "b"), ("c.deb", "c")]);
        let (second, again) = write("two", &[("a.deb", "a"), ("b.deb", "x"), ("d.deb", "d")]);
        let found = different(&first, &out, &second, &again).expect("files");
        assert_eq!(found, ["b.deb", "c.deb", "d.deb"]);
        let found = different(&first, &out, &first, &out).expect("files");
        assert!(found.is_empty(), "{found:?}");
    }
}
