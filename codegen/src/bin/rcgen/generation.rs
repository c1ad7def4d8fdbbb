//! `rcgen FILE.cdsl` and `rcgen FOLDER`.

use crate::command_line::Generate;
use crate::reports::{Failure, print_line, report, tell, try_load};
use rc_cdsl::model::Backend;
use rc_codegen::cargo_workspace::{self, Workspace};
use rc_codegen::files::{Change, Owner, Step};
use rc_codegen::generation::{self, Component, Part};
use rc_codegen::interface_crate::{self, InterfaceCrate};
use rc_codegen::note::Note;
use rc_codegen::view::BACKENDS;
use rc_codegen::{FileLoader, Project, languages, stubs};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Components that share a crate of interfaces.
struct Group {
    interfaces: InterfaceCrate,
    files: Vec<PathBuf>,
    /// Whether the whole workspace was named.
    whole: bool,
}

pub(crate) fn run(args: &Generate) -> Result<(), Failure> {
    let alone = matches!(&args.files[..], [file] if !file.is_dir());
    if args.files.is_empty() {
        return Err(Failure::Usage(
            "name a .cdsl file, or the folder of a workspace; see --help".to_owned(),
        ));
    }
    if args.out.is_some() && !alone {
        return Err(Failure::Usage("--out is for one component".to_owned()));
    }
    let mut outcome = Ok(());
    for group in groups(args)?.into_values() {
        match group.generate(args, alone) {
            Err(Failure::Input) => outcome = Err(Failure::Input),
            other => other?,
        }
    }
    if args.check && matches!(outcome, Err(Failure::Input)) {
        let names: Vec<String> = args.files.iter().map(|f| f.display().to_string()).collect();
        tell(format_args!(
            "generate it anew: rcgen {}\n",
            names.join(" ")
        ));
    }
    outcome
}

fn system(error: impl std::fmt::Display) -> Failure {
    Failure::System(error.to_string())
}

/// A manifest that is not TOML is wrong input of the user, not a refusal of the system.
fn manifest(error: std::io::Error) -> Failure {
    if error.kind() == std::io::ErrorKind::InvalidInput {
        tell(format_args!("rcgen: error: {error}\n"));
        return Failure::Input;
    }
    system(error)
}

/// What the command line names, by the root that components share.
fn groups(args: &Generate) -> Result<BTreeMap<PathBuf, Group>, Failure> {
    let mut groups: BTreeMap<PathBuf, Group> = BTreeMap::new();
    let mut add = |interfaces: InterfaceCrate, files: Vec<PathBuf>, whole: bool| {
        let group = groups
            .entry(interfaces.root().to_path_buf())
            .or_insert_with(|| Group {
                interfaces,
                files: Vec::new(),
                whole: false,
            });
        group.whole |= whole;
        for file in files {
            if !group.files.contains(&file) {
                group.files.push(file);
            }
        }
    };
    for path in &args.files {
        if !path.is_dir() {
            let folder = folder_of(path, args);
            let interfaces = InterfaceCrate::of(&folder).map_err(manifest)?;
            add(interfaces, vec![path.clone()], false);
            continue;
        }
        let workspace = Workspace::of(path).map_err(manifest)?;
        let real = path.canonicalize().map_err(system)?;
        let whole = workspace.as_ref().is_some_and(|of| of.root() == real);
        let files = if let Some(workspace) = &workspace {
            let (files, strangers) = workspace.components(path).map_err(manifest)?;
            for file in strangers {
                let folder = folder_of(&file, args);
                tell(format_args!(
                    "{} is not a member of the workspace; add it to `members`\n",
                    folder.display()
                ));
            }
            files
        } else {
            let is_component = |path: &Path| path.extension().is_some_and(|e| e == "cdsl");
            languages::files(std::slice::from_ref(path), &is_component).map_err(system)?
        };
        if files.is_empty() && !whole {
            let path = path.display();
            return Err(Failure::Usage(format!("{path} holds no component")));
        }
        match workspace {
            Some(workspace) => add(InterfaceCrate::in_workspace(workspace), files, whole),
            None => {
                for file in files {
                    let folder = folder_of(&file, args);
                    let interfaces = InterfaceCrate::of(&folder).map_err(manifest)?;
                    add(interfaces, vec![file], false);
                }
            }
        }
    }
    for group in groups.values_mut() {
        group.one_component_a_folder(args)?;
    }
    Ok(groups)
}

