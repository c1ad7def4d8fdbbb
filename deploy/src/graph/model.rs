//! What a picture shows, taken from a network and the findings about it.

use crate::network::load::Network;
use rc_cdsl::model::Role;
use rc_ddsl::model::InstanceOrGroup;
use rc_ddsl::{Connection as Pair, Endpoint};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceId, SourceMap};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// A network as a picture.
#[derive(Clone, Debug, Serialize)]
pub struct Graph {
    /// Its name.
    pub network: String,
    /// The file that describes it.
    pub ddsl: PathBuf,
    /// The machines on which something runs; this one, unless it is named otherwise, is `localhost`.
    pub hosts: Vec<Host>,
    /// The groups, each before those inside it.
    pub groups: Vec<Group>,
    /// The components, in the order of the file.
    pub components: Vec<Component>,
    /// Who talks to whom, also where that was refused.
    pub connections: Vec<Connection>,
    /// What the check has found, in the order of places.
    pub findings: Vec<Finding>,
}

/// A machine.
#[derive(Clone, Debug, Serialize)]
pub struct Host {
    /// Its name.
    pub name: String,
    /// Its name or IP address in the network of machines.
    pub address: String,
    /// Who runs components there, where the file says.
    pub user: Option<String>,
}

/// A group.
#[derive(Clone, Debug, Serialize)]
pub struct Group {
    /// Its name with those of the groups that it is in.
    pub name: String,
    /// The whole name of the group that it is in.
    pub parent: Option<String>,
    /// What it lets out.
    pub exports: Vec<String>,
}

/// A component.
#[derive(Clone, Debug, Serialize)]
pub struct Component {
    /// Its name with those of the groups that it is in.
    pub name: String,
    /// What it is called in its `.cdsl`, where that could be read.
    pub component: Option<String>,
    /// The whole name of the group that it is in.
    pub group: Option<String>,
    /// The name of its host.
    pub host: String,
    /// The middleware of its slots that choose none.
    pub middleware: &'static str,
    /// Its slots, in the order of its `.cdsl`.
    pub slots: Vec<Slot>,
}

/// A slot.
#[derive(Clone, Debug, Serialize)]
pub struct Slot {
    /// Its name.
    pub name: String,
    /// What is said: `Module::Interface`.
    pub interface: String,
    /// `implements`, `requires`, `publishes` or `subscribesTo`.
    pub role: &'static str,
    /// Its middleware.
    pub middleware: &'static str,
}

/// What travels over a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Calls, and their answers.
    Call,
    /// Data, from one to many.
    Topic,
}

/// One end of a connection.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct End {
    /// The whole name of a component.
    pub component: String,
    /// One of its slots.
    pub slot: String,
    /// The numbers of both, for those who draw.
    #[serde(skip)]
    pub(crate) at: (usize, usize),
}

/// A connection.
#[derive(Clone, Debug, Serialize)]
pub struct Connection {
    /// Who calls, or sends data.
    pub from: End,
    /// Who is called, or gets the data.
    pub to: End,
    /// What is said: `Module::Interface`.
    pub interface: String,
    /// What travels.
    pub kind: Kind,
    /// Over what.
    pub middleware: &'static str,
    /// Where both meet; none where they are refused.
    pub address: Option<String>,
}

/// Something that the check has found.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// Its stable code.
    pub code: &'static str,
    /// `error`, `warning` or `note`.
    pub severity: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
    /// In which file.
    pub file: PathBuf,
    /// In which line, from 1.
    pub line: usize,
    /// In which column, from 1.
    pub column: usize,
    /// The components concerned.
    pub components: Vec<String>,
    /// The slots concerned.
    pub slots: Vec<End>,
    /// The connections concerned: indices into the list of connections.
    pub connections: Vec<usize>,
    /// The group concerned.
    pub group: Option<String>,
    /// The host concerned.
    pub host: Option<String>,
}

impl Connection {
    /// What both ends call it.
    pub(crate) fn name(&self) -> String {
        if self.from.slot == self.to.slot {
            self.from.slot.clone()
        } else {
            format!("{} → {}", self.from.slot, self.to.slot)
        }
    }

    /// The whole of it as a sentence.
    pub(crate) fn in_words(&self) -> String {
        let verb = match self.kind {
            Kind::Call => "calls",
            Kind::Topic => "sends to",
        };
        let address = self.address.as_ref();
        let address = address.map_or("refused".to_owned(), |a| format!("at {a}"));
        format!(
            "{}.{} {verb} {}.{}: {} over {}, {address}",
            self.from.component,
            self.from.slot,
            self.to.component,
            self.to.slot,
            self.interface,
            self.middleware
        )
    }

