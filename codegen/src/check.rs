//! Checks one file of any of the languages, or a configuration.

use crate::project::Project;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use rc_idsl::Session;
use rc_syntax::Loader;
use std::io;
use std::path::Path;

/// Adds all that is wrong with `path` to `found`. An error is a file that the system does not give.
pub fn file(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<()> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("cdsl") => found.extend(Project::load(path, sources, loader)?.1),
        Some("idsl") => {
            let source = sources.add(path, std::fs::read_to_string(path)?);
            let mut session = Session::new(sources, loader);
            session.load_source(source, path.to_path_buf(), Span::new(source, 0, 0));
            found.extend(session.found);
        }
        Some("pdsl") => {
            let source = sources.add(path, std::fs::read_to_string(path)?);
            found.extend(rc_pdsl::load(sources, source).1);
        }
        Some("ddsl") => {
            let source = sources.add(path, std::fs::read_to_string(path)?);
            found.extend(rc_ddsl::load(sources, loader, source).1);
        }
        Some("toml") => configuration(path, sources, loader, found)?,
        _ => {
            let source = sources.add(path, "");
            let message = "this is none of .idsl, .cdsl, .pdsl, .ddsl and .toml";
            found.push(Diagnostic::error(
                "unknown-language",
                Span::new(source, 0, 0),
                message,
            ));
        }
    }
    Ok(())
}

/// A configuration belongs to the component in whose `etc/` it lies.
fn configuration(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<()> {
    let text = std::fs::read_to_string(path)?;
    let folder = path
        .canonicalize()?
        .parent()
        .and_then(Path::parent)
        .map(Path::to_path_buf);
    let entries = folder
        .iter()
        .filter_map(|f| std::fs::read_dir(f).ok())
        .flatten()
        .flatten();
    let cdsl = entries
        .map(|e| e.path())
        .find(|p| p.extension().is_some_and(|e| e == "cdsl"));
    let source = sources.add(path, text);
    let Some(cdsl) = cdsl else {
        let message =
            "no component owns this configuration: there is no .cdsl in the folder above its own";
        found.push(Diagnostic::error(
            "no-component",
            Span::new(source, 0, 0),
            message,
        ));
        return Ok(());
    };
    let (project, more) = Project::load(&cdsl, sources, loader)?;
    found.extend(more);
    let parameters = project.and_then(|p| p.parameters);
    found.extend(rc_pdsl::config::check(sources, source, parameters.as_ref()).1);
    Ok(())
}
