//! Checks files of any of the languages, and configurations.

use crate::{graphs, innermodel};
use rc_cdsl::model::{Role, Slot};
use rc_codegen::{Project, configuration, generate, paths, ros, source_files};
use rc_ddsl::Deployment;
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceId, SourceMap, Span};
use rc_idsl::Session;
use rc_idsl::model::{Library, Operation};
use rc_smdsl::StateMachine;
use rc_syntax::Loader;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// The extensions of the files that are checked. Components come first, because they read the
/// others.
pub(crate) const ENDINGS: [&str; 14] = [
    "cdsl", "dproto", "idsl", "pdsl", "smdsl", "scxml", "ddsl", "gdsl", "kdsl", "ilk", "urdf",
    "graph", "xml", "toml",
];

/// The place of a file in the order of checks. None for one that is not checked.
fn rank(path: &Path) -> Option<usize> {
    let ending = path.extension().and_then(|e| e.to_str())?;
    // Other .toml files are other programs'.
    let in_etc = || path.parent().and_then(Path::file_name) == Some("etc".as_ref());
    let rank = ENDINGS.iter().position(|e| *e == ending);
    rank.filter(|_| ending != "toml" || in_etc())
}

/// Whether the check of a folder takes a file in it.
pub(crate) fn is_wanted(path: &Path) -> bool {
    rank(path).is_some() && innermodel::is_wanted(path)
}

/// Whether a file has one of the endings that are checked.
pub(crate) fn is_known(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str());
    ending.is_some_and(|ending| ENDINGS.contains(&ending))
}

