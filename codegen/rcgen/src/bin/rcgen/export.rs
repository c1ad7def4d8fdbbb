//! `rcgen export`.

use crate::command_line::{Common, Target};
use crate::reports::{Failure, load, print_line, report, tell, unreadable};
use rc_codegen::files::Change;
use rc_codegen::{FileLoader, Files, export};
use rc_diagnostics::{Diagnostics, SourceMap};
use std::path::Path;

/// The source and the destination of an export.
#[derive(Clone, Copy)]
pub(crate) struct Request<'r> {
    pub(crate) target: Target,
    pub(crate) file: &'r Path,
    pub(crate) out: &'r Path,
    /// The domain of a graph of which a part is exported.
    pub(crate) domain: Option<&'r str>,
    pub(crate) common: &'r Common,
    /// Whether nothing is written.
    pub(crate) dry_run: bool,
}

/// Exports interfaces or a component.
pub(crate) fn export(request: &Request<'_>) -> Result<(), Failure> {
    let Request {
        target,
        file,
        out,
        domain: _,
        common,
        dry_run,
    } = *request;
    let is_component = file.extension().is_some_and(|e| e == "cdsl");
    if is_component && matches!(target, Target::Ros2) {
        return export_component(file, out, common, dry_run);
    }
    if file.extension().is_none_or(|e| e != "idsl") {
        let message = format!("{} is not an .idsl file", file.display());
        return Err(Failure::Usage(message));
    }
    let mut sources = SourceMap::new();
    let (mut found, mut refused) = (Diagnostics::new(), None);
    let loader = FileLoader::new(&common.include);
    let files = match export::load(file, &mut sources, &loader) {
        Ok((library, more)) => {
            found.extend(more);
            let right = Some(library).filter(|_| !found.has_errors());
            right.map(|library| {
                let (files, more) = match target {
                    Target::Ros2 => export::ros2(&library, &sources),
                    _ => export::dds(&library, &sources),
                };
                found.extend(more);
                files
            })
        }
        Err(error) => {
            unreadable(file, &error, &mut sources, &mut found, &mut refused);
            None
        }
    };
    if let Some(why) = refused {
        return Err(Failure::System(why));
    }
    report(&sources, &found, common.format)?;
    let Some(files) = files else {
        return Err(Failure::Input);
    };
    if files.iter().next().is_none() {
        let file = file.display();
        tell(format_args!("{file}: there is nothing to export in it"));
    }
    write(&files, out, dry_run)
}

/// Exports a component to a package of ROS 2.
fn export_component(
    file: &Path,
    out: &Path,
    common: &Common,
    dry_run: bool,
) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (project, mut found) = load(file, common, &mut sources)?;
    let (files, more) = export::component(&project).map_err(|e| Failure::System(e.to_string()))?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    write(&files, out, dry_run)
}

pub(crate) fn write(files: &Files, out: &Path, dry_run: bool) -> Result<(), Failure> {
    let system = |e: std::io::Error| Failure::System(e.to_string());
    let steps = files.plan(out).map_err(system)?;
    if let Some(foreign) =
        export::first_foreign_file(&steps, out, export::HEADER).map_err(system)?
    {
        return Err(Failure::Usage(format!(
            "{} is there, and was not written by an export; name another folder",
            foreign.display()
        )));
    }
    if !dry_run {
        files.write(out).map_err(system)?;
    }
    for step in steps.iter().filter(|s| s.change != Change::Keep) {
        let path = out.join(&step.path);
        print_line(format_args!("{} {}", step.change.word(), path.display()));
    }
    Ok(())
}
