//! Machines and connections of a network, for the preview and the picture.

use crate::chains::Port;
use crate::model::Network;
use crate::sites::{CrossTool, Site};
use rc_cdsl::model::{Role, Slot};
use rc_ddsl::conversion::Conversion;
use rc_ddsl::model::Processor;
use rc_ddsl::{Connection as Pair, Endpoint};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// A machine.
#[derive(Clone, Debug, Serialize)]
pub struct Host {
    /// Name of the host, unique in the network.
    pub name: String,
    /// Host name or IP address.
    pub address: String,
    /// The user there, if the file names one.
    pub user: Option<String>,
    /// Where its programs are built, if not as those of this machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub build: Option<HostBuild>,
}

/// Where the programs of a host are built.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct HostBuild {
    /// Its processor: `arm64`. `None`: as the host says of itself.
    pub arch: Option<&'static str>,
    /// `here` or `there`.
    pub place: &'static str,
    /// The platform of rustc, if they are built here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub platform: Option<&'static str>,
    /// What links them, if they are built here and this machine can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub linker: Option<CrossTool>,
    /// The number of jobs of cargo, if they are built there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jobs: Option<u16>,
    /// The niceness of cargo, if they are built there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nice: Option<u8>,
}

impl HostBuild {
    /// Where the programs of a host are built. `None`: as those of this machine.
    fn of(network: &Network, host: usize) -> Option<Self> {
        let declared = &network.deployment.hosts[host];
        let arch = network.programs.processor(host).map(Processor::word);
        match network.programs.site_of_host(host) {
            Site::Own => None,
            Site::Cross(processor) => Some(Self {
                arch,
                place: "here",
                platform: Some(processor.platform()),
                linker: network.programs.cross_tool(processor),
                jobs: None,
                nice: None,
            }),
            Site::There(_) => Some(Self {
                arch,
                place: "there",
                platform: None,
                linker: None,
                jobs: declared.build.jobs,
                nice: Some(declared.build.nice),
            }),
        }
    }
}

/// For people.
impl fmt::Display for HostBuild {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(arch) = self.arch {
            write!(f, "{arch}, ")?;
        }
        write!(f, "its programs are built {}", self.place)?;
        if let Some(platform) = self.platform {
            write!(f, " for {platform}")?;
        }
        if let Some(linker) = self.linker {
            write!(f, ", linked with {linker}")?;
        }
        if let Some(jobs) = self.jobs {
            write!(f, ", {jobs} at once")?;
        }
        if let Some(nice) = self.nice.filter(|nice| *nice > 0) {
            write!(f, ", with niceness {nice}")?;
        }
        Ok(())
    }
}

/// Calls or samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Requests and replies.
    Call,
    /// Samples, from publishers to subscribers.
    Topic,
}

/// One endpoint of a connection.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct End {
    /// The full name of a component. The address of an end that is not part of the network.
    pub component: String,
    /// One of its slots. The interface of an end that is not part of the network.
    pub slot: String,
    /// Whether it is not part of the network.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub external: bool,
    /// The indices of component and slot.
    #[serde(skip)]
    pub at: (usize, usize),
}

/// A peer that is not part of the network.
#[derive(Clone, Debug)]
pub struct External {
    /// Address of the external peer.
    pub address: String,
    /// The interface: `Module::Interface`.
    pub interface: String,
    /// Middleware over which it communicates.
    pub middleware: &'static str,
    /// Whether it carries calls or samples.
    pub kind: Kind,
    /// Whether it calls or subscribes: an adaptor converts for it.
    pub is_consumer: bool,
    /// The slots that connect to it.
    pub slots: Vec<Endpoint>,
}

/// A connection.
#[derive(Clone, Debug, Serialize)]
pub struct Connection {
    /// The client, or the publisher.
    pub from: End,
    /// The server, or the subscriber.
    pub to: End,
    /// The interface: `Module::Interface`.
    pub interface: String,
    /// Whether it carries calls or samples.
    pub kind: Kind,
    /// Middleware over which it communicates.
    pub middleware: &'static str,
    /// Address. `None` if the connection is refused.
    pub address: Option<String>,
    /// The conversion of its consumer: members with their units and factors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub converts: Vec<String>,
    /// The chains whose messages it carries.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub chains: Vec<String>,
}

impl Host {
    /// The machines with components.
    pub fn all(network: &Network) -> Vec<Self> {
        let used: BTreeSet<Option<usize>> = network
            .deployment
            .instances
            .iter()
            .map(|i| i.host.map(|(host, _)| host))
            .collect();
        used.into_iter()
            .map(|at| {
                let host = at.map(|host| &network.deployment.hosts[host]);
                Self {
                    build: at.and_then(|host| HostBuild::of(network, host)),
                    name: host.map_or("localhost", |h| &h.name.text).to_owned(),
                    address: host.map_or("localhost", |h| &h.address.text).to_owned(),
                    user: host.and_then(|h| Some(h.user.as_ref()?.text.clone())),
                }
            })
            .collect()
    }

    /// The name of the machine that an instance runs on.
    pub fn name_of(network: &Network, at: usize) -> &str {
        let host = network.deployment.instances[at].host;
        host.map_or("localhost", |(host, _)| {
            &network.deployment.hosts[host].name.text
        })
    }
}

impl End {
    /// An endpoint with its names.
    pub fn of(network: &Network, end: Endpoint) -> Self {
        Self {
            component: network.deployment.instances[end.instance].path.clone(),
            slot: network
                .slot(end)
                .map_or_else(String::new, |s| s.name.clone()),
            external: false,
            at: (end.instance, end.slot),
        }
    }
}

