//! The check of one executable: whether it is the component that the network means, and can run
//! on its host.

use super::{has_all, hash, processor};
use rc_codegen::Project;
use rc_codegen::note::Note;
use rc_ddsl::model::{Instance, Processor};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_vocabulary::Middlewares;
use std::io;
use std::path::Path;

/// Checks one executable by its notes: one, or those of the components of a process.
pub(super) fn check(
    path: &Path,
    notes: &io::Result<Vec<Note>>,
    place: Span,
    (instance, needed, processor): (&Instance, Middlewares, Option<Processor>),
    project: &Project,
    build: &str,
    found: &mut Diagnostics,
) {
    let name = &instance.path;
    let component = &project.component.name.text;
    let own = notes.as_ref().map(|notes| {
        let own = notes.iter().find(|note| note.component == *component);
        own.or(notes.first())
    });
    let (code, message) = match own {
        Err(error) if error.kind() == io::ErrorKind::NotFound => (
            "missing-executable",
            format!(
                "the executable of `{name}`, {}, does not exist",
                path.display()
            ),
        ),
        Err(error) => (
            "missing-executable",
            format!("{} cannot be read: {error}", path.display()),
        ),
        Ok(None) => (
            "not-a-component",
            format!(
                "{} is not a component: it has no note of its model",
                path.display()
            ),
        ),
        Ok(Some(note)) if note.component != *component => match &instance.process {
            Some(process) => (
                "stale-executable",
                format!(
                    "{}, the program of the process `{}`, was built without `{component}`",
                    path.display(),
                    process.text
                ),
            ),
            None => (
                "other-component",
                format!(
                    "{} is the component `{}`, not `{component}`",
                    path.display(),
                    note.component
                ),
            ),
        },
        Ok(Some(note)) if note.model != hash(project) => (
            "stale-executable",
            format!(
                "the executable of `{name}` was generated from another version of {}",
                project.path.display()
            ),
        ),
        Ok(Some(note)) if !has_all(note, needed) => (
            "middleware-mismatch",
            format!(
                "the executable of `{name}` uses {}, the network {needed}",
                note.middleware,
            ),
        ),
        Ok(Some(_)) if processor::of(path) != processor::wanted(path, processor) => {
            let of = processor::of(path).map_or("no processor", processor::name);
            let wanted = processor::wanted(path, processor).map_or("another one", processor::name);
            let machine = if processor.is_some() {
                "its host"
            } else {
                "this machine"
            };
            let message = format!("{} is for {of}, and {machine} is {wanted}", path.display());
            let error = Diagnostic::error("wrong-processor", place, message);
            found.push(error.help(build));
            return;
        }
        Ok(Some(_)) if may_run(path) => return,
        Ok(Some(_)) => {
            let message = format!("{} may not be executed by anybody", path.display());
            let error = Diagnostic::error("not-executable", place, message);
            found.push(error.help(format!("`chmod +x {}`", path.display())));
            return;
        }
    };
    found.push(Diagnostic::error(code, place, message).help(build));
}

/// Whether a file is executable.
fn may_run(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    let mode = |file: std::fs::Metadata| file.permissions().mode();
    path.metadata().is_ok_and(|file| mode(file) & 0o111 != 0)
}
