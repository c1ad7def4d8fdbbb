//! A new component in a workspace.

use crate::cargo_workspace::Workspace;
use crate::cpp::print::FORM;
use crate::files::{Files, Owner};
use crate::load::FileLoader;
use crate::{generator, names, paths};
use rc_cdsl::ast::Clause;
use rc_cdsl::model::Role;
use rc_diagnostics::{SourceMap, Span};
use rc_idsl::ast::DeclKind;
use rc_syntax::Loader;
use rc_vocabulary::Language;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A component to be made.
#[derive(Clone, Debug, Default)]
pub struct NewComponent {
    /// Name of the component.
    pub name: String,
    /// Interfaces by their roles.
    pub slots: Vec<(Role, Vec<String>)>,
    /// Period of `compute()`; without one, that of new components.
    pub period: Option<Duration>,
    /// The language of its worker.
    pub language: Language,
    /// The description that it starts with.
    pub from: Option<PathBuf>,
}

/// The reason why there is no new component.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The request cannot be met; the text says what to do.
    #[error("{0}")]
    Refused(String),
    /// The system refused a file.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// The workspace of `folder`, if it is one for components.
pub fn workspace(folder: &Path) -> Result<Workspace, Error> {
    let make = "make one with `rcgen init FOLDER`";
    let Some(workspace) = Workspace::of(folder)? else {
        let message = format!("this folder is in no workspace; {make}, and work in it");
        return Err(Error::Refused(message));
    };
    if !workspace.has_framework() {
        let root = workspace.root().display();
        let message = format!(
            "the workspace {root} has no `rc-runtime` in [workspace.dependencies]; {make}, and copy these lines"
        );
        return Err(Error::Refused(message));
    }
    Ok(workspace)
}

/// Programs next to those of components in a shared target folder, and in the PATH.
const TOOLS: [&str; 4] = ["rcgen", "rcview", "rcfoxglove", "rcforward"];

/// The component of the framework with this name, if the workspace builds into the framework's
/// target folder. Either would replace the program of the other.
fn beside_shared_target(root: &Path, name: &str) -> Option<PathBuf> {
    let settings = rc_files::read(&root.join(".cargo/config.toml")).ok()?;
    let settings: toml_edit::DocumentMut = settings.parse().ok()?;
    let target = settings.get("build")?.get("target-dir")?.as_str()?;
    let target = paths::normal(&root.join(target));
    let around = target.parent().filter(|around| *around != root)?;
    let component = around.join("components").join(name);
    let is_component = component.join(format!("{name}.cdsl")).is_file();
    is_component.then_some(component)
}

impl NewComponent {
    /// Folder, from the root of the workspace.
    pub fn folder(&self) -> PathBuf {
        Path::new("components").join(&self.name)
    }

    /// Descriptions, relative to the root of the workspace.
    pub fn files(&self, workspace: &Workspace, loader: &FileLoader) -> Result<Files, Error> {
        let name = &self.name;
        let is_package = self.language.is_built_by_cargo();
        let named = (generator::of(self.language).name)(name);
        let cannot = |reason: &str| {
            Error::Refused(format!("a component cannot be called `{name}`: {reason}"))
        };
        named.map_err(cannot)?;
        if name == "rcdeploy" {
            return Err(cannot("rcdeploy has sockets and logs of this name"));
        }
        if TOOLS.contains(&name.as_str()) {
            return Err(cannot("a program of RoboComp has this name"));
        }
        if let Some(other) = beside_shared_target(workspace.root(), name) {
            return Err(cannot(&format!(
                "{} has this name, and its program is in the same target folder",
                other.display()
            )));
        }
        let folder = self.folder();
        let there = workspace.root().join(&folder);
        if there.exists() {
            let message = format!("{} exists already", folder.display());
            return Err(Error::Refused(message));
        }
        if let Some(other) = workspace
            .package(&names::package(name))?
            .filter(|_| is_package)
        {
            let message = format!(
                "the workspace has a package `{name}` already: {}",
                other.display()
            );
            return Err(Error::Refused(message));
        }
        let mut files = Files::default();
        let cdsl = if let Some(from) = &self.from {
            self.renamed(from, &mut files)?
        } else {
            let pdsl = format!(
                "// What may be set in etc/config.toml: NAME TYPE [DEFAULT] [MIN:MAX] [unit \"…\"];\n\n\
                 ComponentParams {name}\n{{\n    // speed float 0.2 0:1 unit \"m/s\";\n}};\n"
            );
            let path = folder.join(format!("{name}.pdsl"));
            files.add(path, Owner::Specific, pdsl);
            self.written(&there, loader)?
        };
        let path = folder.join(format!("{name}.cdsl"));
        files.add(path, Owner::Specific, cdsl);
        Ok(files)
    }

