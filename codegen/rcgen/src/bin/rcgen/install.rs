//! `rcgen install`: components of a workspace under a prefix.

use crate::command_line::Common;
use crate::reports::{Failure, print_line, report, system, tell};
use rc_codegen::FileLoader;
use rc_deploy_network::{Disagreement, Error, Installation, Profile};
use rc_diagnostics::{Diagnostics, SourceMap};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

pub(crate) struct Request<'a> {
    pub(crate) files: &'a [PathBuf],
    pub(crate) common: &'a Common,
    pub(crate) prefix: PathBuf,
    pub(crate) profile: Profile,
    pub(crate) replace: bool,
    pub(crate) dry_run: bool,
}

/// Installs all components, or none if one of them cannot be installed.
pub(crate) fn install(request: &Request<'_>) -> Result<(), Failure> {
    let loader = FileLoader::new(&request.common.include);
    let mut installations = Vec::new();
    for file in request.files {
        let (mut sources, mut found) = (SourceMap::new(), Diagnostics::new());
        let profile = request.profile;
        let outcome = Installation::of(file, profile, &mut sources, &loader, &mut found);
        report(&sources, &found, request.common.format)?;
        installations.extend(outcome.map_err(failed)?);
    }
    let disagreement = Installation::disagreement(&installations).map_err(failed)?;
    if let Some(Disagreement { place, sources }) = disagreement {
        let [one, other] = sources.map(|source| source.display());
        tell(format_args!(
            "rcgen: error: {one} and {other} differ, and only one of them can be {}; install one of the two workspaces below another --prefix",
            request.prefix.join(place).display()
        ));
        return Err(Failure::Input);
    }
    for installation in installations.iter().filter(|_| !request.replace) {
        if let [first, ..] = &installation.conflicts(&request.prefix).map_err(failed)?[..] {
            tell(format_args!(
                "rcgen: error: {} is installed in another version, which other components may have been built with; --replace replaces it",
                first.display()
            ));
            return Err(Failure::Input);
        }
    }
    for installation in &installations {
        let place = request.prefix.join(installation.folder());
        let word = if place.exists() { "replace" } else { "create" };
        if !request.dry_run {
            let written = installation.write(&request.prefix);
            written.map_err(|error| refused(&place, &request.prefix, &error))?;
        }
        print_line(format_args!("{word} {}", place.display()));
        for file in installation.files() {
            print_line(format_args!("  {}", file.display()));
        }
    }
    Ok(())
}

fn failed(error: Error) -> Failure {
    match error {
        Error::Workspace(message) => {
            tell(format_args!("rcgen: error: {message}"));
            Failure::Input
        }
        error => system(error),
    }
}

/// The system refused to write a component.
fn refused(place: &Path, prefix: &Path, error: &std::io::Error) -> Failure {
    let help = match error.kind() {
        ErrorKind::PermissionDenied => format!(
            "; {} belongs to another user: name a folder of yours with --prefix, or become root",
            prefix.display()
        ),
        _ => String::new(),
    };
    system(format_args!(
        "cannot write {}: {error}{help}",
        place.display()
    ))
}
