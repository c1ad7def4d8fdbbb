//! `rcgen stubs` and `rcgen view`, about one component.

use crate::command_line::Common;
use crate::generation::manifest;
use crate::reports::{Failure, load, print, report, tell};
use rc_cdsl::model::Middleware;
use rc_codegen::templates::TemplateError;
use rc_codegen::{Project, copied, generate, worker};
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use std::path::{Path, PathBuf};

pub(crate) fn print_view(
    file: &Path,
    common: &Common,
    middleware: Middleware,
) -> Result<(), Failure> {
    print(&described(file, common, |project| {
        // The view is the same for every language.
        "rust".clone_into(&mut project.component.language.text);
        generate::view(project, middleware)
    })?);
    Ok(())
}

/// Output of `describe` for a component. Reports all findings.
pub(crate) fn described(
    file: &Path,
    common: &Common,
    describe: impl FnOnce(&mut Project) -> Result<(String, Diagnostics), TemplateError>,
) -> Result<String, Failure> {
    let mut sources = SourceMap::new();
    let (mut project, mut found) = load(file, common, &mut sources)?;
    copied::check(&[&project], &mut found).map_err(manifest)?;
    let (text, more) = describe(&mut project).map_err(|e| Failure::System(e.to_string()))?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    Ok(text)
}

pub(crate) fn print_stubs(
    file: &Path,
    common: &Common,
    out: Option<PathBuf>,
) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (mut project, mut found) = load(file, common, &mut sources)?;
    let folder = out.unwrap_or_else(|| project.folder().to_path_buf());
    let language = project.language().unwrap_or_default();
    let compare = worker::stubs(&project);
    // Whatever the file says: the handlers that are there are in this language.
    language
        .word()
        .clone_into(&mut project.component.language.text);
    let compared = compare(&project, &folder, &mut sources);
    let (lacking, more) = compared.map_err(|error| Failure::System(error.to_string()))?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    let Some(lacking) = lacking else {
        return Err(Failure::Input);
    };
    print(&lacking.text);
    if lacking.text.is_empty() {
        if common.format != Format::Json {
            tell(format_args!(
                "{}: nothing is missing; handlers: {}",
                file.display(),
                lacking.total
            ));
        }
    } else if !lacking.hooks.is_empty() {
        print("\n");
    }
    print(&lacking.hooks);
    Ok(())
}
