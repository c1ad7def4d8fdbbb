//! The Dockerfile of the image that the manifests of Kubernetes name, for each machine: it holds
//! the programs, configurations and files of parameters at the paths of this machine.
//!
//! The build context is the folder that contains all of them. The ignore file next to the
//! Dockerfile keeps everything else out of it.

use super::{Machine, Source};
use rc_vocabulary::shell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The Dockerfile of a machine.
pub(super) struct Image {
    /// `FROM …`
    pub(super) text: String,
    /// The `.dockerignore`, which excludes everything but the copied files.
    pub(super) ignore: String,
    /// The command that builds it, run in any folder. `FOLDER` represents that of the Dockerfile.
    pub(super) command: String,
}

/// Describes the image `name` of a machine, whose containers run as `user`. The result is none if a
/// path is not UTF-8.
pub(super) fn image(
    source: &Source<'_>,
    machine: &Machine<'_>,
    name: &str,
    file: &str,
    user: u64,
) -> Option<Image> {
    let mut programs = BTreeSet::new();
    let mut data = BTreeSet::new();
    let mut folders = BTreeSet::new();
    for part in &machine.parts {
        programs.insert(part.component.executable.as_path());
        folders.insert(part.component.directory.as_path());
        data.extend(part.files.iter().map(PathBuf::as_path));
    }
    folders.extend(data.iter().filter_map(|file| file.parent()));
    let all: Vec<&Path> = programs.iter().chain(&data).copied().collect();
    let context = common_folder(&all);
    let command = format!(
        "docker build -f FOLDER/{file} -t {name} {}",
        shell::word(context.to_str()?)
    );
    let mut text = format!(
        "# {}\n# Build it after the programs: `{command}`, where FOLDER is the folder of this file.\n# The C library of BASE must not be older than that of the machine that built the programs:\n# `--build-arg BASE=ubuntu:24.04`.\nARG BASE=debian:stable-slim\nFROM ${{BASE}}\n",
        source.head()
    );
    let folders: Option<Vec<String>> = folders
        .iter()
        .map(|f| Some(shell::word(f.to_str()?)))
        .collect();
    let folders = folders?.join(" \\\n    ");
    // Components save parameters in the folders of their configurations.
    text += &format!(
        "RUN mkdir -p \\\n    {folders} \\\n    && chown {user}:{user} \\\n    {folders}\n"
    );
    let mut ignore = format!("# {}\n*\n", source.head());
    for (path, owner) in programs.iter().map(|path| (path, String::new())).chain(
        data.iter()
            .map(|path| (path, format!(" --chown={user}:{user}"))),
    ) {
        let inside = path.strip_prefix(&context).unwrap_or(path).to_str()?;
        let copied = [pattern(inside), path.to_str()?.replace('\\', "\\\\")];
        let copied = copied.map(|path| path.replace('$', "\\$"));
        let copied = serde_json::to_string(&copied).ok()?;
        text += &format!("COPY{owner} {copied}\n");
        ignore += &format!("!{}\n", pattern(inside));
    }
    text += &format!("USER {user}:{user}\n");
    Some(Image {
        text,
        ignore,
        command,
    })
}

/// The innermost folder that contains all files.
fn common_folder(files: &[&Path]) -> PathBuf {
    let mut folders = files.iter().filter_map(|file| file.parent());
    let first = folders.next().unwrap_or(Path::new("/"));
    folders.fold(first.to_path_buf(), |common, folder| {
        let both = common.components().zip(folder.components());
        both.take_while(|(one, other)| one == other)
            .map(|(one, _)| one)
            .collect()
    })
}

/// A path as a pattern of Go's `filepath.Match` that matches only this path.
fn pattern(path: &str) -> String {
    let mut out = String::new();
    for c in path.chars() {
        match c {
            '*' | '?' | '[' => out.extend(['[', c, ']']),
            '\\' => out.push_str("\\\\"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_context_holds_all_files() {
        let folder = |files: &[&str]| {
            let files: Vec<&Path> = files.iter().map(Path::new).collect();
            common_folder(&files)
        };
        assert_eq!(folder(&["/r/target/x", "/r/c/etc/y"]), Path::new("/r"));
        assert_eq!(folder(&["/r/x", "/s/y"]), Path::new("/"));
        assert_eq!(folder(&["/r/a/x", "/r/a/y"]), Path::new("/r/a"));
        assert_eq!(folder(&["/r/ab/x", "/r/a/y"]), Path::new("/r"));
    }

    #[test]
    fn what_means_something_to_others_is_escaped() {
        assert_eq!(pattern("a[1]*?"), "a[[]1][*][?]");
    }
}