    /// The ends as numbers of components and slots: who provides, and who consumes.
    pub(crate) fn provider_and_consumer(&self) -> ((usize, usize), (usize, usize)) {
        match self.kind {
            Kind::Call => (self.to.at, self.from.at),
            Kind::Topic => (self.from.at, self.to.at),
        }
    }
}

/// What a place in a `.ddsl` belongs to.
#[derive(Clone, Copy, Debug)]
enum Owner {
    Instance(usize),
    Group(usize),
    Host(usize),
    Network,
}

impl Network {
    /// The network as a picture, with what was found about it.
    pub fn graph(&self, sources: &SourceMap, found: &Diagnostics) -> Graph {
        let instances = self.deployment.instances.iter().enumerate();
        let components = instances.map(|(at, _)| self.drawn(at)).collect();
        let connections = self.drawn_connections();
        Graph {
            network: self.name().to_owned(),
            ddsl: self.path.clone(),
            hosts: self.hosts(),
            groups: self
                .deployment
                .groups
                .iter()
                .map(|group| Group {
                    name: group.path.clone(),
                    parent: group.parent.map(|p| self.deployment.groups[p].path.clone()),
                    exports: group.exports.iter().map(|e| e.text.clone()).collect(),
                })
                .collect(),
            components,
            findings: self.drawn_findings(sources, found, &connections),
            connections: connections.into_iter().map(|(_, c)| c).collect(),
        }
    }

    /// The name of the machine that an instance runs on.
    pub(crate) fn host_name(&self, at: usize) -> &str {
        let host = self.deployment.instances[at].host;
        host.map_or("localhost", |(host, _)| {
            &self.deployment.hosts[host].name.text
        })
    }

    /// The machines on which something runs.
    pub(crate) fn hosts(&self) -> Vec<Host> {
        let used: BTreeSet<Option<usize>> = self
            .deployment
            .instances
            .iter()
            .map(|i| i.host.map(|(host, _)| host))
            .collect();
        used.into_iter()
            .map(|host| {
                let host = host.map(|host| &self.deployment.hosts[host]);
                Host {
                    name: host.map_or("localhost", |h| &h.name.text).to_owned(),
                    address: host.map_or("localhost", |h| &h.address.text).to_owned(),
                    user: host.and_then(|h| Some(h.user.as_ref()?.text.clone())),
                }
            })
            .collect()
    }

    fn drawn(&self, at: usize) -> Component {
        let instance = &self.deployment.instances[at];
        let component = self.projects[at].as_ref().map(|p| &p.component);
        let slots = component
            .iter()
            .flat_map(|c| c.slots.iter().map(move |s| (c, s)));
        Component {
            name: instance.path.clone(),
            component: component.map(|c| c.name.text.clone()),
            group: instance
                .group
                .map(|g| self.deployment.groups[g].path.clone()),
            host: self.host_name(at).to_owned(),
            middleware: instance.middleware.word(),
            slots: slots
                .map(|(component, slot)| Slot {
                    name: slot.name.clone(),
                    interface: component.library.interface_path(slot.interface),
                    role: slot.role.word(),
                    middleware: slot.backend.unwrap_or(instance.middleware).word(),
                })
                .collect(),
        }
    }

    fn drawn_end(&self, end: Endpoint) -> End {
        End {
            component: self.deployment.instances[end.instance].path.clone(),
            slot: self.slot(end).map_or_else(String::new, |s| s.name.clone()),
            at: (end.instance, end.slot),
        }
    }

