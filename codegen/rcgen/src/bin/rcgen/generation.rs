//! `rcgen generate`, `rcgen FILE.cdsl` and `rcgen FOLDER`.

use crate::command_line::{Cli, Generate};
use crate::reports::{Failure, print_findings, print_line, report, system, tell, try_load};
use clap::CommandFactory;
use rc_cdsl::model::Middleware;
use rc_codegen::cargo_workspace::Workspace;
use rc_codegen::files::{Change, Owner, Step};
use rc_codegen::generation::{self, Component, Part};
use rc_codegen::interface_crate::{self, InterfaceCrate};
use rc_codegen::note::Note;
use rc_codegen::{FileLoader, Project, copied, dependencies, parallel, paths, source_files, stubs};
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Components that share a crate of interfaces.
pub(crate) struct Group {
    pub(crate) interfaces: InterfaceCrate,
    pub(crate) files: Vec<PathBuf>,
    /// Whether the whole workspace was named.
    pub(crate) whole: bool,
}

/// Counts and findings of a generation.
#[derive(Default)]
struct Summary {
    components: usize,
    skipped: usize,
    created: usize,
    updated: usize,
    removed: usize,
    kept: usize,
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let many = if self.components == 1 { "" } else { "s" };
        write!(f, "generated {} component{many}", self.components)?;
        if self.skipped > 0 {
            write!(f, ", skipped {} with errors", self.skipped)?;
        }
        let counts = [
            (self.created, "created"),
            (self.updated, "updated"),
            (self.removed, "removed"),
            (self.kept, "unchanged"),
        ];
        let counts = counts.iter().filter(|(count, _)| *count > 0);
        let counts = counts.map(|(count, what)| format!("{count} {what}"));
        write!(f, "; files: {}", counts.collect::<Vec<_>>().join(", "))
    }
}

/// `rcgen generate`: the workspace of the current folder unless something is named, and a summary.
pub(crate) fn generate(mut args: Generate) -> Result<(), Failure> {
    args.files = here_or(args.files)?;
    let mut summary = Summary::default();
    let outcome = all(&args, &mut summary);
    if !args.dry_run
        && !args.check
        && !matches!(outcome, Err(Failure::Usage(_) | Failure::System(_)))
    {
        print_line(format_args!("{summary}"));
    }
    outcome
}

/// The paths, or the workspace of the current folder.
pub(crate) fn here_or(paths: Vec<PathBuf>) -> Result<Vec<PathBuf>, Failure> {
    if !paths.is_empty() {
        return Ok(paths);
    }
    let here = paths::absolute(Path::new(".")).map_err(system)?;
    let Some(workspace) = Workspace::of(&here).map_err(manifest)? else {
        return Err(Failure::Usage(
            "this folder is in no workspace; name a file or a folder, or make a workspace with `rcgen init FOLDER`"
                .to_owned(),
        ));
    };
    let root = paths::relative(&here, workspace.root());
    let is_here = root.as_os_str().is_empty();
    Ok(vec![if is_here { PathBuf::from(".") } else { root }])
}

/// `rcgen FILE.cdsl` and `rcgen FOLDER`.
pub(crate) fn run(args: &Generate) -> Result<(), Failure> {
    all(args, &mut Summary::default())
}

fn all(args: &Generate, summary: &mut Summary) -> Result<(), Failure> {
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
        match group.generate(args, alone, summary) {
            Err(Failure::Input) => outcome = Err(Failure::Input),
            other => other?,
        }
    }
    if args.check && matches!(outcome, Err(Failure::Input)) {
        let names: Vec<String> = args.files.iter().map(|f| f.display().to_string()).collect();
        tell(format_args!("generate it again: rcgen {}", names.join(" ")));
    }
    outcome
}

/// A manifest that is not TOML is wrong input of the user, not a refusal of the system.
pub(crate) fn manifest(error: std::io::Error) -> Failure {
    if error.kind() == std::io::ErrorKind::InvalidInput {
        tell(format_args!("rcgen: error: {error}"));
        return Failure::Input;
    }
    system(error)
}

