//! The sources that a host needs to build: the workspaces of all packages that cargo would read here.

use super::Build;
use crate::error::{Error, cannot, refused};
use crate::launcher;
use crate::workspaces::{Workspaces, cargo};
use cargo_metadata::{Metadata, MetadataCommand};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::DirEntry;
use std::io;
use std::path::{Path, PathBuf};

/// The most files of sources, and the most bytes.
const MOST_FILES: usize = 100_000;
const MOST_BYTES: u64 = 2 << 30;

/// Folders without sources, besides hidden ones and what cargo has built.
const LEFT_OUT: [&str; 4] = ["__pycache__", "build", "node_modules", "target"];
/// The hidden folder that cargo reads.
const CONFIGURATION: &str = ".cargo";

/// The sources of a build.
#[derive(Debug)]
pub struct Sources {
    /// The folders that hold them, absolute. None is below another one.
    pub folders: Vec<PathBuf>,
    /// The files. A path of a link is one of a link to a file or a folder below one of the folders.
    pub files: Vec<Source>,
    /// The oldest Rust that builds all packages: major and minor version.
    pub rust: Option<(u64, u64)>,
}

/// One file of the sources.
#[derive(Debug)]
pub enum Source {
    /// A file, by its absolute path.
    File(PathBuf),
    /// A link with its target, both absolute.
    Link(PathBuf, PathBuf),
}

impl Sources {
    /// The sources of a build.
    ///
    /// # Errors
    /// Cargo does not know the packages, or a folder cannot be read.
    pub fn of(build: &Build) -> Result<Self, Error> {
        let metadata = metadata(build)?;
        let packages = || metadata.packages.iter().filter(|one| one.source.is_none());
        let mut roots: BTreeSet<PathBuf> = BTreeSet::new();
        for package in packages() {
            let folder = package.manifest_path.as_std_path().parent();
            let folder = folder.unwrap_or(Path::new("/"));
            let root = Workspaces::root(folder).map_err(refused("find the sources"))?;
            roots.insert(root.unwrap_or_else(|| folder.to_path_buf()));
        }
        roots.insert(build.root.clone());
        // A variant may need a middleware that no component of the workspace has.
        roots.extend(launcher::framework(&build.root)?);
        let staged = build.staged().map(Path::to_path_buf);
        let mut walk = Walk::default();
        // What is below the target folder is left out with it.
        for root in roots.iter().chain(&staged) {
            let root = root.canonicalize();
            walk.folders
                .insert(root.map_err(cannot("find the sources"))?);
        }
        for root in walk.folders.clone() {
            let above = root.ancestors().skip(1);
            let is_walked = |of: &Path| walk.folders.contains(of);
            if above.clone().any(is_walked) && staged.as_ref() != Some(&root) {
                continue;
            }
            walk.add(&root, &mut Vec::new())
                .map_err(refused(format!("list the sources in {}", root.display())))?;
        }
        let rust = packages().filter_map(|package| package.rust_version.as_ref());
        Ok(Self {
            rust: rust.map(|version| (version.major, version.minor)).max(),
            folders: walk.folders.into_iter().collect(),
            files: walk.files,
        })
    }
}

/// The packages of a build. Cargo is asked without the network first: it has read them before.
fn metadata(build: &Build) -> Result<Metadata, Error> {
    let mut args = build.args.iter();
    let named = args.by_ref().any(|arg| arg == "--manifest-path");
    let manifest = args.next().filter(|_| named).map(PathBuf::from);
    // Variants have the packages of the user's workspace, some of them under two names, which `cargo
    // metadata` refuses.
    let manifest = manifest.filter(|_| build.staged().is_none());
    let manifest = manifest.unwrap_or_else(|| build.root.join("Cargo.toml"));
    let ask = |more: &[&str]| {
        MetadataCommand::new()
            .cargo_path(cargo())
            .current_dir(&build.root)
            .manifest_path(&manifest)
            .other_options(more.iter().map(|&one| one.to_owned()).collect::<Vec<_>>())
            .exec()
    };
    ask(&["--offline"]).or_else(|_| ask(&[])).map_err(|error| {
        let of = manifest.display();
        Error::Workspace(format!("cargo does not know the packages of {of}: {error}"))
    })
}

#[derive(Default)]
struct Walk {
    folders: BTreeSet<PathBuf>,
    files: Vec<Source>,
    bytes: u64,
}