    /// All connections, also those that are refused, as far as they go from a provider to a consumer.
    pub(crate) fn drawn_connections(&self) -> Vec<(Pair, Connection)> {
        let provides = |end: Endpoint| {
            let role = self.slot(end).map(|s| s.role);
            role.map(|r| matches!(r, Role::Implements | Role::Publishes))
        };
        let refused = self.connections.diagnostics.iter().filter_map(|found| {
            let (one, other) = (found.endpoint, found.peer?);
            match (provides(one)?, provides(other)?) {
                (false, true) => Some((one, other)),
                (true, false) => Some((other, one)),
                _ => None,
            }
        });
        let refused = refused.map(|(consumer, provider)| Pair { consumer, provider });
        let made: BTreeSet<Pair> = self.connections.connections.iter().copied().collect();
        let all: BTreeSet<Pair> = refused.chain(made.iter().copied()).collect();
        let addresses = self.addresses();
        all.into_iter()
            .filter_map(|pair| {
                let slot = self.slot(pair.provider)?;
                let component = &self.projects[pair.provider.instance].as_ref()?.component;
                let instance = &self.deployment.instances[pair.consumer.instance];
                let own = self.slot(pair.consumer)?.backend;
                let kind = if slot.role.is_topic() {
                    Kind::Topic
                } else {
                    Kind::Call
                };
                let (from, to) = match kind {
                    Kind::Topic => (pair.provider, pair.consumer),
                    Kind::Call => (pair.consumer, pair.provider),
                };
                let connection = Connection {
                    from: self.drawn_end(from),
                    to: self.drawn_end(to),
                    interface: component.library.interface_path(slot.interface),
                    kind,
                    middleware: own.unwrap_or(instance.middleware).word(),
                    address: made
                        .contains(&pair)
                        .then(|| addresses.get(&pair.consumer).cloned())
                        .flatten(),
                };
                Some((pair, connection))
            })
            .collect()
    }

    /// Where in the files what begins. Between two such places all belongs to the first one.
    fn owners(&self) -> BTreeMap<(SourceId, usize), Owner> {
        let deployment = &self.deployment;
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
        let instances = deployment.instances.iter().enumerate();
        owners.extend(instances.map(|(n, i)| (at(i.name.span), Owner::Instance(n))));
        owners
    }

    fn drawn_findings(
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
        // Components that read one wrong file each find the same.
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
        let instance = &self.deployment.instances[at];
        match (&instance.config, &self.projects[at]) {
            (Some(named), _) => instance.folder.join(&named.text) == file,
            (None, Some(project)) => project.folder().join("etc/config.toml") == file,
            (None, None) => false,
        }
    }

    /// Notes what a finding is about: slots and connections where it says so, else what stands at its place.
    fn blame(
        &self,
        diagnostic: &Diagnostic,
        owners: &BTreeMap<(SourceId, usize), Owner>,
        numbers: &BTreeMap<Pair, usize>,
        finding: &mut Finding,
    ) {
        let diagnostics = self.connections.diagnostics.iter();
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
                finding.slots.extend(ends.map(|end| self.drawn_end(end)));
            }
        }
        if !diagnostics.is_empty() {
            return;
        }
        let span = diagnostic.span;
        let components = &mut finding.components;
        let mut name = |at: &usize| {
            let name = &self.deployment.instances[*at].path;
            if !components.contains(name) {
                components.push(name.clone());
            }
        };
        let made_of = self.texts.get(&finding.file).into_iter().flatten().copied();
        let configured =
            (0..self.projects.len()).filter(|at| self.is_configured_by(*at, &finding.file));
        let instances: BTreeSet<usize> = made_of.chain(configured).collect();
        if !instances.is_empty() {
            instances.iter().for_each(&mut name);
            return;
        }
        let before = owners.range(..=(span.source, span.start)).next_back();
        match before.filter(|((source, _), _)| *source == span.source) {
            Some((_, Owner::Instance(at))) => name(at),
            Some((_, Owner::Group(at))) => {
                finding.group = Some(self.deployment.groups[*at].path.clone());
            }
            Some((_, Owner::Host(at))) => {
                finding.host = Some(self.deployment.hosts[*at].name.text.clone());
            }
            Some((_, Owner::Network)) | None => {}
        }
    }
}

impl Host {
    /// `host robot (pi@10.0.0.2)`
    pub(crate) fn title(&self) -> String {
        let user = self
            .user
            .as_ref()
            .map_or(String::new(), |u| format!("{u}@"));
        if self.name == self.address && user.is_empty() {
            format!("host {}", self.name)
        } else {
            format!("host {} ({user}{})", self.name, self.address)
        }
    }
}

impl Component {
    /// What it is called in its `.cdsl`, where that is not its own name.
    pub(crate) fn kind(&self) -> Option<&str> {
        let own = Graph::own_name(&self.name);
        self.component.as_deref().filter(|kind| *kind != own)
    }
}

impl Graph {
    /// Whether the network may be used.
    pub fn has_errors(&self) -> bool {
        let error = Severity::Error.name();
        self.findings.iter().any(|f| f.severity == error)
    }

    /// The part of a whole name that a component or group has by itself.
    pub(crate) fn own_name(name: &str) -> &str {
        name.rsplit('.').next().unwrap_or(name)
    }
}