impl External {
    /// The peers that are not part of the network. Slots with one address, interface and middleware
    /// share a peer.
    pub fn all(network: &Network) -> Vec<Self> {
        let mut peers: BTreeMap<(&str, String, &'static str, bool), Self> = BTreeMap::new();
        for end in network.connections.externals.keys() {
            let Some(slot) = network.slot(*end) else {
                continue;
            };
            let address = network.addresses.of(*end);
            let library = network.projects[end.instance]
                .as_ref()
                .map(|p| &p.component.library);
            let interface = library.map(|library| library.interface_path(slot.interface));
            let interface = interface.unwrap_or_default();
            let middleware = network.middlewares(*end)[0].word();
            let is_consumer = matches!(slot.role, Role::Implements | Role::Publishes);
            let peer = peers.entry((address, interface.clone(), middleware, is_consumer));
            let peer = peer.or_insert_with(|| Self {
                address: address.to_owned(),
                interface,
                middleware,
                kind: kind(slot),
                is_consumer,
                slots: Vec::new(),
            });
            peer.slots.push(*end);
        }
        peers.into_values().collect()
    }
}

impl Connection {
    /// All connections between a provider and a consumer, including refused ones.
    pub fn between(network: &Network) -> Vec<(Pair, Self)> {
        let provides = |end: Endpoint| {
            let role = network.slot(end).map(|s| s.role);
            role.map(|r| matches!(r, Role::Implements | Role::Publishes))
        };
        let refused = network.connections.diagnostics.iter().filter_map(|found| {
            let (one, other) = (found.endpoint, found.peer?);
            match (provides(one)?, provides(other)?) {
                (false, true) => Some((one, other)),
                (true, false) => Some((other, one)),
                _ => None,
            }
        });
        let refused = refused.map(|(consumer, provider)| Pair { consumer, provider });
        let made: BTreeSet<Pair> = network.connections.connections.iter().copied().collect();
        let all: BTreeSet<Pair> = refused.chain(made.iter().copied()).collect();
        all.into_iter()
            .filter_map(|pair| {
                let slot = network.slot(pair.provider)?;
                let component = &network.projects[pair.provider.instance].as_ref()?.component;
                network.slot(pair.consumer)?;
                let own = network.connections.transports.get(&pair).copied();
                let own = own.unwrap_or_else(|| network.middlewares(pair.consumer)[0]);
                let kind = kind(slot);
                let (from, to) = match kind {
                    Kind::Topic => (pair.provider, pair.consumer),
                    Kind::Call => (pair.consumer, pair.provider),
                };
                let connection = Self {
                    from: End::of(network, from),
                    to: End::of(network, to),
                    interface: component.library.interface_path(slot.interface),
                    kind,
                    middleware: own.word(),
                    address: made
                        .contains(&pair)
                        .then(|| network.addresses.of(pair.consumer).to_owned()),
                    converts: converts(network.connections.conversions.get(&pair)),
                    chains: chains_over(network, from, to),
                };
                Some((pair, connection))
            })
            .collect()
    }

    /// The connections to peers that are not part of the network. In the indices of ends, these
    /// peers follow the instances.
    pub fn outside(network: &Network) -> Vec<Self> {
        let externals = External::all(network).into_iter();
        let externals = externals.zip(network.deployment.instances.len()..);
        let connections = externals.flat_map(|(peer, at)| {
            let outside = End {
                component: peer.address.clone(),
                slot: interface_name(&peer.interface).to_owned(),
                external: true,
                at: (at, 0),
            };
            let connection = |end: &Endpoint| {
                let inside = End::of(network, *end);
                let comes_in = (peer.kind == Kind::Call) == peer.is_consumer;
                let (from, to) = if comes_in {
                    (outside.clone(), inside)
                } else {
                    (inside, outside.clone())
                };
                Self {
                    from,
                    to,
                    interface: peer.interface.clone(),
                    kind: peer.kind,
                    middleware: peer.middleware,
                    address: Some(peer.address.clone()),
                    converts: converts(network.connections.conversion(*end)),
                    chains: Vec::new(),
                }
            };
            peer.slots.iter().map(connection).collect::<Vec<_>>()
        });
        connections.collect()
    }
}

/// The other machines with components.
pub fn remote_hosts(network: &Network) -> Vec<crate::plan::Host> {
    let instances = network.deployment.instances.iter();
    let used: BTreeSet<usize> = instances
        .filter_map(|of| of.host.map(|(at, _)| at))
        .collect();
    let hosts = used
        .into_iter()
        .map(|at| (at, &network.deployment.hosts[at]));
    let hosts = hosts.filter(|(_, host)| !host.is_local());
    let mut hosts: Vec<_> = hosts.map(|(at, _)| network.programs.host(at)).collect();
    hosts.sort_by(|one, other| one.name.cmp(&other.name));
    hosts
}

/// The chains with a message between two endpoints.
fn chains_over(network: &Network, from: Endpoint, to: Endpoint) -> Vec<String> {
    let is_at = |port: Port, end: Endpoint| (port.instance, port.slot) == (end.instance, end.slot);
    let over = network.chains.iter().filter(|chain| {
        let mut links = chain.path.links.iter();
        links.any(|link| link.from.is_some_and(|sender| is_at(sender, from)) && is_at(link.to, to))
    });
    over.map(|chain| network.deployment.chains[chain.declared].path.clone())
        .collect()
}

/// A conversion, for people.
fn converts(conversion: Option<&Conversion>) -> Vec<String> {
    let members = conversion.map_or(&[][..], |conversion| &conversion.members);
    members.iter().map(ToString::to_string).collect()
}

fn kind(slot: &Slot) -> Kind {
    if slot.role.is_topic() {
        Kind::Topic
    } else {
        Kind::Call
    }
}

/// The last part of the path of an interface.
pub fn interface_name(path: &str) -> &str {
    path.rsplit("::").next().unwrap_or(path)
}
