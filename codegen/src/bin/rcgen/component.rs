//! `rcgen stubs` and `rcgen view`, about one component.

use crate::command_line::Common;
use crate::reports::{Failure, load, print, report, tell};
use rc_cdsl::model::Backend;
use rc_codegen::{generate, stubs};
use rc_diagnostics::{Format, SourceMap};
use std::path::{Path, PathBuf};

pub(crate) fn print_view(file: &Path, common: &Common, middleware: Backend) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (mut project, mut found) = load(file, common, &mut sources)?;
    // The view is the same for every language.
    "rust".clone_into(&mut project.component.language.text);
    let (json, more) =
        generate::view(&project, middleware).map_err(|e| Failure::System(e.to_string()))?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    print(&json);
    Ok(())
}

pub(crate) fn print_stubs(
    file: &Path,
    common: &Common,
    out: Option<PathBuf>,
) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (mut project, mut found) = load(file, common, &mut sources)?;
    // Whatever the file says: the handlers that are there are Rust.
    "rust".clone_into(&mut project.component.language.text);
    let system = |e: stubs::Error| Failure::System(e.to_string());
    let folder = out.unwrap_or_else(|| project.folder().to_path_buf());
    let (missing, more) = stubs::of(&project, &folder, &mut sources).map_err(system)?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    let Some(missing) = missing else {
        return Err(Failure::Input);
    };
    if !missing.is_empty() {
        print(&missing.text().map_err(system)?);
    } else if common.format != Format::Json {
        tell(format_args!(
            "{}: nothing is missing; handlers: {}\n",
            file.display(),
            missing.total()
        ));
    }
    Ok(())
}
