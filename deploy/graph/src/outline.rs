//! The nesting of boxes: hosts, their groups, and components.

use crate::model::{Component, Graph};
use std::collections::{BTreeSet, HashMap};

/// One step of a walk through all boxes, from outside to inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// A host begins: an index into [`Graph::hosts`].
    Host(usize),
    /// A group begins, or the part of it that is on a host: indices into [`Graph::groups`] and
    /// [`Graph::hosts`].
    Group(usize, usize),
    /// A component: an index into [`Graph::components`].
    Component(usize),
    /// The innermost open box ends.
    End,
}

/// All boxes. A single unnamed machine has no box; a group on several hosts has one on each. Peers
/// that are not part of the network are outside of all boxes.
pub(crate) fn outline(graph: &Graph) -> Vec<Step> {
    let hosts: HashMap<&str, usize> = graph
        .hosts
        .iter()
        .map(|h| h.name.as_str())
        .zip(0..)
        .collect();
    let groups: HashMap<&str, usize> = graph
        .groups
        .iter()
        .map(|g| g.name.as_str())
        .zip(0..)
        .collect();
    let host = |c: &Component| hosts.get(c.host.as_str()).copied().unwrap_or(0);
    let parent = |group: usize| groups.get(graph.groups[group].parent.as_deref()?).copied();
    // The hosts of each group: those of its components.
    let mut places: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); graph.groups.len()];
    let inside_components = || {
        graph
            .components
            .iter()
            .enumerate()
            .filter(|(_, c)| !c.external)
    };
    for (_, component) in inside_components() {
        let own = component
            .group
            .as_deref()
            .and_then(|g| groups.get(g))
            .copied();
        for group in std::iter::successors(own, |group| parent(*group)) {
            places[group].insert(host(component));
        }
    }
    for group in 0..places.len() {
        if places[group].is_empty() {
            let around = parent(group).and_then(|p| places[p].first().copied());
            places[group].insert(around.unwrap_or(0));
        }
    }
    let mut inside: HashMap<(Option<usize>, usize), Vec<Step>> = HashMap::new();
    for (at, component) in inside_components() {
        let group = component
            .group
            .as_deref()
            .and_then(|g| groups.get(g))
            .copied();
        let steps = inside.entry((group, host(component))).or_default();
        steps.push(Step::Component(at));
    }
    for (group, on) in places.iter().enumerate() {
        for host in on {
            let steps = inside.entry((parent(group), *host)).or_default();
            steps.push(Step::Group(group, *host));
        }
    }
    let named = graph.hosts.len() > 1 || graph.hosts.iter().any(|h| h.name != "localhost");
    let externals = graph
        .components
        .iter()
        .enumerate()
        .filter(|(_, c)| c.external);
    let mut out: Vec<Step> = externals.map(|(at, _)| Step::Component(at)).collect();
    for host in 0..graph.hosts.len() {
        out.extend(named.then_some(Step::Host(host)));
        unfold(&inside, None, host, &mut out);
        out.extend(named.then_some(Step::End));
    }
    out
}

fn unfold(
    inside: &HashMap<(Option<usize>, usize), Vec<Step>>,
    group: Option<usize>,
    host: usize,
    out: &mut Vec<Step>,
) {
    for step in inside.get(&(group, host)).into_iter().flatten() {
        out.push(*step);
        if let Step::Group(group, host) = step {
            unfold(inside, Some(*group), *host, out);
            out.push(Step::End);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Step::{Component as C, End, Group as G, Host as H};
    use super::*;
    use crate::model::Group;
    use rc_deploy_network::topology::Host;

    #[test]
    fn a_group_on_two_hosts_has_two_boxes_and_an_empty_one_is_shown() {
        let host = |name: &str| Host {
            name: name.to_owned(),
            address: "10.0.0.2".to_owned(),
            user: None,
            build: None,
        };
        let group = |name: &str, parent: Option<&str>| Group {
            name: name.to_owned(),
            parent: parent.map(str::to_owned),
            exports: Vec::new(),
        };
        let component = |name: &str, host: &str| Component {
            name: name.to_owned(),
            component: None,
            group: Some("arm".to_owned()),
            host: host.to_owned(),
            process: None,
            middleware: "iceoryx2",
            clock: "system",
            external: false,
            live: None,
            machine: None,
            slots: Vec::new(),
        };
        let graph = Graph {
            network: "n".to_owned(),
            ddsl: "n.ddsl".into(),
            hosts: vec![host("one"), host("two")],
            time: None,
            groups: vec![group("arm", None), group("arm.hand", Some("arm"))],
            components: vec![component("arm.a", "two"), component("arm.b", "one")],
            connections: Vec::new(),
            chains: Vec::new(),
            findings: Vec::new(),
        };
        let one = [H(0), G(0, 0), C(1), G(1, 0), End, End, End];
        let two = [H(1), G(0, 1), C(0), End, End];
        assert_eq!(outline(&graph), [&one[..], &two[..]].concat());
    }
}
