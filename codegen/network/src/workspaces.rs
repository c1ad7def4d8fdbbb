//! Cargo workspaces: what cargo knows of them. It is asked once for each.

use crate::profile::Profile;
use cargo_metadata::{Dependency, Error, MetadataCommand};
use rc_codegen::cargo_workspace::Workspace;
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// Workspaces by their roots.
#[derive(Debug, Default)]
pub(crate) struct Workspaces {
    /// Cargo is not asked.
    pub(crate) unasked: Cell<bool>,
    known: RefCell<HashMap<PathBuf, Result<Known, CargoFailure>>>,
}

/// Where cargo builds a workspace.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    /// The target folder.
    pub(crate) folder: PathBuf,
    /// The platform that the user has set for builds: `CARGO_BUILD_TARGET`, or `build.target` of a
    /// configuration of cargo.
    pub(crate) platform: Option<String>,
}

impl Target {
    /// The folder of the programs.
    pub(crate) fn programs(&self, profile: Profile) -> PathBuf {
        let folder = match &self.platform {
            Some(platform) => self.folder.join(platform),
            None => self.folder.clone(),
        };
        folder.join(profile.folder())
    }
}

/// Facts about a workspace, from `cargo metadata`.
#[derive(Clone, Debug)]
struct Known {
    target: Target,
    /// The dependencies of all members.
    dependencies: Vec<Dependency>,
}

impl Workspaces {
    /// The root of the workspace that a package in `folder` belongs to, if any.
    ///
    /// # Errors
    /// A manifest in `folder` or above it cannot be read, or is not TOML.
    pub(crate) fn root(folder: &Path) -> io::Result<Option<PathBuf>> {
        let workspace = Workspace::of(folder)?;
        Ok(workspace.map(|workspace| workspace.root().to_path_buf()))
    }

    /// The folder that cargo builds the workspace `root` into: `CARGO_TARGET_DIR`,
    /// `build.target-dir` of a configuration of cargo, or `target`. If cargo is not asked, or
    /// cannot be started, only configurations above the workspace count.
    pub(crate) fn target(&self, root: &Path) -> io::Result<Target> {
        Ok(self.known(root)?.target)
    }

    /// Dependencies of the members of the workspace `root`; `None` if cargo is not asked, or
    /// cannot be started.
    pub(crate) fn dependencies(&self, root: &Path) -> io::Result<Vec<Dependency>> {
        Ok(self.known(root)?.dependencies)
    }

    fn known(&self, root: &Path) -> io::Result<Known> {
        if self.unasked.get() {
            return Ok(usual(root));
        }
        let mut known = self.known.borrow_mut();
        let known = known.entry(root.to_path_buf()).or_insert_with(|| ask(root));
        let failure = |failure: CargoFailure| io::Error::new(failure.kind, failure.reason);
        known.clone().map_err(failure)
    }
}

/// Why cargo does not report the target folder of a workspace.
#[derive(Clone, Debug)]
struct CargoFailure {
    /// `InvalidInput` for a manifest of the user.
    kind: io::ErrorKind,
    reason: String,
}

/// Cargo: `CARGO`, or that of the path. A timer or a service often has no path to the one that
/// rustup installs in the home folder.
pub fn cargo() -> PathBuf {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    if let Some(cargo) = variable("CARGO") {
        return cargo.into();
    }
    let path = variable("PATH").unwrap_or_default();
    let is_in_path = std::env::split_paths(&path).any(|folder| folder.join("cargo").is_file());
    let installed = home().map(|home| home.join("bin/cargo"));
    installed
        .filter(|cargo| !is_in_path && cargo.is_file())
        .unwrap_or_else(|| "cargo".into())
}

/// `CARGO_TARGET_DIR`. As for cargo, a relative one starts at the working directory, not at the
/// workspace, in which `rcdeploy` starts cargo.
pub fn target_variable() -> Option<PathBuf> {
    let set = std::env::var_os("CARGO_TARGET_DIR").filter(|folder| !folder.is_empty())?;
    std::path::absolute(set).ok()
}

