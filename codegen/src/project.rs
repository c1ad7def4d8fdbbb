//! One component with everything that its `.cdsl` names.

use crate::cargo_workspace::Workspace;
use crate::files::GENERATED;
use crate::note::{self, Note};
use crate::origin::Origin;
use crate::world::{self, World};
use crate::{machine_names, names, packages, paths, ros, rust, viewer};
use rc_cdsl::Component;
use rc_cdsl::model::Middleware;
use rc_configuration::model::Parameters;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use rc_kinematics::Cell;
use rc_smdsl::StateMachine;
use rc_syntax::{Loader, Name, Trivia};
use rc_vocabulary::{Builder, Language};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A component that was loaded.
#[derive(Clone, Debug)]
pub struct Project {
    /// The `.cdsl` file.
    pub path: PathBuf,
    /// The component.
    pub component: Component,
    /// Parameters, where its `.cdsl` names a `.pdsl`.
    pub parameters: Option<Parameters>,
    /// Its robots, each with the name that the worker calls it.
    pub kinematics: Vec<(Name, Cell)>,
    /// The schema of its world, if it shares one.
    pub world: Option<World>,
    /// States, where its `.cdsl` names a `.smdsl` or `.scxml`.
    pub state_machine: Option<StateMachine>,
    /// The files of the modules that its imports reach, in the order of the library.
    pub origins: Vec<Origin>,
    /// Hash of all the description files that its generated code comes from, without comments and
    /// white space.
    pub hash: u64,
    /// Whether the file itself names C++, whatever an option of rcgen says.
    says_cpp: bool,
    /// The folder of its code, once it was looked for.
    code: OnceLock<PathBuf>,
}

/// The text of a component without the imports that say what its values mean: they are not part of
/// its code.
fn without_prototypes(component: &Component, text: &str) -> String {
    let mut out = text.to_owned();
    for import in component.prototype_imports.iter().rev() {
        let (start, end) = (import.span.start, import.span.end);
        let before = out.get(..start).and_then(|before| before.rfind("import"));
        let behind = out.get(end..).and_then(|behind| behind.find(';'));
        if let (Some(before), Some(behind)) = (before, behind) {
            out.replace_range(before..=end + behind, "");
        }
    }
    out
}

impl Project {
    /// Reads a component. There is one unless a file could not be read at all; it may be used only
    /// if no diagnostic is an error. An error is a `.cdsl` that the system cannot read.
    pub fn load(
        path: &Path,
        sources: &mut SourceMap,
        loader: &dyn Loader,
    ) -> Result<(Option<Self>, Diagnostics), std::io::Error> {
        Ok(Self::of_text(path, rc_files::read(path)?, sources, loader))
    }

    /// [`Project::load`] for a text that need not be in a file. `path` is the base of its imports.
    pub fn of_text(
        path: &Path,
        text: String,
        sources: &mut SourceMap,
        loader: &dyn Loader,
    ) -> (Option<Self>, Diagnostics) {
        let first = sources.ids().count();
        let source = sources.add(path, text);
        let (component, mut found) = rc_cdsl::load(sources, loader, source);
        let Some(mut component) = component else {
            return (None, found);
        };
        if let Some(language) = Language::from_file(&component.language.text) {
            packages::check(language, &component, &mut found);
        }
        if !found.has_errors() {
            found.extend(ros::annotations(&component.library));
            let mut slots = component.slots.iter();
            if slots.any(|slot| slot.backend == Some(Middleware::Ros2)) {
                found.extend(ros::refused(&component.library));
            }
        }
        let mut parameters = None;
        if let Some(file) = &component.parameters {
            let pdsl = beside(path, file);
            if let Some(text) = read(&pdsl, file, "parameters-not-found", &["pdsl"], &mut found) {
                let source = sources.add(paths::normal(&pdsl), text);
                let (loaded, more) = rc_pdsl::load(sources, loader, source);
                parameters = loaded;
                found.extend(more);
            }
        }
        viewer::check(&component, parameters.as_ref(), &mut found);
        let mut texts: Vec<String> = sources
            .ids()
            .skip(first)
            .map(|id| Trivia::new(sources.text(id)).significant())
            .collect();
        if let Some(first) = texts.first_mut() {
            *first =
                Trivia::new(&without_prototypes(&component, sources.text(source))).significant();
        }
        // The order in which imports are written changes nothing.
        texts[1..].sort();
        let before_machine = sources.ids().count();
        let state_machine = component
            .state_machine
            .as_ref()
            .and_then(|machine| state_machine(path, &machine.file, sources, &mut found));
        if let Some(machine) = &state_machine
            && !found.has_errors()
        {
            rust::state_names::check(machine, &mut found);
            machine_names::check(&component, machine, &mut found);
        }
        let kinematics = kinematics(path, &component, sources, loader, &mut found);
        let world = world::load(path, &component, sources, loader, &mut found);
        // XML has other comments, so its whole text counts.
        texts.extend(sources.ids().skip(before_machine).map(|id| {
            let text = sources.text(id);
            let ending = sources.path(id).extension();
            if ending.is_some_and(|ending| {
                ["scxml", "urdf"]
                    .iter()
                    .any(|xml| ending.eq_ignore_ascii_case(xml))
            }) {
                text.to_owned()
            } else {
                Trivia::new(text).significant()
            }
        }));
        let hash = rc_idsl::canonical::hash(&texts.join("\n"));
        let origins = Origin::all(&component.library, sources);
        // The meanings of values are not part of the code, so these files do not count.
        found.extend(rc_cdsl::meanings(&mut component, sources, loader, source));
        (
            Some(Self {
                says_cpp: Language::from_file(&component.language.text) == Some(Language::Cpp),
                path: path.to_path_buf(),
                origins,
                component,
                parameters,
                kinematics,
                world,
                state_machine,
                hash,
                code: OnceLock::new(),
            }),
            found,
        )
    }

