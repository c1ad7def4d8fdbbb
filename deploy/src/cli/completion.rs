//! Completes arguments of `rcdeploy` in a shell: the present names of networks, components and
//! parameters. Programs that do not answer have no completions.

use super::networks::name_in;
use super::{Cli, TOOL};
use rc_command_line::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, earlier_word, files,
};
use rc_deploy_client::names::is_reserved;
use rc_deploy_client::{by_hand, connection, logs, params, states, status};
use rc_diagnostics::SourceMap;
use rc_management::supervisor::ComponentStatus;
use rc_observe::Network;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::Path;

/// Networks that run, and descriptions of networks.
pub(super) fn networks() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let mut names: BTreeSet<String> = connection::networks().into_iter().collect();
        names.extend(by_hand::networks());
        let begin = current.to_string_lossy();
        names.retain(|name| name.starts_with(&*begin));
        let mut found = candidates(names);
        found.extend(files(&["ddsl"]).complete(current));
        found
    })
}

/// The components of the network that the command line names.
pub(super) fn components() -> ArgValueCandidates {
    ArgValueCandidates::new(|| candidates(names_of_components()))
}

/// Components, and the groups that contain them.
pub(super) fn components_and_groups() -> ArgValueCandidates {
    ArgValueCandidates::new(|| candidates(with_groups(names_of_components())))
}

fn with_groups(mut names: BTreeSet<String>) -> BTreeSet<String> {
    let components: Vec<String> = names.iter().cloned().collect();
    for name in components {
        let ends = name.match_indices('.').map(|(at, _)| name[..at].to_owned());
        names.extend(ends);
    }
    names
}

/// Managed components, and the groups that contain them.
pub(super) fn managed_components() -> ArgValueCandidates {
    ArgValueCandidates::new(|| candidates(with_groups(names_where(|c| c.lifecycle.is_some()))))
}

/// The logs of the network that the command line names, which need not run.
pub(super) fn logs_of() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let entries = network().map(|network| std::fs::read_dir(logs::directory(&network)));
        let entries = entries.into_iter().flatten().flatten().flatten();
        let names = entries.filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            let name = name.strip_suffix(".log")?;
            (!is_reserved(name)).then(|| name.to_owned())
        });
        candidates(names.collect())
    })
}

/// The parameters of the component that the command line names, with `end` after each.
pub(super) fn parameters(end: &'static str) -> ArgValueCandidates {
    ArgValueCandidates::new(move || {
        let component = word("name");
        let found = network().zip(component);
        let found = found.and_then(|(network, name)| params::list(&network, &name, &[]).ok());
        let parameters = found.into_iter().flat_map(|found| found.parameters);
        let changeable = parameters.filter(|parameter| end.is_empty() || parameter.editable);
        let found = changeable.map(|parameter| {
            let candidate = CompletionCandidate::new(format!("{}{end}", parameter.path));
            candidate.help(parameter.doc.first().map(Into::into))
        });
        found.collect()
    })
}

/// The events of the component that the command line names, which may be fired from outside.
pub(super) fn events() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let found = network().zip(word("name"));
        let found = found.and_then(|(network, name)| states::machine(&network, &name).ok());
        let events = found
            .flatten()
            .into_iter()
            .flat_map(|machine| machine.external);
        candidates(events.collect())
    })
}

/// The topics and the operations of the network that the command line names.
pub(super) fn topics() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        candidates(names_in_network(|network| {
            let topics = network.topics();
            let topics = topics.iter().map(rc_observe::Topic::name);
            let operations = network.operations();
            let operations = operations.iter().map(rc_observe::Operation::name);
            topics.chain(operations).collect()
        }))
    })
}

/// The topics.
pub(super) fn only_topics() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        candidates(names_in_network(|network| {
            network
                .topics()
                .iter()
                .map(rc_observe::Topic::name)
                .collect()
        }))
    })
}

/// The operations that can be called.
pub(super) fn operations() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        candidates(names_in_network(|network| {
            let operations = network.operations();
            operations.iter().map(rc_observe::Operation::name).collect()
        }))
    })
}

/// Types, interfaces, slots and operations.
pub(super) fn described() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        candidates(names_in_network(|network| {
            super::look::names(network).into_iter().collect()
        }))
    })
}

fn names_in_network(names: impl Fn(&Network) -> BTreeSet<String>) -> BTreeSet<String> {
    let found = network().and_then(|network| Network::look(&network).ok());
    found.as_ref().map(names).unwrap_or_default()
}

fn names_of_components() -> BTreeSet<String> {
    names_where(|_| true)
}

fn names_where(is_meant: fn(&ComponentStatus) -> bool) -> BTreeSet<String> {
    let report = network().and_then(|network| status::report(&network).ok());
    let Some(report) = report else {
        return BTreeSet::new();
    };
    let meant = report.components().filter(|component| is_meant(component));
    meant.map(|component| component.name.clone()).collect()
}

/// The network of the command line that is completed.
fn network() -> Option<String> {
    let word = word("network")?;
    let path = Path::new(&word);
    if path.extension().is_none_or(|e| e != "ddsl") {
        return Some(word);
    }
    name_in(path, &mut SourceMap::new()).1.or_else(|| {
        let mut started = connection::started_from(path).into_iter();
        started.next()
    })
}

fn word(name: &str) -> Option<String> {
    earlier_word(TOOL.command::<Cli>(), name)
}

fn candidates(names: BTreeSet<String>) -> Vec<CompletionCandidate> {
    names.into_iter().map(CompletionCandidate::new).collect()
}