/// The target folder without cargo: its defaults, and `build.target-dir` of its configurations.
fn usual(root: &Path) -> Known {
    let configured = || {
        let (folder, target) = configured(root, "target-dir")?;
        Some(folder.join(target))
    };
    let folder = target_variable().or_else(configured);
    Known {
        target: Target {
            folder: folder.unwrap_or_else(|| root.join("target")),
            platform: platform(root),
        },
        dependencies: Vec::new(),
    }
}

/// The platform that cargo builds for, if the user has set one. Cargo builds into a folder of its
/// name then, also if it is that of this machine.
fn platform(root: &Path) -> Option<String> {
    let set = std::env::var("CARGO_BUILD_TARGET")
        .ok()
        .filter(|set| !set.is_empty());
    let set = set.or_else(|| configured(root, "target").map(|(_, platform)| platform))?;
    // A file describes a platform that rustc does not know.
    match set.strip_suffix(".json") {
        Some(file) => Path::new(file).file_name()?.to_str().map(str::to_owned),
        None => Some(set),
    }
}

/// Whether the user has chosen a linker for a platform.
pub(crate) fn linker(root: &Path, platform: &str) -> bool {
    let variable = platform.to_uppercase().replace('-', "_");
    let variable = format!("CARGO_TARGET_{variable}_LINKER");
    std::env::var_os(variable).is_some_and(|set| !set.is_empty())
        || setting(root, &["target", platform, "linker"]).is_some()
}

/// A text of `[build]` in the nearest configuration of cargo that has it, with the folder that
/// contains `.cargo`.
fn configured(root: &Path, key: &str) -> Option<(PathBuf, String)> {
    setting(root, &["build", key])
}

/// A text in the nearest configuration of cargo that has it, with the folder that contains `.cargo`.
/// Of an array, the first text.
fn setting(root: &Path, keys: &[&str]) -> Option<(PathBuf, String)> {
    let root = root.canonicalize().ok()?;
    let above = root.ancestors().map(|folder| folder.join(".cargo"));
    let mut places = above.chain(home());
    places.find_map(|place| {
        let text = rc_files::read(&place.join("config.toml")).ok()?;
        let file: toml_edit::DocumentMut = text.parse().ok()?;
        let mut keys = keys.iter();
        let value = keys.try_fold(file.as_item(), |item, key| item.get(*key))?;
        let first = value.as_array().and_then(|all| all.get(0)?.as_str());
        let text = value.as_str().or(first)?.to_owned();
        Some((place.parent()?.to_owned(), text))
    })
}

/// The folder of cargo: `CARGO_HOME`, else `.cargo` of the home folder.
fn home() -> Option<PathBuf> {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let home = variable("CARGO_HOME").map(PathBuf::from);
    home.or_else(|| Some(PathBuf::from(variable("HOME")?).join(".cargo")))
}

fn ask(root: &Path) -> Result<Known, CargoFailure> {
    let mut metadata = MetadataCommand::new();
    if let Some(target) = target_variable() {
        metadata.env("CARGO_TARGET_DIR", target);
    }
    let metadata = metadata
        .cargo_path(cargo())
        // Cargo looks for its configuration from here upwards.
        .current_dir(root)
        .manifest_path(root.join("Cargo.toml"))
        .no_deps()
        .exec();
    let (kind, reason, advice) = match metadata {
        Ok(metadata) => {
            let packages = metadata.packages.into_iter();
            return Ok(Known {
                target: Target {
                    folder: metadata.target_directory.into_std_path_buf(),
                    platform: platform(root),
                },
                dependencies: packages.flat_map(|package| package.dependencies).collect(),
            });
        }
        Err(Error::CargoMetadata { stderr }) => (
            io::ErrorKind::InvalidInput,
            stderr.trim().trim_start_matches("error: ").to_owned(),
            "correct the manifest that it names",
        ),
        // A robot has programs, and no cargo.
        Err(Error::Io(_)) => return Ok(usual(root)),
        Err(error) => (
            io::ErrorKind::Other,
            error.to_string(),
            "is this the cargo of a Rust toolchain?",
        ),
    };
    let root = root.display();
    let reason = format!("cargo does not tell where it builds {root}: {reason} ({advice})");
    Err(CargoFailure { kind, reason })
}
