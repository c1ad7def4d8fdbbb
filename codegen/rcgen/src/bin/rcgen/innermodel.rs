//! `rcgen export` and `rcgen import` of InnerModel files.

use crate::command_line::Target;
use crate::export::Request;
use crate::reports::{Failure, create, refused, report, write};
use innermodel_exchange::{gltf, urdf};
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use rcgen::innermodel::Folders;
use std::io::ErrorKind;
use std::path::Path;

pub(crate) fn export(request: &Request<'_>) -> Result<(), Failure> {
    let Request {
        target,
        file,
        out,
        common,
        dry_run,
        domain: _,
    } = *request;
    if file.extension().is_none_or(|ending| ending != "xml") {
        let message = format!("{} is not an .xml file of InnerModel", file.display());
        return Err(Failure::Usage(message));
    }
    let mut sources = SourceMap::new();
    let source = sources.add(file, read(file)?);
    let folders = Folders {
        search: &common.include,
    };
    let (document, mut found) = innermodel_language::load(&mut sources, &folders, source);
    if found.has_errors() {
        return report(&sources, &found, common.format);
    }
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let (bytes, more, ending) = if matches!(target, Target::Urdf) {
        let (text, more) = urdf::write(&document, &name);
        (text.into_bytes(), more, "urdf")
    } else {
        let (bytes, more) = gltf::write(&document);
        (bytes, more, "glb")
    };
    found.extend(more);
    report(&sources, &found, common.format)?;
    let path = out.join(format!("{name}.{ending}"));
    let old = match rc_files::read_bytes(&path) {
        Ok(old) => Some(old),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => return Err(refused(&path, &error)),
    };
    if old.as_ref() == Some(&bytes) {
        return Ok(());
    }
    let is_ours = match target {
        Target::Urdf => urdf::is_exported,
        _ => gltf::is_exported,
    };
    if old.as_deref().is_some_and(|old| !is_ours(old)) {
        let place = path.display();
        return Err(Failure::Usage(format!(
            "{place} is there, and was not written by an export; name another folder"
        )));
    }
    let word = if old.is_some() { "update" } else { "create" };
    write(&path, &bytes, word, dry_run)
}

fn read(file: &Path) -> Result<String, Failure> {
    rc_files::read(file).map_err(|error| refused(file, &error))
}

pub(crate) fn import(file: &Path, out: &Path, format: Format) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let source = sources.add(file, read(file)?);
    let (document, found): (_, Diagnostics) = urdf::read(&sources, source);
    report(&sources, &found, format)?;
    let text = innermodel_language::print(&document);
    create(out, text.as_bytes(), "file", false)
}