    /// The description with these slots.
    fn written(&self, there: &Path, loader: &FileLoader) -> Result<String, Error> {
        let mut imports: Vec<String> = Vec::new();
        let mut slots = String::new();
        for (role, interfaces) in &self.slots {
            for interface in interfaces {
                let file = file_of(interface, there, loader)?;
                if !imports.contains(&file) {
                    imports.push(file);
                }
            }
            let names: Vec<&str> = interfaces.iter().map(|name| scoped(name).1).collect();
            slots.push_str(&format!("        {} {};\n", role.word(), names.join(", ")));
        }
        let imports: String = imports
            .iter()
            .map(|file| format!("import \"{file}\";\n"))
            .collect();
        let (head, slots) = if slots.is_empty() {
            let head = "// What this component communicates. Interfaces come from .idsl files: `import \"Laser.idsl\";`\n";
            let hints = "        // implements Speech;        answers calls\n        \
                         // requires Laser;           calls\n        \
                         // publishes LaserPub;       sends to all who listen\n        \
                         // subscribesTo LaserPub;    listens\n";
            (head.to_owned(), hints.to_owned())
        } else {
            (imports, slots)
        };
        let period = self.period.unwrap_or(Duration::from_millis(100));
        let period = rc_vocabulary::duration::text_of(period);
        let name = &self.name;
        Ok(format!(
            "{head}\nComponent {name}\n{{\n    Communications\n    {{\n{slots}    }};\n    \
             language {};\n    parameters \"{name}.pdsl\";\n    period {period};\n}};\n",
            self.language.word()
        ))
    }

    /// The language of an existing description; none if it names no known one.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn language_of(from: &Path) -> Result<Option<Language>, Error> {
        let text = rc_files::read(from).map_err(|error| paths::named(from, &error))?;
        let mut sources = SourceMap::new();
        let source = sources.add(from, &text);
        let (file, _) = rc_cdsl::parse(&sources, source);
        let clauses = file.component.into_iter().flat_map(|of| of.clauses);
        let mut words = clauses.filter_map(|(_, clause)| match clause {
            Clause::Language(word) => Some(word.text),
            _ => None,
        });
        Ok(words.find_map(|word| Language::from_file(&word)))
    }

    /// The text of an existing description, for a component of this name and language, and the
    /// files next to it that it names.
    fn renamed(&self, from: &Path, files: &mut Files) -> Result<String, Error> {
        if !self.slots.is_empty() || self.period.is_some() {
            let message = "--from takes slots and period from the file; change them there";
            return Err(Error::Refused(message.to_owned()));
        }
        let text = rc_files::read(from).map_err(|error| paths::named(from, &error))?;
        let mut sources = SourceMap::new();
        let source = sources.add(from, &text);
        let (file, _) = rc_cdsl::parse(&sources, source);
        let Some(component) = file.component else {
            let message = format!(
                "{} is not a description of a component: `rcgen check` says why",
                from.display()
            );
            return Err(Error::Refused(message));
        };
        let mut edits: Vec<(Span, &str)> = vec![(component.name.span, &self.name)];
        edits.extend(
            component
                .clauses
                .iter()
                .filter_map(|(_, clause)| match clause {
                    Clause::Language(language) => Some((language.span, self.language.word())),
                    _ => None,
                }),
        );
        let beside = component
            .clauses
            .iter()
            .filter_map(|(_, clause)| match clause {
                Clause::Parameters(file) | Clause::StateMachine(file, ..) => Some(&file.text),
                _ => None,
            });
        let imports = file.imports.iter().map(|import| &import.text);
        for file in beside.chain(imports) {
            // A path into another folder leads elsewhere from the new one, which rcgen reports.
            let is_beside = Path::new(file).components().count() == 1;
            let path = from.parent().unwrap_or(Path::new("")).join(file);
            if is_beside && path.is_file() {
                let text = rc_files::read(&path).map_err(|error| paths::named(&path, &error))?;
                files.add(self.folder().join(file), Owner::Specific, text);
            }
        }
        let is_window = |clause: &Clause| matches!(clause, Clause::Gui(..));
        let form = from.parent().unwrap_or(Path::new("")).join(FORM);
        if component.clauses.iter().any(|(_, of)| is_window(of)) && form.is_file() {
            let text = rc_files::read(&form).map_err(|error| paths::named(&form, &error))?;
            files.add(self.folder().join(FORM), Owner::Specific, text);
        }
        let mut out = text.clone();
        edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
        for (span, new) in edits {
            out.replace_range(span.start..span.end, new);
        }
        Ok(out)
    }
}