/// The folder that a component is generated into.
fn folder_of(file: &Path, args: &Generate) -> PathBuf {
    match (&args.out, file.parent()) {
        (Some(out), _) => out.clone(),
        (None, Some(parent)) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        (None, _) => PathBuf::from("."),
    }
}

impl Group {
    /// Drops files that are named twice.
    ///
    /// # Errors
    /// Two components, or a component and the interfaces, would be generated into one folder.
    fn one_component_a_folder(&mut self, args: &Generate) -> Result<(), Failure> {
        let absolute = |path: &Path| cargo_workspace::absolute(path).map_err(system);
        let interfaces = absolute(self.interfaces.folder())?;
        let mut kept: BTreeMap<PathBuf, (PathBuf, PathBuf)> = BTreeMap::new();
        let mut files = Vec::new();
        for file in std::mem::take(&mut self.files) {
            let (real, folder) = (absolute(&file)?, absolute(&folder_of(&file, args))?);
            if folder == interfaces {
                let (file, folder) = (file.display(), folder.display());
                let message = format!(
                    "{file}: a component cannot be in the folder of the interfaces, {folder}"
                );
                return Err(Failure::Usage(message));
            }
            match kept.get(&folder) {
                Some((other, _)) if *other == real => continue,
                Some((_, other)) => {
                    let (other, file) = (other.display(), file.display());
                    let message = format!(
                        "{other} and {file} are in one folder; a folder holds one component"
                    );
                    return Err(Failure::Usage(message));
                }
                None => {}
            }
            kept.insert(folder, (real, file.clone()));
            files.push(file);
        }
        self.files = files;
        Ok(())
    }

    fn generate(self, args: &Generate, alone: bool) -> Result<(), Failure> {
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let loader = FileLoader::new(&args.common.include);
        let (mut projects, mut components) = (Vec::new(), Vec::new());
        let mut skipped = Vec::new();
        for file in &self.files {
            match self.component(file, args, alone, &loader, &mut sources, &mut found) {
                Ok(Some((project, component))) => {
                    projects.push(project);
                    components.push(component);
                }
                Ok(None) => skipped.push(file),
                Err(error) => {
                    let _ = report(&sources, &found, args.common.format);
                    return Err(error);
                }
            }
        }
        let mut own = Vec::new();
        let mut faulty = !skipped.is_empty();
        if self.whole {
            let (definitions, wrong) = self
                .interfaces
                .own(&mut sources, &loader, &mut found)
                .map_err(system)?;
            own = definitions;
            faulty |= wrong;
        }
        if alone && faulty {
            report(&sources, &found, args.common.format)?;
            return Err(Failure::Input);
        }
        let dry = args.dry_run || args.check;
        let lock = (!dry).then(|| self.interfaces.lock());
        let _lock = lock.transpose().map_err(system)?;
        // What a component with errors used before stays. A component in no workspace shares its
        // crate with none.
        let whole = self.whole || self.interfaces.workspace().is_none();
        let exact = whole && !faulty;
        let parts = generation::parts(
            &self.interfaces,
            &components,
            own,
            exact,
            &mut sources,
            &loader,
            &mut found,
        );
        let parts = match parts {
            Ok(parts) => parts,
            Err(error) => {
                let _ = report(&sources, &found, args.common.format);
                return Err(match error {
                    interface_crate::Error::Io(error) => manifest(error),
                    interface_crate::Error::Template(error) => system(error),
                });
            }
        };
        let reported = report(&sources, &found, args.common.format);
        for file in skipped {
            let file = file.display();
            tell(format_args!(
                "{file} is skipped: its files have errors; the interfaces that it used before stay\n"
            ));
        }
        let Some(parts) = parts else {
            return reported;
        };
        if dry {
            let steps = generation::plan(&parts).map_err(system)?;
            let fresh = self.list(&parts, &steps, &projects, args, alone)?;
            return reported.and(fresh);
        }
        let steps = generation::write(&parts).map_err(system)?;
        for (part, steps) in parts.iter().zip(&steps) {
            let folder = match part.component {
                Some(_) => part.folder.clone(),
                None => shown(&part.folder),
            };
            for step in steps.iter().filter(|s| s.change != Change::Keep) {
                let path = folder.join(&step.path);
                print_line(format_args!("{} {}", step.change.word(), path.display()));
            }
        }
        for (part, steps) in parts.iter().zip(&steps) {
            if let Some(at) = part.component
                && handlers_changed(steps)
            {
                let (project, folder) = (&projects[at], &part.folder);
                say_what_is_missing(project, folder, &mut sources, args.common.format);
            }
            if let Some(at) = part.component
                && !components[at].is_library
            {
                let file = projects[at].path.display();
                tell(format_args!(
                    "{file}: the component has no src/lib.rs; `rcgen stubs {file}` prints it\n"
                ));
            }
        }
        reported
    }

