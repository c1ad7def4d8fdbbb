//! Which network a command means: its name, its file, or the only one that is up.

use super::output::{Failure, print_findings, system};
use rc_deploy_client::{by_hand, connection};
use rc_diagnostics::{Diagnostics, SourceMap, render};
use std::path::Path;

/// The network of an argument, or the only one that runs: under a supervisor, otherwise by hand.
pub(super) fn running(argument: Option<String>) -> Result<String, Failure> {
    if argument.is_some() || !connection::networks().is_empty() {
        return named(argument);
    }
    match by_hand::networks().as_slice() {
        [] => named(None),
        [one] => Ok(one.clone()),
        many => Err(Failure(
            2,
            format!("several networks run: {}; name one", many.join(", ")),
        )),
    }
}

/// The network of an argument, or the only one that is up.
pub(super) fn named(argument: Option<String>) -> Result<String, Failure> {
    if let Some(argument) = argument {
        return network_of(&argument);
    }
    match connection::networks().as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(Failure(3, "no network is up".to_owned())),
        many => Err(Failure(
            2,
            format!("several networks are up: {}; name one", many.join(", ")),
        )),
    }
}

/// The network of an argument: a name, or a file. If the file has changed or is broken, the network
/// that was started from it is meant.
pub(super) fn network_of(argument: &str) -> Result<String, Failure> {
    let path = Path::new(argument);
    if path.extension().is_none_or(|e| e != "ddsl") {
        return Ok(argument.to_owned());
    }
    let mut sources = SourceMap::new();
    let (found, named) = name_in(path, &mut sources);
    if let Some(name) = &named
        && connection::networks().contains(name)
    {
        return Ok(name.clone());
    }
    match (connection::started_from(path).as_slice(), named) {
        ([one], _) => Ok(one.clone()),
        (_, Some(name)) => Ok(name),
        ([], None) => {
            let found = found.map_err(|e| system(&format!("{}: {e}", path.display())))?;
            let human = rc_diagnostics::Format::Human;
            print_findings(&render(&sources, &found, human));
            Err(Failure(1, String::new()))
        }
        (many, None) => Err(Failure(
            2,
            format!(
                "several networks were started from {}: {}; name one",
                path.display(),
                many.join(", ")
            ),
        )),
    }
}

/// The name of the network that a file describes, which may have errors, and its findings.
pub(super) fn name_in(
    path: &Path,
    sources: &mut SourceMap,
) -> (std::io::Result<Diagnostics>, Option<String>) {
    match std::fs::read_to_string(path) {
        Ok(text) => {
            let source = sources.add(path, text);
            let (file, found) = rc_ddsl::parse(sources, source);
            (
                Ok(found),
                file.deployment.map(|deployment| deployment.name.text),
            )
        }
        Err(error) => (Err(error), None),
    }
}
