//! Puts a component of a workspace under a prefix, where networks find it without a workspace and
//! without cargo ([`rc_codegen::installed`] has the layout).

use crate::cmake;
use crate::error::{Error, cannot, refused};
use crate::launcher;
use crate::load::Overrides;
use crate::path_values::named_files;
use crate::profile::Profile;
use crate::reading::Reading;
use crate::workspaces::Workspaces;
use rc_codegen::cargo_workspace::Workspace;
use rc_codegen::files::GENERATED;
use rc_codegen::installed::{COMPONENTS, INTERFACES, LIBRARIES, PROGRAMS, program_name};
use rc_codegen::note::Note;
use rc_codegen::paths::{absolute, normal, relative};
use rc_codegen::{FileLoader, Project};
use rc_diagnostics::{Diagnostics, Severity, SourceMap};
use rc_vocabulary::Builder;
use rustix::fs::{CWD, RenameFlags, renameat_with};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// Most files of one component.
const MOST_FILES: usize = 10_000;

/// The folder of compiled modules, which Python writes next to the modules that it reads.
const COMPILED: &str = "__pycache__";

/// The list of the files in the folder of an installed component.
const LIST: &str = "installed.txt";

/// A component that can be installed.
#[derive(Debug)]
pub struct Installation {
    /// Its file.
    description: PathBuf,
    /// Its folder, below the prefix.
    folder: PathBuf,
    /// Its files, by their paths below the prefix.
    files: BTreeMap<PathBuf, Content>,
}

#[derive(Debug)]
enum Content {
    /// A file of the workspace.
    Copy(PathBuf),
    /// A script.
    Script(String),
    /// The list of files.
    List(String),
}

/// Two different files for one place.
#[derive(Debug)]
pub struct Disagreement<'a> {
    /// The place below the prefix.
    pub place: &'a Path,
    /// The two files. One that is written by the installation is named by its component.
    pub sources: [&'a Path; 2],
}

impl Content {
    fn bytes(&self) -> Result<Cow<'_, [u8]>, Error> {
        match self {
            Self::Copy(from) => {
                let read = std::fs::read(from).map(Cow::Owned);
                read.map_err(cannot(format!("read {}", from.display())))
            }
            Self::Script(text) | Self::List(text) => Ok(Cow::Borrowed(text.as_bytes())),
        }
    }

    fn source<'a>(&'a self, of: &'a Installation) -> &'a Path {
        match self {
            Self::Copy(from) => from,
            Self::Script(_) | Self::List(_) => &of.description,
        }
    }
}

impl Installation {
    /// Collects the files of a component: its description and what that names, the configuration
    /// and the files that this names, and its program of a profile. Findings about its files are
    /// added to `found`; then there is no installation.
    ///
    /// # Errors
    /// The program is missing or of another version, or a file would lie outside of the prefix.
    pub fn of(
        path: &Path,
        profile: Profile,
        sources: &mut SourceMap,
        loader: &FileLoader,
        found: &mut Diagnostics,
    ) -> Result<Option<Self>, Error> {
        let first = sources.ids().count();
        let project = Project::load(path, sources, loader);
        let (project, more) = project.map_err(cannot(format!("read {}", path.display())))?;
        let faulty = more.has_errors();
        found.extend(more);
        let Some(project) = project.filter(|_| !faulty) else {
            return Ok(None);
        };
        let read: Vec<PathBuf> = sources
            .ids()
            .skip(first)
            .map(|id| sources.path(id).to_path_buf())
            .collect();
        let Some(named) = files_of_configuration(&project, sources, loader, found)? else {
            return Ok(None);
        };
        let name = &project.component.name.text;
        if path.file_stem() != Some(name.as_ref()) {
            return Err(Error::Workspace(format!(
                "the file of the component `{name}` is {}; networks find an installed component by its name, so name the file `{name}.cdsl`",
                path.display()
            )));
        }
        let own = absolute(project.folder()).map_err(cannot("find the component"))?;
        let mut installation = Self {
            description: path.to_path_buf(),
            folder: Path::new(COMPONENTS).join(name),
            files: BTreeMap::new(),
        };
        let workspace = Workspace::of(&own).map_err(refused("read the workspace"))?;
        let search = workspace.map_or_else(Vec::new, |workspace| workspace.search());
        // The interfaces that come with rcgen are no files.
        for file in read.iter().filter(|file| file.is_file()) {
            let file = absolute(file).map_err(cannot("find a file"))?;
            let parent = file.parent().unwrap_or(Path::new(""));
            let is_shared = search.iter().any(|folder| folder == parent);
            if is_shared && let Some(base) = file.file_name() {
                let place = Path::new(INTERFACES).join(base);
                installation.files.insert(place, Content::Copy(file));
            } else {
                installation.add(&own, &file)?;
            }
        }
        for file in named {
            installation.add(&own, &absolute(&file).map_err(cannot("find a file"))?)?;
        }
        let code = absolute(project.code()).map_err(cannot("find the component"))?;
        installation.add_folder(&code, Path::new("etc"))?;
        installation.add_program(&project, &code, profile)?;
        installation.add_list();
        Ok(Some(installation))
    }