/// Files and folders of the command line, grouped by the root that components share.
pub(crate) fn groups(args: &Generate) -> Result<BTreeMap<PathBuf, Group>, Failure> {
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
            known(path)?;
            let folder = folder_of(path, args);
            let interfaces = InterfaceCrate::of(&folder).map_err(manifest)?;
            add(interfaces, vec![path.clone()], false);
            continue;
        }
        let workspace = Workspace::of(path).map_err(manifest)?;
        let real = path.canonicalize().map_err(system)?;
        let whole = workspace.as_ref().is_some_and(|of| of.root() == real);
        let files = if let Some(workspace) = &workspace {
            let (files, unlisted) = workspace.components(path).map_err(manifest)?;
            for file in unlisted {
                let folder = folder_of(&file, args);
                tell(format_args!(
                    "{} is not a member of the workspace; add it to `members`",
                    folder.display()
                ));
            }
            files
        } else {
            let is_component = |path: &Path| path.extension().is_some_and(|e| e == "cdsl");
            source_files::files(std::slice::from_ref(path), &is_component).map_err(system)?
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

/// A word that is not a file is a mistyped command.
fn known(path: &Path) -> Result<(), Failure> {
    let is_word = path.components().count() == 1 && path.extension().is_none();
    if !is_word || path.exists() {
        return Ok(());
    }
    let cli = Cli::command();
    let commands = cli.get_subcommands().map(clap::Command::get_name);
    let word = path.to_string_lossy();
    let near = rc_diagnostics::nearest(&word, commands);
    let hint = near.map_or_else(
        || "`rcgen help` lists the commands".to_owned(),
        |near| format!("did you mean `rcgen {near}`?"),
    );
    Err(Failure::Usage(format!(
        "there is no command and no file `{word}`; {hint}"
    )))
}

/// The folder that a component is generated into.
pub(crate) fn folder_of(file: &Path, args: &Generate) -> PathBuf {
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
        let absolute = |path: &Path| paths::absolute(path).map_err(system);
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

    fn generate(self, args: &Generate, alone: bool, summary: &mut Summary) -> Result<(), Failure> {
        generation::prepare();
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let loader = FileLoader::new(&args.common.include);
        let (mut projects, mut components) = (Vec::new(), Vec::new());
        let (mut loaded, mut skipped) = (Vec::new(), Vec::new());
        for file in &self.files {
            match try_load(file, &loader, &mut sources, &mut found) {
                Ok(Some(project)) => loaded.push((file, project)),
                Ok(None) => skipped.push(file),
                Err(error) => {
                    let _ = report(&sources, &found, args.common.format);
                    return Err(error);
                }
            }
        }
        let read: Vec<&Project> = loaded.iter().map(|(_, project)| project).collect();
        copied::check(&read, &mut found).map_err(manifest)?;
        let print =
            |(file, project): &mut (&PathBuf, Project)| self.component(file, project, args, alone);
        let printed = parallel::map(&mut loaded, print);
        for ((file, project), printed) in loaded.into_iter().zip(printed) {
            let (component, more) = printed.map_err(system)?;
            found.extend(more);
            match component {
                Some(component) => {
                    projects.push(project);
                    components.push(component);
                }
                None => skipped.push(file),
            }
        }
        summary.components += components.len();
        summary.skipped += skipped.len();
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
        // The files of a component with errors stay. A component outside of a workspace shares
        // its crate with none.
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
                "{file} is skipped: its files have errors; the interfaces that it used before stay"
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
            for step in steps {
                *match step.change {
                    Change::Create => &mut summary.created,
                    Change::Update => &mut summary.updated,
                    Change::Remove => &mut summary.removed,
                    Change::Keep => &mut summary.kept,
                } += 1;
                if step.change != Change::Keep {
                    let path = folder.join(&step.path);
                    print_line(format_args!("{} {}", step.change.word(), path.display()));
                }
            }
        }
        for (part, steps) in parts.iter().zip(&steps) {
            if let Some(at) = part.component {
                let (project, format) = (&projects[at], args.common.format);
                let (file, has_changed) = (project.path.display(), handlers_changed(steps));
                if project.is_built_by_cargo() {
                    if has_changed {
                        say_what_is_missing(project, &part.folder, &mut sources, format);
                    }
                    // Where the worker cannot be read, the compiler reports it.
                    if let Ok(found) = stubs::unreachable(project, &mut sources) {
                        print_findings(&sources, &found, format);
                    }
                } else if has_changed {
                    tell(format_args!(
                        "{file}: the handlers changed; `rcgen stubs {file}` prints what the worker lacks"
                    ));
                }
            }
            if let Some(at) = part.component
                && !components[at].is_library
            {
                let file = projects[at].path.display();
                tell(format_args!(
                    "{file}: the component has no src/lib.rs; `rcgen stubs {file}` prints it"
                ));
            }
        }
        reported
    }

    /// Prints one component; none where there are errors in it.
    fn component(
        &self,
        file: &Path,
        project: &mut Project,
        args: &Generate,
        alone: bool,
    ) -> Result<(Option<Component>, Diagnostics), interface_crate::Error> {
        if let Some(language) = &args.language {
            project.component.language.text.clone_from(language);
        }
        let folder = folder_of(file, args);
        let own = project.folder().to_path_buf();
        dependencies::lead_from(&mut project.component, &own, &folder)?;
        let before = || {
            let note = Note::of_generated(&folder).ok().flatten()?;
            Middleware::from_word(&note.middleware)
        };
        let middleware = args
            .middleware
            .or_else(|| if alone { None } else { before() })
            .unwrap_or(Middleware::DEFAULT);
        Component::of(project, folder, middleware, &self.interfaces)
    }

    /// Lists the changes, or with `--check` the files that are not up to date.
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
                    tell(format_args!("{of} is not up to date: {change} {path}"));
                    fresh = Err(Failure::Input);
                }
            }
        }
        Ok(fresh)
    }
}