impl Walk {
    /// Adds the files below a folder. `above` are the real folders that hold it: one that contains
    /// itself by a link is read once.
    fn add(&mut self, folder: &Path, above: &mut Vec<PathBuf>) -> io::Result<()> {
        let named = |error: io::Error| {
            io::Error::new(error.kind(), format!("{}: {error}", folder.display()))
        };
        let read = || -> io::Result<(PathBuf, Vec<DirEntry>)> {
            let real = folder.canonicalize()?;
            let entries: io::Result<_> = folder.read_dir()?.collect();
            Ok((real, entries?))
        };
        let (real, mut entries) = match read() {
            // Somebody has removed it meanwhile.
            Err(error) if error.kind() == io::ErrorKind::NotFound && !above.is_empty() => {
                return Ok(());
            }
            read => read.map_err(named)?,
        };
        if above.contains(&real) {
            return Ok(());
        }
        above.push(real);
        entries.sort_by_key(DirEntry::file_name);
        for entry in entries {
            let (path, name) = (entry.path(), entry.file_name());
            if entry.file_type().map_err(named)?.is_symlink() {
                // A link to nothing is no source.
                let Ok(target) = path.canonicalize() else {
                    continue;
                };
                if self.folders.iter().any(|folder| target.starts_with(folder)) {
                    self.push(Source::Link(path, target), 0)?;
                    continue;
                }
            }
            let file = match path.metadata() {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                file => file.map_err(named)?,
            };
            if file.is_dir() {
                if !is_left_out(&path, &name) {
                    self.add(&path, above)?;
                }
            } else if file.is_file() && !is_secret(folder, &name) {
                self.push(Source::File(path), file.len())?;
            }
        }
        above.pop();
        Ok(())
    }

    fn push(&mut self, source: Source, bytes: u64) -> io::Result<()> {
        self.files.push(source);
        self.bytes = self.bytes.saturating_add(bytes);
        if self.files.len() <= MOST_FILES && self.bytes <= MOST_BYTES {
            return Ok(());
        }
        let message = format!(
            "a host gets at most {MOST_FILES} files and {} GiB of sources; move data out of the workspace, or build here",
            MOST_BYTES >> 30
        );
        Err(io::Error::new(io::ErrorKind::InvalidInput, message))
    }
}

/// Whether a file may hold a secret, and is no source: a hidden one such as `.env` or `.netrc`, and one
/// of cargo that is not its configuration. A workspace in a home folder has the downloaded packages
/// there, and the keys of registries.
fn is_secret(folder: &Path, name: &OsStr) -> bool {
    let is_of_cargo = folder.ends_with(CONFIGURATION) && name != "config.toml" && name != "config";
    is_hidden(name) || is_of_cargo
}

fn is_hidden(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(b".")
}

fn is_left_out(path: &Path, name: &OsStr) -> bool {
    let hidden = is_hidden(name) && name != CONFIGURATION;
    // Cargo and others mark what can be made again.
    let is_made = || path.join("CACHEDIR.TAG").is_file();
    // A folder with this name and a manifest is a package.
    let is_named = LEFT_OUT.iter().any(|one| name == *one) && !path.join("Cargo.toml").is_file();
    // Of the home folder of cargo, only the configuration counts.
    let is_of_cargo = path.parent().is_some_and(|of| of.ends_with(CONFIGURATION));
    hidden || is_of_cargo || is_named || is_made()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn sources_are_listed_without_what_is_built_from_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path().canonicalize().expect("a folder").join("ws");
        for name in [
            "ws/Cargo.toml",
            "ws/.cargo/config.toml",
            "ws/.cargo/credentials.toml",
            "ws/.cargo/registry/index",
            "ws/.git/config",
            "ws/target/debug/program",
            "ws/built/CACHEDIR.TAG",
            "ws/eye/src/main.rs",
            "ws/eye/.env",
            "ws/eye/build/x.o",
            "ws/build/Cargo.toml",
            "data/map.png",
            "data/.netrc",
        ] {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, "").expect("a file");
        }
        symlink("../eye", root.join("eye/again")).expect("a link");
        symlink("nowhere", root.join("eye/nowhere")).expect("a link");
        symlink(folder.path().join("data"), root.join("eye/data")).expect("a link");
        let mut walk = Walk::default();
        walk.folders.insert(root.clone());
        walk.add(&root, &mut Vec::new()).expect("a list");
        let name = |source: &Source| {
            let (Source::File(path) | Source::Link(path, _)) = source;
            let path = path.strip_prefix(&root).expect("it is below");
            path.display().to_string()
        };
        let names: Vec<String> = walk.files.iter().map(name).collect();
        let wanted = [
            ".cargo/config.toml",
            "Cargo.toml",
            "build/Cargo.toml",
            "eye/again",
            "eye/data/map.png",
            "eye/src/main.rs",
        ];
        assert_eq!(names, wanted);
        assert!(matches!(&walk.files[3], Source::Link(_, to) if *to == root.join("eye")));
    }
}