    /// Adds a file at its place relative to the folder of the component.
    fn add(&mut self, own: &Path, file: &Path) -> Result<(), Error> {
        let place = normal(&self.folder.join(relative(own, file)));
        if place.starts_with("..") {
            return Err(Error::Workspace(format!(
                "{} would lie outside of the prefix, because the component names it {}; move it next to the component",
                file.display(),
                relative(own, file).display()
            )));
        }
        self.files.insert(place, Content::Copy(file.to_path_buf()));
        if self.files.len() > MOST_FILES {
            return Err(Error::Workspace(format!(
                "the component has more than {MOST_FILES} files"
            )));
        }
        Ok(())
    }

    /// Adds all files below a folder of the component, which need not exist.
    fn add_folder(&mut self, own: &Path, folder: &Path) -> Result<(), Error> {
        let there = own.join(folder);
        let action = || format!("list {}", there.display());
        let entries = match there.read_dir() {
            Ok(entries) => entries,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(cannot(action())(error)),
        };
        for entry in entries {
            let entry = entry.map_err(cannot(action()))?;
            let inside = folder.join(entry.file_name());
            let kind = entry.file_type().map_err(cannot(action()))?;
            // A link is the file that it leads to; one to a folder may lead to itself.
            if kind.is_dir() && entry.file_name() != COMPILED {
                self.add_folder(own, &inside)?;
            } else if own.join(&inside).is_file() {
                self.add(own, &own.join(&inside))?;
            }
        }
        Ok(())
    }

    /// Adds the program, and what it needs beside it.
    fn add_program(
        &mut self,
        project: &Project,
        code: &Path,
        profile: Profile,
    ) -> Result<(), Error> {
        let name = program_name(project);
        let place = self.folder.join(PROGRAMS).join(&name);
        let component = &project.component.name.text;
        let model = format!("{:016x}", project.hash);
        let programs = || {
            let root = Workspaces::root(code).map_err(refused("find the workspace"))?;
            let Some(root) = root else {
                return Err(Error::Workspace(format!(
                    "`{component}` is in no workspace, so nothing builds it"
                )));
            };
            let target = Workspaces::default().target(&root);
            let target = target.map_err(refused("find the target folder"))?;
            Ok(target.programs(profile))
        };
        let of_this_version = |program: &Path, build: &str| match Note::read(program) {
            Ok(notes) if notes.iter().any(|note| note.model == model) => Ok(()),
            Ok(_) => Err(Error::Workspace(format!(
                "{} was built from another version of `{component}`; {build}",
                program.display()
            ))),
            Err(error) if error.kind() == ErrorKind::NotFound => Err(Error::Workspace(format!(
                "there is no {}; {build}",
                program.display()
            ))),
            Err(error) => Err(cannot(format!("read {}", program.display()))(error)),
        };
        let content = match project.builder() {
            Builder::Cargo => {
                let program = programs()?.join(&name);
                let build = format!(
                    "build it: `cargo build --workspace --profile {} --bin {name}`",
                    profile.word()
                );
                of_this_version(&program, &build)?;
                Content::Copy(program)
            }
            Builder::Interpreter => {
                let note = Note::of_generated(code).ok().flatten();
                let Some(note) = note.filter(|note| note.model == model) else {
                    return Err(Error::Workspace(format!(
                        "the generated code of `{component}` is missing or of another version; generate it: `rcgen {}`",
                        project.path.display()
                    )));
                };
                self.add_folder(code, Path::new("src"))?;
                self.add_folder(code, Path::new(GENERATED))?;
                Content::Script(launcher::installed(project, &self.folder, &note)?)
            }
            Builder::Cmake => {
                let programs = programs()?;
                let program = programs.join(&name);
                let build = "`rcdeploy up --build` of a network with it builds it".to_owned();
                of_this_version(&program, &build)?;
                // The program looks for the library there, if none is beside it.
                let library = programs.join(cmake::LIBRARY);
                let there = Path::new(LIBRARIES).join(cmake::LIBRARY);
                self.files.insert(there, Content::Copy(library));
                Content::Copy(program)
            }
        };
        self.files.insert(place, content);
        Ok(())
    }