/// The manifest of the workspace with the component among its members, if it does not name it yet.
pub fn member(workspace: &Workspace, component: &NewComponent) -> std::io::Result<Files> {
    let mut files = Files::default();
    // Only packages of cargo are members.
    if component.language.is_built_by_cargo()
        && let Some((old, new)) = workspace.with_member(&component.folder())?
    {
        files.edit("Cargo.toml", old, new);
    }
    Ok(files)
}

/// The file that a component in the folder `there` imports for an interface, `Laser` or, where two
/// modules declare it, `RoboCompLaser::Laser`.
fn file_of(wanted: &str, there: &Path, loader: &FileLoader) -> Result<String, Error> {
    let from = there.join("new.cdsl");
    let known = loader.known(&from, "idsl");
    let (module, interface) = scoped(wanted);
    let usual = format!("{interface}.idsl");
    let mut declared = Vec::new();
    // The modules that declare it, each with its file.
    let mut found: Vec<(String, String)> = Vec::new();
    let files = known.iter().filter(|file| **file == usual);
    for file in files.chain(known.iter().filter(|file| **file != usual)) {
        let Ok(text) = loader.find(&from, file, "idsl") else {
            continue;
        };
        let mut sources = SourceMap::new();
        let source = sources.add(&text.path, text.text);
        let Some(tree) = rc_idsl::parse(&sources, source).0.module else {
            continue;
        };
        let name = tree.name.text;
        let decls = tree.decls.into_iter();
        let interfaces = decls.filter(|decl| matches!(decl.kind, DeclKind::Interface(_)));
        let names: Vec<String> = interfaces.map(|decl| decl.name.text).collect();
        let is_other = found.iter().all(|(other, _)| *other != name);
        if is_other && names.iter().any(|name| name == interface) {
            found.push((name, file.clone()));
        }
        declared.extend(names);
    }
    found.sort();
    match (found.as_slice(), module) {
        (_, Some(module)) if found.iter().any(|(name, _)| name == module) => {
            let mut chosen = found.into_iter().filter(|(name, _)| name == module);
            return Ok(chosen.next().map_or(usual, |(_, file)| file));
        }
        ([(_, file)], None) => return Ok(file.clone()),
        ([], _) => {}
        (all, _) => {
            let all = all.iter();
            let all = all.map(|(name, file)| format!("`{name}::{interface}` ({file})"));
            return Err(Error::Refused(format!(
                "which interface `{interface}`? There are {}; write one of these names",
                all.collect::<Vec<_>>().join(" and ")
            )));
        }
    }
    let near = rc_diagnostics::nearest(interface, declared.iter().map(String::as_str));
    let hint = near.map_or_else(
        || "declare it in a file of the folder `interfaces`".to_owned(),
        |near| format!("did you mean `{near}`?"),
    );
    Err(Error::Refused(format!(
        "unknown interface `{wanted}`; {hint}"
    )))
}

/// The module, if it is named, and the name of an interface.
fn scoped(interface: &str) -> (Option<&str>, &str) {
    match interface.split_once("::") {
        Some((module, name)) => (Some(module), name),
        None => (None, interface),
    }
}
