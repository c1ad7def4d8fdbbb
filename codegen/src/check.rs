//! Checks files of any of the languages, and configurations.

use crate::project::Project;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use rc_idsl::Session;
use rc_syntax::Loader;
use std::io;
use std::path::{Path, PathBuf};

/// The endings of the files that are checked. Components come first, since they read what they are made of.
const ENDINGS: [&str; 7] = ["cdsl", "idsl", "pdsl", "smdsl", "scxml", "ddsl", "toml"];

/// `path` itself, or what there is to check in a folder and the folders in it. Hidden folders, cargo's `target`
/// and links to folders are left out, and so is a `.toml` that lies in no `etc/`.
pub fn files(path: &Path) -> io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut files: Vec<(usize, PathBuf)> = Vec::new();
    let mut folders = vec![path.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let in_etc = folder.file_name().is_some_and(|name| name == "etc");
        for entry in std::fs::read_dir(&folder)? {
            let entry = entry?;
            let (name, path) = (entry.file_name(), entry.path());
            if entry.file_type()?.is_dir() {
                if name != "target" && !name.as_encoded_bytes().starts_with(b".") {
                    folders.push(path);
                }
                continue;
            }
            let ending = path.extension().and_then(|e| e.to_str());
            let rank = ENDINGS.iter().position(|e| Some(*e) == ending);
            let rank = rank.filter(|_| ending != Some("toml") || in_etc);
            files.extend(rank.map(|rank| (rank, path)));
        }
    }
    files.sort();
    Ok(files.into_iter().map(|(_, path)| path).collect())
}

/// Whether `path` was read, and so checked, with the component that it belongs to.
fn was_read(path: &Path, sources: &SourceMap) -> bool {
    let same = |other: &Path| {
        other.file_name() == path.file_name()
            && matches!((other.canonicalize(), path.canonicalize()), (Ok(a), Ok(b)) if a == b)
    };
    sources.ids().any(|id| same(sources.path(id)))
}

/// Adds all that is wrong with `path` to `found`. An error is a file that the system does not give.
pub fn file(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<()> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("cdsl") => found.extend(Project::load(path, sources, loader)?.1),
        Some("idsl" | "pdsl" | "smdsl" | "scxml") if was_read(path, sources) => {}
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
        Some("smdsl" | "scxml") => {
            let source = sources.add(path, std::fs::read_to_string(path)?);
            found.extend(rc_smdsl::load(sources, source).1);
        }
        Some("ddsl") => {
            let source = sources.add(path, std::fs::read_to_string(path)?);
            found.extend(rc_ddsl::parse(sources, source).1);
        }
        Some("toml") => configuration(path, sources, loader, found)?,
        _ => {
            let source = sources.add(path, "");
            let message = "this is none of .idsl, .cdsl, .pdsl, .smdsl, .scxml, .ddsl and .toml";
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
    let known = was_read(&cdsl, sources);
    let (project, more) = Project::load(&cdsl, sources, loader)?;
    if !known {
        found.extend(more);
    }
    let parameters = project.and_then(|p| p.parameters);
    found.extend(rc_pdsl::config::check(sources, source, parameters.as_ref()).1);
    Ok(())
}