    /// Adds the list of the component's own files, which the next version replaces.
    fn add_list(&mut self) {
        let inside = |place: &PathBuf| {
            let inside = place.strip_prefix(&self.folder).ok()?;
            Some(format!("{}\n", inside.display()))
        };
        let text = self.files.keys().filter_map(inside).collect();
        let place = self.folder.join(LIST);
        self.files.insert(place, Content::List(text));
    }

    /// The folder of the component below the prefix.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The files, by their paths below the prefix.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.keys().map(PathBuf::as_path)
    }

    /// The files that are shared with other components, and that are installed with another
    /// content.
    ///
    /// # Errors
    /// The system does not give a file.
    pub fn conflicts(&self, prefix: &Path) -> Result<Vec<PathBuf>, Error> {
        let mut all = Vec::new();
        for (place, content) in &self.files {
            let there = prefix.join(place);
            if place.starts_with(&self.folder) || !there.exists() {
                continue;
            }
            let installed = std::fs::read(&there);
            let installed = installed.map_err(cannot(format!("read {}", there.display())))?;
            if *content.bytes()? != *installed {
                all.push(there);
            }
        }
        Ok(all)
    }

    /// Two different files of two components for the same place, of which only one can be there:
    /// two workspaces have an interface or a component of the same name. `None` if all fit together.
    ///
    /// # Errors
    /// The system does not give a file.
    pub fn disagreement(all: &[Self]) -> Result<Option<Disagreement<'_>>, Error> {
        let mut first: BTreeMap<&Path, (&Self, &Content)> = BTreeMap::new();
        for one in all {
            for (place, content) in &one.files {
                let Some((other, earlier)) = first.insert(place, (one, content)) else {
                    continue;
                };
                if earlier.bytes()? != content.bytes()? {
                    return Ok(Some(Disagreement {
                        place,
                        sources: [(other, earlier), (one, content)]
                            .map(|(of, content)| content.source(of)),
                    }));
                }
            }
        }
        Ok(None)
    }

    /// Writes the files. The folder of an installed version is exchanged as a whole: a running
    /// program keeps the files that it has opened. Files in it that the installed version does not
    /// list stay, because other components name them.
    ///
    /// # Errors
    /// The system refuses a file; then the installed version stays.
    pub fn write(&self, prefix: &Path) -> io::Result<()> {
        let place = prefix.join(&self.folder);
        let parent = place.parent().unwrap_or(prefix);
        let name = place.file_name().unwrap_or_default().to_string_lossy();
        let new = parent.join(format!(".{name}.new-{}", std::process::id()));
        let written = self.write_to(prefix, &new).and_then(|()| {
            keep_others(&place, &new)?;
            match renameat_with(CWD, &new, CWD, &place, RenameFlags::EXCHANGE) {
                Ok(()) => std::fs::remove_dir_all(&new),
                Err(rustix::io::Errno::NOENT) => std::fs::rename(&new, &place),
                Err(error) => Err(error.into()),
            }
        });
        if written.is_err() {
            let _ = std::fs::remove_dir_all(&new);
        }
        written
    }

    /// Writes the files of the component's folder into `new`, then the shared ones.
    fn write_to(&self, prefix: &Path, new: &Path) -> io::Result<()> {
        for (place, content) in &self.files {
            if let Ok(inside) = place.strip_prefix(&self.folder) {
                put(content, &new.join(inside))?;
            }
        }
        for (place, content) in &self.files {
            if !place.starts_with(&self.folder) {
                let place = prefix.join(place);
                let next = place.with_extension(format!("new-{}", std::process::id()));
                let put = put(content, &next).and_then(|()| std::fs::rename(&next, &place));
                if put.is_err() {
                    let _ = std::fs::remove_file(&next);
                }
                put?;
            }
        }
        Ok(())
    }
}

