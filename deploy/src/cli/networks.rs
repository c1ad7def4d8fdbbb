//! Which network a command means: its name, its file, or the only one that is up.

use super::output::{Failure, print_findings, system};
use rc_deploy_client::error::Error;
use rc_deploy_client::{by_hand, connection, logs, place, status};
use rc_diagnostics::{Diagnostics, SourceMap};
use std::path::Path;

/// The network of an argument, or the only one that runs: under a supervisor, otherwise by hand.
pub(super) fn running(argument: Option<String>) -> Result<String, Failure> {
    if argument.is_some() || !connection::networks_here().is_empty() {
        return named(argument);
    }
    match running_networks().as_slice() {
        [] => named(None),
        [one] => Ok(one.clone()),
        many => Err(Failure(
            2,
            format!("several networks run: {}; name one", many.join(", ")),
        )),
    }
}

/// The networks that run under a supervisor in this environment; without one, those that run by
/// hand in it; without any, those elsewhere.
pub(super) fn running_networks() -> Vec<String> {
    let here = running_here();
    if here.is_empty() {
        connection::networks()
    } else {
        here
    }
}

/// The networks that run in this environment: under a supervisor; without one, by hand.
pub(super) fn running_here() -> Vec<String> {
    let supervised = connection::networks_here();
    if supervised.is_empty() {
        by_hand::networks()
    } else {
        supervised
    }
}

/// The network of an argument, or the only one that is up.
fn named(argument: Option<String>) -> Result<String, Failure> {
    if let Some(argument) = argument {
        return network_of(&argument);
    }
    match connection::networks().as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(Failure(3, place::none_is_up())),
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
        return name_of(argument);
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
            print_findings(&sources, &found, human);
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

/// The reason why no supervisor starts or stops components of a network: they were started by hand,
/// if there are any.
pub(super) fn by_hand_or(network: &str, error: Error) -> Failure {
    let report = status::report(network).ok();
    let pids = report.iter().flat_map(status::NetworkReport::components);
    let pids: Vec<String> = pids.filter_map(|c| Some(c.pid?.to_string())).collect();
    if !matches!(error, Error::NotUp { .. }) || pids.is_empty() {
        return error.into();
    }
    let pids = pids.join(" ");
    Failure(
        3,
        format!(
            "the components of network {network} were started by hand, and rcdeploy neither starts nor stops them; end them where they run, or with: kill {pids}"
        ),
    )
}

/// The name of a network, unless it is a mistyped one: nothing of it runs or has logs, and another
/// network with a similar name runs.
fn name_of(name: &str) -> Result<String, Failure> {
    let mut known = connection::networks();
    known.extend(by_hand::networks());
    if known.iter().any(|known| known == name) || logs::directory(name).exists() {
        return Ok(name.to_owned());
    }
    match rc_diagnostics::nearest(name, known.iter().map(String::as_str)) {
        Some(near) => Err(Failure(
            3,
            format!("network {name} is not up; did you mean `{near}`?"),
        )),
        None => Ok(name.to_owned()),
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
