//! The result of a generation in memory, and the one place that writes it.

use crate::load::named;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Who owns a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The generator: rewritten at every generation.
    Generic,
    /// The user: written where there is none, and never touched again.
    Specific,
    /// Whoever exports: rewritten at every export; what lies beside it is not looked at.
    Exported,
    /// The user: a few lines are added, and everything else of the file stays.
    Edited,
}

/// What a generation would do with a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It does not exist yet.
    Create,
    /// Its content is another one.
    Update,
    /// It is not part of the component any more.
    Remove,
    /// It is as it should be, or it is the user's.
    Keep,
}

impl Change {
    /// `create`, `update`, `remove` or `keep`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Create => "create",
            Self::Update => "update",
            Self::Remove => "remove",
            Self::Keep => "keep",
        }
    }
}

/// One step of a generation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The file, relative to the component's folder.
    pub path: PathBuf,
    /// Who owns it.
    pub owner: Owner,
    /// What happens.
    pub change: Change,
}

/// Files by their paths, relative to the folder that they are written to.
#[derive(Clone, Debug, Default)]
pub struct Files {
    all: BTreeMap<PathBuf, (Owner, String)>,
    /// What the edited files held before.
    before: BTreeMap<PathBuf, String>,
    /// The files that only their user may read.
    hidden: BTreeSet<PathBuf>,
}

/// The folder that belongs to the generator.
pub const GENERATED: &str = "generated";

impl Files {
    /// Adds a file.
    pub fn add(&mut self, path: impl Into<PathBuf>, owner: Owner, text: String) {
        self.all.insert(path.into(), (owner, text));
    }

    /// Lets only the user read a file that is created.
    pub(crate) fn hide(&mut self, path: impl Into<PathBuf>) {
        self.hidden.insert(path.into());
    }

    /// Edits a file of the user, if it still holds `old`.
    pub(crate) fn edit(&mut self, path: impl Into<PathBuf>, old: String, new: String) {
        let path = path.into();
        self.before.insert(path.clone(), old);
        self.add(path, Owner::Edited, new);
    }

    /// Removes a file.
    pub(crate) fn remove(&mut self, path: &Path) {
        self.all.remove(path);
    }

    /// The content of a file.
    pub fn text(&self, path: &Path) -> Option<&str> {
        self.all.get(path).map(|(_, text)| text.as_str())
    }

    /// The files.
    pub fn iter(&self) -> impl Iterator<Item = (&Path, Owner, &str)> {
        self.all
            .iter()
            .map(|(path, (owner, text))| (path.as_path(), *owner, text.as_str()))
    }

    /// What writing into `folder` would do; files under `generated/` that are none of ours go.
    pub fn plan(&self, folder: &Path) -> io::Result<Vec<Step>> {
        let mut steps = Vec::new();
        for (path, owner, text) in self.iter() {
            let change = match std::fs::read(folder.join(path)) {
                Ok(_) if owner == Owner::Specific => Change::Keep,
                Ok(there) if there == text.as_bytes() => Change::Keep,
                Ok(_) => Change::Update,
                Err(error) if error.kind() == io::ErrorKind::NotFound => Change::Create,
                Err(error) => return Err(named(&folder.join(path), &error)),
            };
            steps.push(Step {
                path: path.to_path_buf(),
                owner,
                change,
            });
        }
        let mut there = Vec::new();
        // Files that hold nothing generated (a new workspace) have no say over a folder of that
        // name.
        if self.all.values().any(|(owner, _)| *owner == Owner::Generic) {
            list(folder, Path::new(GENERATED), &mut there)?;
        }
        for path in there
            .into_iter()
            .filter(|path| !self.all.contains_key(path))
        {
            steps.push(Step {
                path,
                owner: Owner::Generic,
                change: Change::Remove,
            });
        }
        steps.sort_by(|a, b| a.path.cmp(&b.path));
        Ok(steps)
    }

    /// Writes the files into `folder`, as [`write`] does.
    pub fn write(&self, folder: &Path) -> io::Result<Vec<Step>> {
        let steps = write(&[(folder, self)])?;
        Ok(steps.into_iter().flatten().collect())
    }
}

