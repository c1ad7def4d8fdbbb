//! The results of `rcgen`, and its output meanwhile.

use crate::command_line::Common;
use rc_codegen::{FileLoader, Project};
pub(crate) use rc_diagnostics::print::{data as print, line as print_line};
pub(crate) use rc_diagnostics::print::{error as tell, findings as print_findings};
use rc_diagnostics::{Diagnostics, Format, Severity, SourceMap};
use std::path::Path;

/// The end of a run that was not successful.
pub(crate) enum Failure {
    /// The input is wrong; its findings are printed.
    Input,
    /// The command line is wrong.
    Usage(String),
    /// The system refused.
    System(String),
}

/// The system refused something.
pub(crate) fn system(error: impl std::fmt::Display) -> Failure {
    Failure::System(error.to_string())
}

/// The system refused something about a file.
pub(crate) fn refused(file: &Path, error: &std::io::Error) -> Failure {
    system(format_args!("{}: {error}", file.display()))
}

/// Creates a file that is not there yet; `else_name` is what to name instead. A dry run says so only.
pub(crate) fn create(
    path: &Path,
    content: &[u8],
    else_name: &str,
    dry_run: bool,
) -> Result<(), Failure> {
    refuse_existing(path, else_name)?;
    write(path, content, "create", dry_run)
}

/// Refuses to create a file that is there already.
pub(crate) fn refuse_existing(path: &Path, else_name: &str) -> Result<(), Failure> {
    if std::fs::symlink_metadata(path).is_ok() {
        let message = format!(
            "{} is there already; name another {else_name}",
            path.display()
        );
        return Err(Failure::Usage(message));
    }
    Ok(())
}

/// Writes a file, and says what happened to it.
pub(crate) fn write(path: &Path, content: &[u8], word: &str, dry_run: bool) -> Result<(), Failure> {
    if !dry_run {
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let made = folder.map_or(Ok(()), std::fs::create_dir_all);
        let written = made.and_then(|()| rc_files::write(path, content));
        written.map_err(|error| refused(path, &error))?;
    }
    print_line(format_args!("{word} {}", path.display()));
    Ok(())
}

/// A file that is not text is wrong input; anything else is the system's refusal.
pub(crate) fn unreadable(
    file: &Path,
    error: &std::io::Error,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
    refused: &mut Option<String>,
) {
    let bytes = (error.kind() == std::io::ErrorKind::InvalidData).then(|| std::fs::read(file));
    if let Some(Ok(bytes)) = bytes {
        found.push(rc_codegen::load::not_utf8(file, &bytes, sources));
    } else {
        let why = format!("{}: {error}", file.display());
        *refused = Some(match refused.take() {
            Some(before) => format!("{before}; {why}"),
            None => why,
        });
    }
}

/// Prints findings; an error among them is a failure.
pub(crate) fn report(
    sources: &SourceMap,
    found: &Diagnostics,
    format: Format,
) -> Result<(), Failure> {
    print_findings(sources, found, format);
    let sorted = found.sorted();
    let error = sorted.iter().find(|d| d.severity == Severity::Error);
    let Some(error) = error else { return Ok(()) };
    if format == Format::Human {
        tell(format_args!("`rcgen explain {}` says more", error.code));
    }
    Err(Failure::Input)
}

/// Reads a component; an error among the findings is reported, and ends the run.
pub(crate) fn load(
    file: &Path,
    common: &Common,
    sources: &mut SourceMap,
) -> Result<(Project, Diagnostics), Failure> {
    let loader = FileLoader::new(&common.include);
    let mut found = Diagnostics::new();
    if let Some(project) = try_load(file, &loader, sources, &mut found)? {
        return Ok((project, found));
    }
    report(sources, &found, common.format)?;
    Err(Failure::Input)
}

/// Reads a component; none where one of the findings that it adds is an error.
pub(crate) fn try_load(
    file: &Path,
    loader: &FileLoader,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Result<Option<Project>, Failure> {
    if file.extension().is_none_or(|e| e != "cdsl") {
        return Err(Failure::Usage(format!(
            "{} is not a .cdsl file",
            file.display()
        )));
    }
    match Project::load(file, sources, loader) {
        Ok((project, more)) => {
            let project = project.filter(|_| !more.has_errors());
            found.extend(more);
            Ok(project)
        }
        Err(error) => {
            let mut refused = None;
            unreadable(file, &error, sources, found, &mut refused);
            refused.map_or(Ok(None), |why| Err(Failure::System(why)))
        }
    }
}