/// Files to check: those of the command line as they are, and the description files of its folders,
/// components first.
pub fn files(
    paths: &[PathBuf],
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<Vec<PathBuf>> {
    let mut all: Vec<PathBuf> = Vec::new();
    let mut seen = BTreeSet::new();
    for path in paths {
        let files = source_files::files(std::slice::from_ref(path), &is_wanted)?;
        if files.is_empty() {
            let source = sources.add(path, "");
            let message = "there is nothing to check in this folder";
            let span = Span::new(source, 0, 0);
            found.push(Diagnostic::error("nothing-to-check", span, message));
        }
        let new = files.into_iter().filter(|file| {
            let real = file.canonicalize().unwrap_or_else(|_| file.clone());
            seen.insert(real)
        });
        all.extend(new);
    }
    all.sort_by_key(|path| rank(path));
    Ok(all)
}

/// Whether `path` was read, and so checked, with the component that it belongs to.
fn was_read(path: &Path, sources: &SourceMap) -> bool {
    let same = |other: &Path| {
        other.file_name() == path.file_name()
            && matches!((other.canonicalize(), path.canonicalize()), (Ok(a), Ok(b)) if a == b)
    };
    sources.ids().any(|id| same(sources.path(id)))
}

/// Turns the error that a subscribed operation returns a value into a warning: RoboComp generates
/// such components, and drops the value.
fn as_in_robocomp(project: &Project, found: Diagnostics) -> Diagnostics {
    let component = &project.component;
    let returns = |slot: &Slot| {
        let interface = component.library.interface(slot.interface);
        interface.operations.iter().any(Operation::has_result)
    };
    let slots = component.slots.iter();
    let subscribed: Vec<Span> = slots
        .filter(|slot| slot.role == Role::SubscribesTo && returns(slot))
        .map(|slot| slot.span)
        .collect();
    let is_of = |error: &Diagnostic, slot: &Span| {
        let span = &error.span;
        span.source == slot.source && slot.start <= span.start && span.end <= slot.end
    };
    let mut all = Diagnostics::new();
    for mut error in found {
        if error.code == "wrong-pattern" && subscribed.iter().any(|slot| is_of(&error, slot)) {
            error.severity = Severity::Warning;
        }
        all.push(error);
    }
    all
}

/// Files that components of this project have, and those of RoboComp do not.
const OURS: [&str; 4] = [
    "generated",
    "etc/config.toml",
    "Cargo.toml",
    "pyproject.toml",
];

/// Whether a file is a component of RoboComp from which nobody has generated anything: it names its
/// language as RoboComp does, `Cpp11` or `Python`, and has no file of this project beside it.
pub(crate) fn is_of_robocomp(path: &Path) -> bool {
    let folder = path.parent().unwrap_or(path);
    if path.extension().is_none_or(|ending| ending != "cdsl")
        || OURS.iter().any(|file| folder.join(file).exists())
    {
        return false;
    }
    let text = rc_files::read(path).unwrap_or_default();
    let tokens = rc_syntax::tokens(&text);
    let mut clauses = tokens.windows(2);
    clauses.any(|two| {
        let language = two[1].text;
        let known = ["Cpp", "CPP", "Python"].iter();
        two[0].text.eq_ignore_ascii_case("language")
            && known.clone().any(|word| language.starts_with(word))
    })
}

/// The findings of a component of RoboComp: an error is a note, because nobody needs the component
/// to be right here. A text that cannot be read is wrong there, too.
pub(crate) fn softened(found: Diagnostics) -> Diagnostics {
    let mut all = Diagnostics::new();
    for mut one in found {
        if one.severity == Severity::Error && one.code != "syntax-error" {
            one.severity = Severity::Note;
        }
        all.push(one);
    }
    all
}

/// Result of a check: the understood part of a file, also of one with errors.
#[derive(Debug)]
pub enum Model {
    /// A component.
    Component(Box<Project>),
    /// The modules of interfaces and types.
    Interfaces(Library),
    /// The text of parameters.
    Parameters(SourceId),
    /// A state machine.
    Machine(StateMachine),
    /// A network.
    Network(Box<Deployment>),
    /// The text of a configuration, and the component that it belongs to.
    Configuration(SourceId, PathBuf),
}

/// Adds all findings about `path` to `found`; `robocomp` says that the file is one of RoboComp.
/// Meshes and parts of an `InnerModel` file are also looked for in the folders `include`. Returns
/// what it understood, unless an earlier check read the file. An error is a file that the system
/// cannot read.
pub fn file(
    path: &Path,
    robocomp: bool,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    include: &[PathBuf],
    found: &mut Diagnostics,
) -> io::Result<Option<Model>> {
    let model = match path.extension().and_then(|e| e.to_str()) {
        Some("cdsl") => {
            let (project, mut more) = Project::load(path, sources, loader)?;
            if let Some(project) = project.as_ref().filter(|_| robocomp) {
                more = as_in_robocomp(project, more);
            }
            if let Some(node) = project.as_ref().filter(|project| project.is_node())
                && !more.has_errors()
            {
                more.extend(ros::refused(&node.component.library));
            }
            let right = !more.has_errors();
            found.extend(more);
            if let Some(project) = project.as_ref().filter(|_| right) {
                generate::check_worker(project, sources, found)?;
            }
            let own = configuration::own(path).filter(|own| !was_read(own, sources));
            if let (Some(right), Some(own)) = (project.as_ref().filter(|_| right), own)
                && let Some(text) = configuration::read(&own, sources, found)?
            {
                let source = sources.add(own, text);
                found.extend(configuration::check(sources, source, Some(right)));
            }
            project.map(|project| Model::Component(Box::new(project)))
        }
        Some("dproto" | "idsl" | "pdsl" | "smdsl" | "scxml" | "urdf" | "toml")
            if was_read(path, sources) =>
        {
            None
        }
        Some("idsl") => {
            let source = sources.add(path, rc_files::read(path)?);
            let mut session = Session::new(sources, loader);
            session.load_source(source, path);
            if !session.found.has_errors() {
                session.found.extend(ros::annotations(&session.library));
            }
            found.extend(session.found);
            Some(Model::Interfaces(session.library))
        }
        Some("pdsl") => {
            let source = sources.add(paths::normal(path), rc_files::read(path)?);
            found.extend(rc_pdsl::load(sources, loader, source).1);
            Some(Model::Parameters(source))
        }
        Some("smdsl" | "scxml") => {
            let source = sources.add(path, rc_files::read(path)?);
            let (machine, more) = rc_smdsl::load(sources, source);
            found.extend(more);
            machine.map(Model::Machine)
        }
        Some("ddsl") => {
            let source = sources.add(path, rc_files::read(path)?);
            let (network, more) = rc_ddsl::load(sources, loader, source);
            found.extend(more);
            network.map(|network| Model::Network(Box::new(network)))
        }
        Some("gdsl") => {
            // The files that a component has read have been checked, except their queries.
            let known = was_read(path, sources);
            graphs::check_schema(path, known, sources, loader, found)?;
            None
        }
        Some("dproto") => {
            let source = sources.add(path, rc_files::read(path)?);
            found.extend(rc_prototypes::load(sources, loader, &[source]).1);
            None
        }
        Some("graph" | "json") => {
            graphs::check(path, sources, loader, found)?;
            None
        }
        Some("kdsl" | "ilk") => {
            let source = sources.add(path, rc_files::read(path)?);
            found.extend(rc_kinematics::load(sources, loader, source).1);
            None
        }
        Some("urdf") => {
            let source = sources.add(path, rc_files::read(path)?);
            found.extend(rc_robot::read(sources, source).1);
            None
        }
        Some("xml") => {
            let source = sources.add(path, rc_files::read(path)?);
            found.extend(innermodel::check(sources, source, include));
            None
        }
        Some("toml") => {
            let source = sources.add(path, rc_files::read(path)?);
            let Some(cdsl) = configuration::component(path, source, found)? else {
                return Ok(None);
            };
            let known = was_read(&cdsl, sources);
            let (project, more) = Project::load(&cdsl, sources, loader)?;
            let right = !more.has_errors();
            if !known {
                found.extend(more);
            }
            let project = project.filter(|_| right);
            found.extend(configuration::check(sources, source, project.as_ref()));
            Some(Model::Configuration(source, cdsl))
        }
        _ if !path.exists() => return Err(paths::missing(path)),
        _ => {
            let source = sources.add(path, "");
            let message = "this is none of .idsl, .cdsl, .pdsl, .smdsl, .scxml, .ddsl, .gdsl, .dproto, .kdsl, .ilk, .urdf, .graph, .json, .xml and .toml";
            found.push(Diagnostic::error(
                "unknown-language",
                Span::new(source, 0, 0),
                message,
            ));
            None
        }
    };
    Ok(model)
}
