//! Checks of a deployment that do not need the files of its components.

use crate::graph::cycles;
use crate::model::{Deployment, InstanceOrGroup};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, Span};
use std::collections::HashMap;

/// Checks a deployment whose own file is `main`.
pub(crate) fn check(deployment: &Deployment, main: SourceId, found: &mut Diagnostics) {
    ports(deployment, found);
    check_after_cycles(deployment, found);
    // After an error, an unused host may be the intended one.
    if !found.has_errors() {
        unused_hosts(deployment, main, found);
    }
}

/// Reports ports that several components use on one host.
fn ports(deployment: &Deployment, found: &mut Diagnostics) {
    let mut used: HashMap<(String, u16), Span> = HashMap::new();
    for instance in &deployment.instances {
        let Some((address, span)) = instance.endpoint else {
            continue;
        };
        let host = deployment.remote_host(instance);
        let host = host.map_or("localhost", |host| host.address.text.as_str());
        let port = address.port();
        if let Some(first) = used.get(&(host.to_lowercase(), port)) {
            let message = format!("port {port} is used twice on {host}");
            let diagnostic = Diagnostic::error("port-used-twice", span, message);
            found.push(diagnostic.label(*first, "first used here"));
        } else {
            used.insert((host.to_lowercase(), port), span);
        }
    }
}

/// Reports hosts of the main file without components. Imported files and files without components
/// are libraries: other files use their hosts.
fn unused_hosts(deployment: &Deployment, main: SourceId, found: &mut Diagnostics) {
    let mut used = vec![false; deployment.hosts.len()];
    let named = deployment.instances.iter().filter_map(|i| i.host);
    named.for_each(|(host, _)| used[host] = true);
    let hosts = deployment.hosts.iter().zip(used);
    for (host, _) in hosts.filter(|(host, used)| !used && host.name.span.source == main) {
        if !deployment.instances.is_empty() {
            let message = format!("no component runs on host `{}`", host.name.text);
            let warning = Diagnostic::warning("unused-host", host.name.span, message);
            found.push(warning);
        }
    }
}

/// The graph of start dependencies. The nodes are the instances, then the groups. Each instance
/// depends on those in its `after`, each group on its direct content.
pub(crate) fn start_dependencies(deployment: &Deployment) -> Vec<Vec<usize>> {
    let count = deployment.instances.len();
    let mut next: Vec<Vec<usize>> = deployment
        .instances
        .iter()
        .map(|instance| {
            let after = instance.after.iter();
            after
                .map(|(place, _)| node_index(deployment, *place))
                .collect()
        })
        .collect();
    next.resize(count + deployment.groups.len(), Vec::new());
    for (at, instance) in deployment.instances.iter().enumerate() {
        if let Some(group) = instance.group {
            next[count + group].push(at);
        }
    }
    for (at, group) in deployment.groups.iter().enumerate() {
        if let Some(parent) = group.parent {
            next[count + parent].push(count + at);
        }
    }
    next
}

/// The node of a component or a group in the graph of [`start_dependencies`].
pub(crate) fn node_index(deployment: &Deployment, place: InstanceOrGroup) -> usize {
    match place {
        InstanceOrGroup::Instance(at) => at,
        InstanceOrGroup::Group(group) => deployment.instances.len() + group,
    }
}

/// The message about a cycle of start dependencies, and the locations of its `after` names. Steps
/// from a group to its content and steps of required interfaces have no location.
pub(crate) fn describe_cycle(deployment: &Deployment, cycle: &[usize]) -> (String, Vec<Span>) {
    let path = |number: usize| match number.checked_sub(deployment.instances.len()) {
        None => deployment.instances[number].path.as_str(),
        Some(group) => deployment.groups[group].path.as_str(),
    };
    let steps = cycle.iter().zip(cycle.iter().cycle().skip(1));
    let mut message = format!("cyclic start order: {}", path(cycle[0]));
    let mut places: Vec<Span> = Vec::new();
    for (from, to) in steps {
        let Some(instance) = deployment.instances.get(*from) else {
            message.push_str(&format!(" contains {}", path(*to)));
            continue;
        };
        let mut after = instance.after.iter();
        let step = after.find(|(place, _)| node_index(deployment, *place) == *to);
        let word = if step.is_some() { "after" } else { "requires" };
        message.push_str(&format!(" {word} {}", path(*to)));
        places.extend(step.map(|(_, span)| *span));
    }
    (message, places)
}

/// Reports cycles of `after`.
fn check_after_cycles(deployment: &Deployment, found: &mut Diagnostics) {
    for cycle in cycles(&start_dependencies(deployment)) {
        let (message, places) = describe_cycle(deployment, &cycle);
        // Groups nest, so each cycle contains a component.
        if let Some((last, others)) = places.split_last() {
            let mut diagnostic = Diagnostic::error("after-cycle", *last, message);
            for other in others {
                diagnostic = diagnostic.label(*other, "also here");
            }
            found.push(diagnostic);
        }
    }
}
