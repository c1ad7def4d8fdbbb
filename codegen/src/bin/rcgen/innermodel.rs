//! `rcgen export` and `rcgen import` of InnerModel files.

use crate::command_line::{Common, Target};
use crate::reports::{Failure, print_line, report};
use innermodel_exchange::{gltf, urdf};
use rc_codegen::innermodel::Folders;
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use std::io::ErrorKind;
use std::path::Path;

/// What an exported file has in its first bytes.
const MARK: &[u8] = b"rcgen";
/// How many bytes these are.
const BEGIN: usize = 400;

pub(crate) fn export(
    target: Target,
    file: &Path,
    out: &Path,
    common: &Common,
    dry_run: bool,
) -> Result<(), Failure> {
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
    let old = std::fs::read(&path).ok();
    if let Some(old) = &old
        && !is_ours(old)
    {
        let place = path.display();
        return Err(Failure::Usage(format!(
            "{place} is there, and was not written by an export; name another folder"
        )));
    }
    if old.as_ref() == Some(&bytes) {
        return Ok(());
    }
    if !dry_run {
        let written = std::fs::create_dir_all(out).and_then(|()| std::fs::write(&path, &bytes));
        written.map_err(|error| Failure::System(format!("{}: {error}", path.display())))?;
    }
    let word = if old.is_some() { "update" } else { "create" };
    print_line(format_args!("{word} {}", path.display()));
    Ok(())
}

fn is_ours(bytes: &[u8]) -> bool {
    let begin = bytes.get(..BEGIN).unwrap_or(bytes);
    begin.windows(MARK.len()).any(|window| window == MARK)
}

fn read(file: &Path) -> Result<String, Failure> {
    rc_files::read(file).map_err(|error| Failure::System(format!("{}: {error}", file.display())))
}

pub(crate) fn import(file: &Path, out: &Path, format: Format) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let source = sources.add(file, read(file)?);
    let (document, found): (_, Diagnostics) = urdf::read(&sources, source);
    report(&sources, &found, format)?;
    let text = innermodel_language::print(&document);
    let mut options = std::fs::File::options();
    let written = options.write(true).create_new(true).open(out);
    let written =
        written.and_then(|mut file| std::io::Write::write_all(&mut file, text.as_bytes()));
    match written {
        Ok(()) => {
            print_line(format_args!("create {}", out.display()));
            Ok(())
        }
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            let message = format!("{} is there already; name another file", out.display());
            Err(Failure::Usage(message))
        }
        Err(error) => Err(Failure::System(format!("{}: {error}", out.display()))),
    }
}
