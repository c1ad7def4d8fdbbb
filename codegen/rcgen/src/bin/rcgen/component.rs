//! `rcgen stubs` and `rcgen view`, about one component.

use crate::command_line::Common;
use crate::generation::manifest;
use crate::reports::{Failure, load, print, report, tell};
use rc_cdsl::model::Middleware;
use rc_codegen::templates::TemplateError;
use rc_codegen::{Project, copied, generate, python, stubs};
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use rc_vocabulary::Language;
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

/// What `describe` says of a component. Reports all findings.
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
    if project.language() == Some(Language::Python) {
        return print_python_stubs(file, &project, &folder, found, &mut sources, common);
    }
    if project.language() == Some(Language::Cpp) {
        return Err(Failure::Usage(format!(
            "the worker of {} is in C++: the compiler names each handler that is missing, a pure virtual function of \
             generated/genericworker.h, which has its signature",
            file.display()
        )));
    }
    // Whatever the file says: the handlers that are there are Rust.
    "rust".clone_into(&mut project.component.language.text);
    let system = |e: stubs::Error| Failure::System(e.to_string());
    let (missing, more) = stubs::of(&project, &folder, &mut sources).map_err(system)?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    let Some(missing) = missing else {
        return Err(Failure::Input);
    };
    let hooks = missing.hooks();
    if !missing.is_empty() {
        print(&missing.text().map_err(system)?);
        if !hooks.is_empty() {
            print("\n");
        }
    } else if common.format != Format::Json {
        tell(format_args!(
            "{}: nothing is missing; handlers: {}",
            file.display(),
            missing.total()
        ));
    }
    print(&hooks);
    Ok(())
}

fn print_python_stubs(
    file: &Path,
    project: &Project,
    folder: &Path,
    mut found: Diagnostics,
    sources: &mut SourceMap,
    common: &Common,
) -> Result<(), Failure> {
    let stubs = python::stubs::of(project, folder, sources);
    let (missing, more) = stubs.map_err(|error| Failure::System(error.to_string()))?;
    found.extend(more);
    report(sources, &found, common.format)?;
    let Some(missing) = missing else {
        return Err(Failure::Input);
    };
    let hooks = missing.hooks();
    if !missing.is_empty() {
        print(&missing.text());
        if !hooks.is_empty() {
            print("\n");
        }
    } else if common.format != Format::Json {
        tell(format_args!(
            "{}: nothing is missing; handlers: {}",
            file.display(),
            missing.total()
        ));
    }
    print(&hooks);
    Ok(())
}
