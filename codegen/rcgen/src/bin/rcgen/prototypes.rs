//! `rcgen convert`, and `rcgen view` of data prototypes.

use crate::command_line::{Common, PrintedLanguage};
use crate::reports::{Failure, print, report, unreadable};
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use rc_plans::{Network, Refusal};
use rc_prototypes::model::Library;
use std::path::{Path, PathBuf};

pub(crate) fn view(file: &Path, common: &Common) -> Result<(), Failure> {
    let (library, ..) = library(&[file.to_path_buf()], common)?;
    let json = serde_json::to_string_pretty(&library);
    print(&json.map_err(|e| Failure::System(e.to_string()))?);
    print("\n");
    Ok(())
}

/// Prints the plan from one prototype to another one, or its function.
pub(crate) fn convert(
    from: &str,
    to: &str,
    files: &[PathBuf],
    common: &Common,
    language: Option<PrintedLanguage>,
) -> Result<(), Failure> {
    let (mut library, sources, mut found) = library(files, common)?;
    for name in [from, to] {
        if library.prototype(name).is_none() {
            return Err(unknown(name, &library));
        }
    }
    let note = of_element(&library, from, to);
    if note.is_some() {
        library = library.of_elements();
    }
    let plan = match Network::new(&library).plan(from, to) {
        Ok(mut plan) => {
            plan.notes.extend(note);
            plan
        }
        Err(refusal) => {
            found.extend(refused(&refusal, from, to, &library));
            return report(&sources, &found, common.format);
        }
    };
    print(&match language {
        None => plan.to_string(),
        Some(PrintedLanguage::Rust) => rc_plans::rust(&plan),
        Some(PrintedLanguage::C) => rc_plans::c(&plan),
        Some(PrintedLanguage::Python) => rc_plans::python(&plan),
    });
    Ok(())
}

/// A note for two prototypes of which one holds a sequence: the plan is about one of its elements, as
/// in connections.
fn of_element(library: &Library, from: &str, to: &str) -> Option<String> {
    let sequence = |name| library.prototype(name)?.sequence.clone();
    let ((member, whole), value) = match (sequence(from), sequence(to)) {
        (Some(member), None) => ((member, from), to),
        (None, Some(member)) => ((member, to), from),
        _ => return None,
    };
    Some(format!(
        "an element of `{member}` of `{whole}` is one `{value}`"
    ))
}

fn unknown(name: &str, library: &Library) -> Failure {
    let names: Vec<String> = library
        .prototypes
        .iter()
        .map(|prototype| format!("`{}`", prototype.name))
        .collect();
    let known = if names.is_empty() {
        "the files have none".to_owned()
    } else {
        format!("there are {}", names.join(", "))
    };
    Failure::Usage(format!("there is no prototype `{name}`; {known}"))
}

/// The finding about two prototypes, at both of them.
fn refused(refusal: &Refusal, from: &str, to: &str, library: &Library) -> Option<Diagnostic> {
    let (one, other) = (library.prototype(from)?, library.prototype(to)?);
    let message = format!("`{from}` does not convert into `{to}`: {refusal}");
    let diagnostic = Diagnostic::error(refusal.code(), other.span, message);
    Some(diagnostic.label(one.span, "converted from this one"))
}

/// The prototypes of files. Their errors are reported.
fn library(
    files: &[PathBuf],
    common: &Common,
) -> Result<(Library, SourceMap, Diagnostics), Failure> {
    let (mut sources, mut found) = (SourceMap::new(), Diagnostics::new());
    let loader = FileLoader::new(&common.include);
    let (mut texts, mut refused) = (Vec::new(), None);
    for file in files {
        match rc_files::read(file) {
            Ok(text) => texts.push(sources.add(file, text)),
            Err(error) => unreadable(file, &error, &mut sources, &mut found, &mut refused),
        }
    }
    let (library, more) = rc_prototypes::load(&mut sources, &loader, &texts);
    found.extend(more);
    let printed = report(&sources, &found, common.format);
    if let Some(refused) = refused {
        return Err(Failure::System(refused));
    }
    printed?;
    Ok((library, sources, Diagnostics::new()))
}