    /// Reads and prints one component; none where there are errors in it.
    fn component(
        &self,
        file: &Path,
        args: &Generate,
        alone: bool,
        loader: &FileLoader,
        sources: &mut SourceMap,
        found: &mut Diagnostics,
    ) -> Result<Option<(Project, Component)>, Failure> {
        let Some(mut project) = try_load(file, loader, sources, found)? else {
            return Ok(None);
        };
        if let Some(language) = &args.language {
            project.component.language.text.clone_from(language);
        }
        let folder = folder_of(file, args);
        let before = || {
            let note = Note::of_generated(&folder).ok().flatten()?;
            BACKENDS.into_iter().find(|b| b.word() == note.middleware)
        };
        let middleware = args
            .middleware
            .or_else(|| if alone { None } else { before() })
            .unwrap_or(Backend::Iceoryx2);
        let (component, more) =
            Component::of(&project, folder, middleware, &self.interfaces).map_err(system)?;
        found.extend(more);
        Ok(component.map(|component| (project, component)))
    }

    /// Lists what would be done, or with `--check` what is not up to date.
    fn list(
        &self,
        parts: &[Part],
        steps: &[Vec<Step>],
        projects: &[Project],
        args: &Generate,
        alone: bool,
    ) -> Result<Result<(), Failure>, Failure> {
        let mut fresh = Ok(());
        for (part, steps) in parts.iter().zip(steps) {
            // The paths of one component are relative to its folder.
            let folder = match part.component {
                Some(_) if alone => PathBuf::new(),
                Some(_) => part.folder.clone(),
                None if alone => self
                    .interfaces
                    .from(&folder_of(&projects[0].path, args), &part.folder)
                    .map_err(system)?,
                None => shown(&part.folder),
            };
            for step in steps {
                let path = folder.join(&step.path);
                let (path, change) = (path.display(), step.change.word());
                if !args.check {
                    let owner = if step.owner == Owner::Generic {
                        "generic"
                    } else {
                        "specific"
                    };
                    print_line(format_args!("{owner:<8} {change:<6} {path}"));
                } else if step.owner != Owner::Specific && step.change != Change::Keep {
                    let of = match part.component {
                        Some(at) => projects[at].path.clone(),
                        None if alone => projects[0].path.clone(),
                        None => PathBuf::from("the workspace"),
                    };
                    let of = of.display();
                    tell(format_args!("{of} is not up to date: {change} {path}\n"));
                    fresh = Err(Failure::Input);
                }
            }
        }
        Ok(fresh)
    }
}

/// An absolute path, from the current folder if it is below it.
fn shown(path: &Path) -> PathBuf {
    let here = std::env::current_dir().unwrap_or_default();
    path.strip_prefix(&here).unwrap_or(path).to_path_buf()
}

/// Whether traits of handlers have changed, of a worker that was there before.
fn handlers_changed(steps: &[Step]) -> bool {
    let is_trait = |s: &Step| s.path.starts_with("generated/src/slots");
    let is_worker = |s: &Step| s.owner == Owner::Specific && s.path.ends_with("specific_worker.rs");
    let kept = |s: &Step| s.change == Change::Keep;
    steps.iter().any(|s| is_trait(s) && !kept(s)) && steps.iter().any(|s| is_worker(s) && kept(s))
}

/// Reports what the user's worker lacks now. Where it cannot be read, the compiler reports it.
fn say_what_is_missing(project: &Project, folder: &Path, sources: &mut SourceMap, format: Format) {
    if let Ok((Some(missing), mut found)) = stubs::of(project, folder, sources) {
        found.extend(missing.notes(project));
        tell(format_args!("{}", render(sources, &found, format)));
    }
}
