//! The configuration of a component: its component, its mistakes, and how
//! it follows a `.pdsl` that has changed.

use crate::load;
use crate::project::Project;
use rc_cdsl::Component;
use rc_configuration::{Configuration, Parameters, Update};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::Loader;
use rc_vocabulary::member;
use std::io;
use std::path::{Path, PathBuf};

/// The configuration next to a `.cdsl`, if there is one.
pub fn own(cdsl: &Path) -> Option<PathBuf> {
    let path = cdsl.parent()?.join("etc/config.toml");
    let owner = owner(&path).ok()??;
    let same = owner.file_name() == cdsl.file_name();
    Some(path).filter(|path| same && path.exists())
}

/// The component whose `etc/` contains a configuration; a finding if there is none.
pub fn component(
    path: &Path,
    source: SourceId,
    found: &mut Diagnostics,
) -> io::Result<Option<PathBuf>> {
    let owner = owner(path)?;
    if owner.is_none() {
        let message =
            "no component owns this configuration: there is no .cdsl in the folder above its own";
        let span = Span::new(source, 0, 0);
        found.push(Diagnostic::error("no-component", span, message));
    }
    Ok(owner)
}

fn owner(path: &Path) -> io::Result<Option<PathBuf>> {
    let path = path.canonicalize()?;
    let folder = path.parent().and_then(Path::parent);
    let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok());
    let files = entries.into_iter().flatten().flatten().map(|e| e.path());
    Ok(files
        .filter(|path| path.extension().is_some_and(|e| e == "cdsl"))
        .min())
}

/// The text of a configuration that belongs to another file, which is the one that a command line
/// names; a finding where it is not text.
pub fn read(
    path: &Path,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<Option<String>> {
    match rc_files::read(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == io::ErrorKind::InvalidData => {
            let bytes = std::fs::read(path)?;
            found.push(load::not_utf8(path, &bytes, sources));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// All findings about a configuration, and the parameters that it leaves to defaults. Without a
/// project its description has errors.
pub fn check(sources: &SourceMap, source: SourceId, project: Option<&Project>) -> Vec<Diagnostic> {
    let parameters = project.and_then(|project| project.parameters.as_ref());
    let (configuration, mut found) = rc_configuration::check(sources, source, parameters);
    if let Some(project) = project {
        found.extend(unknown_slots(&configuration, &project.component));
    }
    // The declarations of a description with errors are not known; the framework's own keys are.
    let known = |d: &Diagnostic| project.is_some() || d.code != "unknown-parameter";
    let mut found: Vec<Diagnostic> = found.into_iter().filter(known).collect();
    if project.is_some()
        && let Ok(update) = rc_configuration::update(sources, source, parameters)
    {
        // A note shows lines, too.
        let secrets = found.first().map(|d| d.secrets.clone());
        found.extend(
            rc_configuration::unset_parameters(&update)
                .into_iter()
                .map(|mut note| {
                    note.secrets
                        .clone_from(secrets.as_ref().unwrap_or(&Vec::new()));
                    note
                }),
        );
    }
    found
}

/// Finds addresses under `[bindings]` for slots that the component does not have.
pub fn unknown_slots(configuration: &Configuration, component: &Component) -> Vec<Diagnostic> {
    // In a network, members are slots; a component alone knows its arrays only.
    let known = |name: &String| {
        let array = member::split(name).filter(|(_, of)| member::check(of).is_ok());
        let mut slots = component.slots.iter();
        slots.any(|slot| match array {
            Some((array, _)) if slot.is_array => slot.name == array,
            _ => !slot.is_array && slot.name == *name,
        })
    };
    let unknown = configuration
        .bindings
        .iter()
        .filter(|(slot, _)| !known(slot));
    let diagnostics = unknown.map(|(slot, binding)| {
        let name = &component.name.text;
        let message = format!("`{slot}` is not a slot of {name}");
        let error = Diagnostic::error("unknown-slot", binding.span, message);
        let mut arrays = component.slots.iter().filter(|of| of.is_array);
        if arrays.any(|of| of.name == *slot) {
            return error.help(format!(
                "it is an array; name a member: `\"{slot}.MEMBER\"`"
            ));
        }
        error.suggest(slot, component.slots.iter().map(|slot| slot.name.as_str()))
    });
    diagnostics.collect()
}

/// A configuration, and its planned changes.
#[derive(Debug)]
pub struct Updated {
    /// File of the configuration.
    pub path: PathBuf,
    /// Changes, and the whole new text.
    pub update: Update,
    text: String,
    /// Whether the component has secret parameters.
    has_secrets: bool,
}

impl Updated {
    /// Whether anything changes.
    pub fn differs(&self) -> bool {
        self.update.text != self.text
    }

    /// Replaces the old text by the new one, or writes nothing at all.
    pub fn write(&self) -> io::Result<()> {
        if self.differs() {
            if self.has_secrets {
                rc_files::replace_hidden(&self.path, &self.text, &self.update.text)?;
            } else {
                rc_files::replace(&self.path, &self.text, &self.update.text)?;
            }
        }
        Ok(())
    }
}

/// The planned changes of the configuration `path`, or of that of the component `path`. Nothing if
/// the findings prevent it. An error is a file that the system cannot read.
pub fn update(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<Option<Updated>> {
    let (cdsl, path) = match path.extension().and_then(|e| e.to_str()) {
        Some("cdsl") => {
            let Some(own) = own(path) else {
                let source = sources.add(path, rc_files::read(path)?);
                let message = "this component has no etc/config.toml yet: generate it first";
                let span = Span::new(source, 0, 0);
                found.push(Diagnostic::error("no-configuration", span, message));
                return Ok(None);
            };
            (path.to_path_buf(), own)
        }
        Some("toml") => {
            let source = sources.add(path, "");
            match component(path, source, found)? {
                Some(cdsl) => (cdsl, path.to_path_buf()),
                None => return Ok(None),
            }
        }
        _ => {
            let source = sources.add(path, "");
            let message = "this is neither a .cdsl nor a .toml file";
            let span = Span::new(source, 0, 0);
            found.push(Diagnostic::error("unknown-language", span, message));
            return Ok(None);
        }
    };
    let Some(text) = read(&path, sources, found)? else {
        return Ok(None);
    };
    let (project, more) = Project::load(&cdsl, sources, loader)?;
    let right = !more.has_errors();
    found.extend(more);
    let Some(project) = project.filter(|_| right) else {
        return Ok(None);
    };
    let source = sources.add(&path, text.clone());
    match rc_configuration::update(sources, source, project.parameters.as_ref()) {
        Ok(update) => {
            let parameters = project.parameters.as_ref();
            Ok(Some(Updated {
                path,
                update,
                text,
                has_secrets: parameters.is_some_and(Parameters::has_secrets),
            }))
        }
        Err(more) => {
            found.extend(more);
            Ok(None)
        }
    }
}