/// Links the files of an installed component that are not its own into its new folder.
fn keep_others(old: &Path, new: &Path) -> io::Result<()> {
    // A link leads to a folder that stays.
    if !old.symlink_metadata().is_ok_and(|old| old.is_dir()) {
        return Ok(());
    }
    let list = match std::fs::read_to_string(old.join(LIST)) {
        Ok(list) => list,
        Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
        Err(error) => return Err(error),
    };
    let own: HashSet<&Path> = list.lines().map(Path::new).collect();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in old.join(&folder).read_dir()? {
            let entry = entry?;
            let inside = folder.join(entry.file_name());
            let place = new.join(&inside);
            if entry.file_type()?.is_dir() {
                if entry.file_name() != COMPILED {
                    folders.push(inside);
                }
            } else if !own.contains(&*inside) && place.symlink_metadata().is_err() {
                std::fs::create_dir_all(place.parent().unwrap_or(new))?;
                std::fs::hard_link(entry.path(), place)?;
            }
        }
    }
    Ok(())
}

/// Writes one file, with the permissions of its source.
fn put(content: &Content, place: &Path) -> io::Result<()> {
    if let Some(parent) = place.parent() {
        std::fs::create_dir_all(parent)?;
    }
    match content {
        Content::Copy(from) => std::fs::copy(from, place).map(drop),
        Content::List(text) => std::fs::write(place, text),
        Content::Script(text) => {
            std::fs::write(place, text)?;
            std::fs::set_permissions(place, std::fs::Permissions::from_mode(0o755))
        }
    }
}

/// The files that the configuration of a component names. `None` after an error in it.
fn files_of_configuration(
    project: &Project,
    sources: &mut SourceMap,
    loader: &FileLoader,
    found: &mut Diagnostics,
) -> Result<Option<Vec<PathBuf>>, Error> {
    // A network of this component alone: that it lacks peers does not matter here.
    let file = project.path.file_name().and_then(|name| name.to_str());
    let Some(file) = file.filter(|file| !file.contains(['"', '\\'])) else {
        let path = project.path.display();
        return Err(Error::Workspace(format!(
            "{path} has a name that a network cannot contain"
        )));
    };
    let path = project.folder().join("installation.ddsl");
    let text = format!("Deployment installation {{ Component one {{ cdsl \"{file}\"; }}; }};");
    let source = sources.add(&path, text);
    let (deployment, _) = rc_ddsl::load(sources, loader, source);
    let Some(deployment) = deployment else {
        return Ok(Some(Vec::new()));
    };
    let mut reading = Reading::new(&path, deployment);
    while reading.read_next(sources, loader) {}
    let (network, more) = reading.check(&Overrides::default(), sources, loader);
    // Other findings were added before, or are about this network.
    let faults = more.into_iter().filter(|fault| {
        fault.severity == Severity::Error && sources.path(fault.span.source) != path
    });
    found.extend(faults);
    if found.has_errors() {
        return Ok(None);
    }
    let config = project.code().join("etc/config.toml");
    let config = Some(config.as_path()).filter(|config| config.is_file());
    let parameters = network.parameters.first();
    let named = parameters.map(|set| named_files(project, config, set, None));
    Ok(Some(named.unwrap_or_default()))
}