    /// The language of its worker. A description of RoboComp for C++ whose worker was generated in
    /// Rust stays one in Rust.
    pub fn language(&self) -> Option<Language> {
        match self.named_language() {
            Some(Language::Cpp) if self.says_cpp && self.has_rust() => Some(Language::Rust),
            language => language,
        }
    }

    /// The language that its file names.
    fn named_language(&self) -> Option<Language> {
        Language::from_file(&self.component.language.text)
    }

    /// Whether the folder of its code has generated code in Rust and no project of cmake.
    fn has_rust(&self) -> bool {
        let code = self.code();
        code.join(GENERATED).join(note::RUST_SOURCE).exists()
            && !code.join(Language::Cpp.manifest()).exists()
    }

    /// The name of its manifest.
    pub fn manifest(&self) -> &'static str {
        self.language().unwrap_or(Language::Rust).manifest()
    }

    /// How its program comes about. A component in an unknown language counts as one in Rust.
    pub fn builder(&self) -> Builder {
        self.language().unwrap_or_default().builder()
    }

    /// Whether cargo builds it.
    pub fn is_built_by_cargo(&self) -> bool {
        self.builder() == Builder::Cargo
    }

    /// The oldest version of Python that a component in Python runs on.
    pub fn oldest_python(&self) -> (u32, u32) {
        let own = self.component.python.map(|python| python.oldest);
        own.unwrap_or(rc_cdsl::model::OLDEST_PYTHON)
    }

    /// Whether the code that was generated for it last is that of a node of ROS 2, also where no
    /// slot of it says so.
    pub fn is_node(&self) -> bool {
        let note = Note::of_generated(self.code());
        note.is_ok_and(|note| note.is_some_and(|note| note.middleware == Middleware::Ros2.word()))
    }

    /// The folder of its code: that of the `.cdsl` file, or the one that `rcgen --out` generated it
    /// into, which is the package of its name in the workspace.
    pub fn code(&self) -> &Path {
        self.code.get_or_init(|| {
            let own = self.folder();
            let manifest = self.named_language().unwrap_or(Language::Rust).manifest();
            let elsewhere = (!own.join(manifest).exists()).then(|| self.package());
            elsewhere.flatten().unwrap_or_else(|| own.to_path_buf())
        })
    }

    /// The folder of its package, if the workspace has one with code of this component.
    fn package(&self) -> Option<PathBuf> {
        let workspace = Workspace::of(self.folder()).ok()??;
        let name = &self.component.name.text;
        let folder = workspace.package(&names::package(name)).ok()??;
        let folder = workspace.root().join(folder);
        let note = Note::of_generated(&folder).ok()??;
        (note.component == *name).then_some(folder)
    }

    /// The folder of the `.cdsl` file.
    pub fn folder(&self) -> &Path {
        match self.path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        }
    }
}

/// The path of a file that a `.cdsl` names.
fn beside(cdsl: &Path, file: &Name) -> PathBuf {
    cdsl.parent().unwrap_or(Path::new("")).join(&file.text)
}

/// Reads the state machine that a `.cdsl` names.
fn state_machine(
    cdsl: &Path,
    file: &Name,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Option<StateMachine> {
    let path = beside(cdsl, file);
    let endings = ["smdsl", "scxml"];
    let text = read(&path, file, "statemachine-not-found", &endings, found)?;
    let source = sources.add(path, text);
    let (machine, more) = rc_smdsl::load(sources, source);
    found.extend(more);
    machine
}

/// Reads the robots that a `.cdsl` names.
fn kinematics(
    cdsl: &Path,
    component: &Component,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> Vec<(Name, Cell)> {
    let mut all = Vec::new();
    for (file, name) in &component.kinematics {
        let path = beside(cdsl, file);
        let Some(text) = read(&path, file, "kinematics-not-found", &["kdsl"], found) else {
            continue;
        };
        let source = sources.add(paths::normal(&path), text);
        let (cell, more) = rc_kinematics::load(sources, loader, source);
        found.extend(more);
        all.extend(cell.map(|cell| (name.clone(), cell)));
    }
    all
}

/// The text of a file that a `.cdsl` names, or a finding with the nearest file of these extensions
/// in its folder.
fn read(
    path: &Path,
    file: &Name,
    code: &'static str,
    endings: &[&str],
    found: &mut Diagnostics,
) -> Option<String> {
    let error = match rc_files::read(path) {
        Ok(text) => return Some(text),
        Err(error) => error,
    };
    if error.kind() != ErrorKind::NotFound {
        let message = format!("`{}` cannot be read: {error}", file.text);
        found.push(Diagnostic::error(code, file.span, message));
        return None;
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let message = format!(
        "cannot find `{}`; searched in {}",
        file.text,
        folder.display()
    );
    let diagnostic = Diagnostic::error(code, file.span, message);
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let known = |path: &PathBuf| {
        let ending = path.extension().and_then(|e| e.to_str());
        ending.is_some_and(|ending| endings.contains(&ending))
    };
    let names: Vec<String> = entries
        .map(|e| e.path())
        .filter(known)
        .filter_map(|p| Some(p.file_name()?.to_string_lossy().into_owned()))
        .collect();
    let wanted = path.file_name().unwrap_or_default().to_string_lossy();
    let near = rc_diagnostics::nearest(&wanted, names.iter().map(String::as_str));
    found.push(match near {
        Some(_) => diagnostic.did_you_mean(&wanted, near),
        None => diagnostic.help("the path is relative to the .cdsl file"),
    });
    None
}