/// Writes files into several folders, all or nothing; gives the steps of each folder. New contents
/// are all on the disk, under other names, before the first file is replaced, so that a disk that
/// is full changes nothing.
pub fn write(folders: &[(&Path, &Files)]) -> io::Result<Vec<Vec<Step>>> {
    let mut plans = Vec::new();
    for (folder, files) in folders {
        plans.push(files.plan(folder)?);
    }
    let all = || {
        let steps = folders.iter().zip(&plans);
        steps.flat_map(|((folder, files), steps)| {
            // The manifest is last: it holds what the other files are. The next generation completes
            // one that was killed.
            let is_manifest = |step: &&Step| step.path == Path::new(GENERATED).join("Cargo.toml");
            let (last, first): (Vec<&Step>, Vec<&Step>) = steps.iter().partition(is_manifest);
            let steps = first.into_iter().chain(last);
            steps.map(move |step| (*folder, *files, step))
        })
    };
    let mut edited = Vec::new();
    let mut staged: Vec<(PathBuf, PathBuf)> = Vec::new();
    for (folder, files, step) in all() {
        if !matches!(step.change, Change::Create | Change::Update) {
            continue;
        }
        let target = folder.join(&step.path);
        if step.owner == Owner::Edited {
            edited.push((target, files, step));
            continue;
        }
        let result = if staged.iter().any(|(_, other)| *other == target) {
            Err(io::Error::other("two parts of one generation write it"))
        } else {
            let mode = if files.hidden.contains(&step.path) {
                0o600
            } else {
                0o666
            };
            stage(&target, files.text(&step.path).unwrap_or_default(), mode)
        };
        if let Err(error) = result {
            for (temporary, _) in &staged {
                let _ = std::fs::remove_file(temporary);
            }
            let _ = std::fs::remove_file(temporary_of(&target));
            return Err(named(&target, &error));
        }
        staged.push((temporary_of(&target), target));
    }
    for (target, files, step) in edited {
        let old = files.before.get(&step.path).map_or("", String::as_str);
        let new = files.text(&step.path).unwrap_or_default();
        if let Err(error) = rc_files::replace(&target, old, new) {
            for (temporary, _) in &staged {
                let _ = std::fs::remove_file(temporary);
            }
            return Err(named(&target, &error));
        }
    }
    for (temporary, target) in &staged {
        std::fs::rename(temporary, target).map_err(|e| named(target, &e))?;
    }
    for (folder, _, step) in all().filter(|(_, _, step)| step.change == Change::Remove) {
        let path = folder.join(&step.path);
        match std::fs::remove_file(&path) {
            // A generation that was killed may have left it; this one has renamed it.
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(named(&path, &error));
            }
            _ => {}
        }
        // Removes the folder if it is empty.
        let _ = path.parent().map(std::fs::remove_dir);
    }
    Ok(plans)
}

/// Writes the file under another name. `mode` is what the umask leaves of it.
fn stage(target: &Path, text: &str, mode: u32) -> io::Result<()> {
    if let Some(parent) = target.parent() {
        std::fs::create_dir_all(parent)?;
    }
    let temporary = temporary_of(target);
    // One that is left of a generation that was killed keeps its mode.
    match std::fs::remove_file(&temporary) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let mut options = File::options();
    let file = options.write(true).create_new(true).mode(mode);
    file.open(temporary)?.write_all(text.as_bytes())
}

fn temporary_of(target: &Path) -> PathBuf {
    let mut name = target.file_name().unwrap_or_default().to_os_string();
    name.push(".rcgen-new");
    target.with_file_name(name)
}

fn list(folder: &Path, inside: &Path, out: &mut Vec<PathBuf>) -> io::Result<()> {
    let entries = match std::fs::read_dir(folder.join(inside)) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(named(&folder.join(inside), &error)),
    };
    for entry in entries {
        let entry = entry?;
        let path = inside.join(entry.file_name());
        let name = entry.file_name();
        // What cargo leaves there when somebody builds the crate alone is not generated.
        if entry.file_type()?.is_dir() {
            if name != "target" {
                list(folder, &path, out)?;
            }
        } else if name != "Cargo.lock" {
            out.push(path);
        }
    }
    Ok(())
}
