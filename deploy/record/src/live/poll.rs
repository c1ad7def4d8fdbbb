//! Polls a running network.

use rc_deploy_client::{connection, place};
use rc_management::Client;
use rc_management::chains::ChainStatus;
use rc_management::component::{Parameters, Request};
use rc_management::supervisor;
use rc_observe::Network;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long a component may take to list its parameters, and the supervisor to begin its events.
const LIMIT: Duration = Duration::from_secs(2);
/// The longest description file that is attached, in bytes.
const LONGEST_FILE: usize = 16 * 1024 * 1024;

/// The state of a network at one moment.
pub(super) struct Snapshot {
    pub(super) network: Network,
    pub(super) parameters: BTreeMap<String, Parameters>,
    /// The `.ddsl`: its name and its text.
    pub(super) ddsl: Option<(String, String)>,
    /// The configuration files of the components on this machine that have no secrets.
    pub(super) configurations: BTreeMap<String, String>,
    /// The chains, with the messages that came to their end since the last look.
    pub(super) chains: Vec<ChainStatus>,
    /// The events of the supervisor from now on, if they were wanted.
    pub(super) events: Option<Client>,
}

/// How many messages of each chain were recorded; none before the first look, which skips those of
/// the past.
pub(super) type KnownMessages = Option<Vec<u64>>;

/// Polls once. `None` if no component replies.
pub(super) fn poll(name: &str, known: &mut KnownMessages, wants_events: bool) -> Option<Snapshot> {
    let network = Network::look(name).ok()?;
    let directory = place::directory(name);
    let parameters = network.components.iter().filter_map(|component| {
        let socket = directory.socket(&component.name.replace('.', "-"));
        let mut client = Client::connect(&socket, LIMIT).ok()?;
        let request = Request::Parameters { paths: None };
        let listed: Parameters = client.call(&request, LIMIT).ok()?;
        Some((component.name.clone(), listed))
    });
    let parameters: BTreeMap<String, Parameters> = parameters.collect();
    let ddsl = connection::status(name).ok().and_then(|status| {
        let file = status.ddsl.file_name()?.to_string_lossy().into_owned();
        Some((file, read(&status.ddsl)?))
    });
    // The path of a component on another machine means nothing here.
    let here = network.components.iter().filter(|c| c.host.is_none());
    let configurations = here.filter_map(|component| {
        let listed = parameters.get(&component.name)?;
        let has_secrets = listed.parameters.iter().any(|one| one.secret);
        let file = listed.file.as_ref().filter(|_| !has_secrets)?;
        Some((component.name.clone(), read(file)?))
    });
    let configurations = configurations.collect();
    // Without a supervisor nobody measures chains.
    let chains = connection::chains(name, known.clone());
    let chains = chains.map_or_else(|_| Vec::new(), |report| report.chains);
    if !chains.is_empty() {
        *known = Some(chains.iter().map(|chain| chain.complete).collect());
    }
    Some(Snapshot {
        chains,
        network,
        parameters,
        ddsl,
        configurations,
        events: wants_events.then(|| events(name)).flatten(),
    })
}

/// Follows the events of a network that has a supervisor. Those of the past are skipped.
fn events(network: &str) -> Option<Client> {
    let deadline = Instant::now() + LIMIT;
    let left = || deadline.saturating_duration_since(Instant::now());
    let mut client = place::connect(network, left()).ok()?;
    let kept: supervisor::KeptEvents = client.call(&supervisor::Request::Events, left()).ok()?;
    for _ in 0..kept.kept {
        client.next(left()).ok()?;
    }
    Some(client)
}

/// A file that is not a pipe and not too long.
fn read(path: &Path) -> Option<String> {
    let text = rc_files::read(path).ok()?;
    (text.len() <= LONGEST_FILE).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_is_read_only_from_a_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.toml");
        std::fs::write(&path, "a = 1").expect("to write");
        assert_eq!(read(&path).as_deref(), Some("a = 1"));
        assert_eq!(read(folder.path()), None);
        assert_eq!(read(Path::new("/dev/zero")), None);
    }
}
