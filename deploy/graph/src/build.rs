//! Makes a picture of a network and the findings about it.

use crate::model::{Component, Finding, Graph, Group, Slot};
use rc_cdsl::model::Role;
use rc_codegen::paths::normal;
use rc_ddsl::model::InstanceOrGroup;
use rc_ddsl::{Connection as Pair, Endpoint};
use rc_deploy_network::Network;
use rc_deploy_network::chains::ChainReport;
use rc_deploy_network::topology::{Connection, End, External, Host, Kind, interface_name};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// The owner of a position in a `.ddsl`.
#[derive(Clone, Copy, Debug)]
enum Owner {
    Instance(usize),
    Group(usize),
    Host(usize),
    Network,
}

impl Graph {
    /// Makes the picture of a network. `found` are the findings of its check.
    pub fn of(network: &Network, sources: &SourceMap, found: &Diagnostics) -> Self {
        Builder { network }.graph(sources, found)
    }
}

struct Builder<'n> {
    network: &'n Network,
}

impl Builder<'_> {
    fn graph(&self, sources: &SourceMap, found: &Diagnostics) -> Graph {
        let instances = self.network.deployment.instances.iter().enumerate();
        let instances = instances.map(|(at, _)| self.component(at));
        let components = instances.chain(self.externals()).collect();
        let connections = Connection::between(self.network);
        Graph {
            network: self.network.name().to_owned(),
            ddsl: self.network.path.clone(),
            hosts: Host::all(self.network),
            time: self.network.time.as_ref().map(|time| {
                let instance = &self.network.deployment.instances[time.source];
                instance.path.clone()
            }),
            groups: self
                .network
                .deployment
                .groups
                .iter()
                .map(|group| Group {
                    name: group.path.clone(),
                    parent: group
                        .parent
                        .map(|p| self.network.deployment.groups[p].path.clone()),
                    exports: group.exports.iter().map(|e| e.text.clone()).collect(),
                })
                .collect(),
            components,
            chains: ChainReport::all(self.network),
            findings: self.findings(sources, found, &connections),
            connections: connections
                .into_iter()
                .map(|(_, c)| c)
                .chain(Connection::outside(self.network))
                .collect(),
        }
    }

    fn component(&self, at: usize) -> Component {
        let instance = &self.network.deployment.instances[at];
        let component = self.network.projects[at].as_ref().map(|p| &p.component);
        let slots = component
            .iter()
            .flat_map(|c| c.slots.iter().zip(0..).map(move |s| (c, s)));
        let over = |slot: usize| {
            let end = Endpoint { instance: at, slot };
            self.network.middlewares(end)[0].word()
        };
        Component {
            name: instance.path.clone(),
            component: component.map(|c| c.name.text.clone()),
            group: instance
                .group
                .map(|g| self.network.deployment.groups[g].path.clone()),
            host: Host::name_of(self.network, at).to_owned(),
            process: instance
                .process
                .as_ref()
                .map(|process| process.text.clone()),
            middleware: match self.network.middlewares_of(at).as_slice() {
                [_, _, ..] if instance.auto.is_some() => "auto",
                [one] => one.word(),
                _ => instance.middleware.word(),
            },
            clock: self.network.clocks[at].kind,
            external: false,
            live: None,
            machine: self.network.projects[at]
                .as_ref()
                .and_then(|project| project.state_machine.clone()),
            slots: slots
                .map(|(component, (slot, number))| Slot {
                    name: slot.name.clone(),
                    interface: component.library.interface_path(slot.interface),
                    role: slot.role,
                    middleware: over(number),
                    optional: slot.optional,
                })
                .collect(),
        }
    }

    /// The peers that are not part of the network, each with the slot that others connect to.
    fn externals(&self) -> Vec<Component> {
        let externals = External::all(self.network).into_iter();
        let components = externals.map(|peer| Component {
            name: peer.address,
            component: None,
            group: None,
            host: String::new(),
            process: None,
            middleware: peer.middleware,
            clock: "system",
            external: true,
            live: None,
            machine: None,
            slots: vec![Slot {
                name: interface_name(&peer.interface).to_owned(),
                role: match (peer.kind, peer.is_consumer) {
                    (Kind::Call, false) => Role::Implements,
                    (Kind::Call, true) => Role::Requires,
                    (Kind::Topic, false) => Role::Publishes,
                    (Kind::Topic, true) => Role::SubscribesTo,
                },
                interface: peer.interface,
                middleware: peer.middleware,
                optional: false,
            }],
        });
        components.collect()
    }

    /// The positions where owners begin. Everything up to the next position belongs to an owner.
    fn owners(&self) -> BTreeMap<(SourceId, usize), Owner> {
        let deployment = &self.network.deployment;
        let own = |place: InstanceOrGroup| match place {
            InstanceOrGroup::Instance(at) => Owner::Instance(at),
            InstanceOrGroup::Group(at) => Owner::Group(at),
        };
        let at = |span: rc_diagnostics::Span| (span.source, span.start);
        let mut owners = BTreeMap::from([(at(deployment.name.span), Owner::Network)]);
        let hosts = deployment.hosts.iter().enumerate();
        owners.extend(hosts.map(|(n, host)| (at(host.name.span), Owner::Host(n))));
        for (n, group) in deployment.groups.iter().enumerate() {
            let names = group.exports.iter().chain([&group.name]);
            owners.extend(names.map(|name| (at(name.span), Owner::Group(n))));
        }
        let binds = deployment.binds.iter().map(|b| &b.consumer);
        owners.extend(binds.map(|path| (at(path.span), own(path.place))));
        let chains = deployment.chains.iter();
        owners.extend(chains.map(|chain| (at(chain.name.span), Owner::Network)));
        let instances = deployment.instances.iter().enumerate();
        owners.extend(instances.map(|(n, i)| (at(i.name.span), Owner::Instance(n))));
        owners
    }

    fn findings(
        &self,
        sources: &SourceMap,
        found: &Diagnostics,
        connections: &[(Pair, Connection)],
    ) -> Vec<Finding> {
        let owners = self.owners();
        let numbers: BTreeMap<Pair, usize> = connections
            .iter()
            .zip(0..)
            .map(|((pair, _), n)| (*pair, n))
            .collect();
        let mut findings: Vec<Finding> = Vec::new();
        // Each component that imports a wrong file has the same finding.
        let mut known: HashMap<(&str, PathBuf, usize, usize, &str), usize> = HashMap::new();
        for diagnostic in found.sorted() {
            let span = diagnostic.span;
            let place = sources.position(span.source, span.start);
            let file = sources.path(span.source).to_path_buf();
            let (line, column) = (place.line, place.column);
            let key = (
                diagnostic.code,
                file.clone(),
                line,
                column,
                diagnostic.message.as_str(),
            );
            let at = *known.entry(key).or_insert_with(|| {
                findings.push(Finding {
                    code: diagnostic.code,
                    severity: diagnostic.severity.name(),
                    message: diagnostic.message.clone(),
                    help: diagnostic.help.clone(),
                    file,
                    line,
                    column,
                    components: Vec::new(),
                    slots: Vec::new(),
                    connections: Vec::new(),
                    group: None,
                    host: None,
                });
                findings.len() - 1
            });
            self.blame(diagnostic, &owners, &numbers, &mut findings[at]);
        }
        findings
    }

    /// Whether a file is the configuration of an instance.
    fn is_configured_by(&self, at: usize, file: &Path) -> bool {
        let instance = &self.network.deployment.instances[at];
        match (&instance.config, &self.network.projects[at]) {
            (Some(named), _) => normal(&instance.folder.join(&named.text)) == file,
            (None, Some(project)) => project.folder().join("etc/config.toml") == file,
            (None, None) => false,
        }
    }

    /// Notes the subjects of a finding: slots and connections that it names, otherwise the owner of
    /// its position.
    fn blame(
        &self,
        diagnostic: &Diagnostic,
        owners: &BTreeMap<(SourceId, usize), Owner>,
        numbers: &BTreeMap<Pair, usize>,
        finding: &mut Finding,
    ) {
        let diagnostics = self.network.connections.diagnostics.iter();
        let diagnostics: Vec<_> = diagnostics
            .filter(|t| t.diagnostic == *diagnostic)
            .collect();
        for found in &diagnostics {
            let ends = [Some(found.endpoint), found.peer];
            let drawn = found.peer.and_then(|other| {
                let one = (found.endpoint, other);
                [one, (one.1, one.0)]
                    .into_iter()
                    .find_map(|(consumer, provider)| numbers.get(&Pair { consumer, provider }))
            });
            if let Some(number) = drawn {
                finding.connections.push(*number);
            } else {
                let ends = ends.into_iter().flatten();
                finding
                    .slots
                    .extend(ends.map(|end| End::of(self.network, end)));
            }
        }
        if !diagnostics.is_empty() {
            return;
        }
        let span = diagnostic.span;
        let components = &mut finding.components;
        let mut name = |at: &usize| {
            let name = &self.network.deployment.instances[*at].path;
            if !components.contains(name) {
                components.push(name.clone());
            }
        };
        let made_of = self
            .network
            .texts
            .get(&finding.file)
            .into_iter()
            .flatten()
            .copied();
        let configured =
            (0..self.network.projects.len()).filter(|at| self.is_configured_by(*at, &finding.file));
        let instances: BTreeSet<usize> = made_of.chain(configured).collect();
        if !instances.is_empty() {
            instances.iter().for_each(&mut name);
            return;
        }
        let before = owners.range(..=(span.source, span.start)).next_back();
        match before.filter(|((source, _), _)| *source == span.source) {
            Some((_, Owner::Instance(at))) => name(at),
            Some((_, Owner::Group(at))) => {
                finding.group = Some(self.network.deployment.groups[*at].path.clone());
            }
            Some((_, Owner::Host(at))) => {
                finding.host = Some(self.network.deployment.hosts[*at].name.text.clone());
            }
            Some((_, Owner::Network)) | None => {}
        }
    }
}