/// An absolute path as it leads from the current folder, unless that is somewhere else altogether.
pub(crate) fn shown(path: &Path) -> PathBuf {
    let here = std::env::current_dir().unwrap_or_default();
    let shared = here.iter().zip(path).take_while(|(a, b)| a == b).count();
    if shared > 2 || path.starts_with(&here) {
        paths::relative(&here, path)
    } else {
        path.to_path_buf()
    }
}

/// Whether traits of handlers may have changed, of a worker that was there before. The description
/// has the hash of the interfaces, whose traits are in a crate of their own.
fn handlers_changed(steps: &[Step]) -> bool {
    const TELLING: [&str; 3] = ["adapter.rs", "description.rs", "machine.rs"];
    let is_trait = |s: &Step| {
        let name = s.path.strip_prefix("generated/src").ok();
        name.is_some_and(|name| TELLING.iter().any(|telling| name == Path::new(telling)))
            || s.path.starts_with("generated")
                && (s.path.ends_with("worker.py") || s.path.ends_with("genericworker.h"))
    };
    let is_worker = |s: &Step| {
        const STEMS: [&str; 2] = ["specific_worker", "specificworker"];
        let stem = s.path.file_stem();
        s.owner == Owner::Specific && STEMS.iter().any(|name| stem == Some(name.as_ref()))
    };
    let kept = |s: &Step| s.change == Change::Keep;
    steps.iter().any(|s| is_trait(s) && !kept(s)) && steps.iter().any(|s| is_worker(s) && kept(s))
}

/// Reports what the user's worker lacks now. If it cannot be read, the compiler reports it.
fn say_what_is_missing(project: &Project, folder: &Path, sources: &mut SourceMap, format: Format) {
    if let Ok((Some(missing), mut found)) = stubs::of(project, folder, sources) {
        found.extend(missing.notes(project));
        print_findings(sources, &found, format);
    }
}
