//! Networks, checked as `rcdeploy check` does. That reads all components of a network at once; here they
//! are read one after another, and a message of the editor goes first.

use super::file_key::Keys;
use super::names::{Kind, Symbol};
use rc_cdsl::Component;
use rc_codegen::FileLoader;
use rc_codegen::installed::named_component;
use rc_ddsl::{Connection, Deployment, Endpoint};
use rc_deploy_network::{Network, Overrides, Reading};
use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::path::{Path, PathBuf};

/// A network whose components are being read.
pub(super) struct Wiring {
    /// The `.ddsl`.
    path: PathBuf,
    sources: SourceMap,
    reading: Reading,
}

/// A network that was checked.
pub(super) struct Checked {
    pub(super) wired: Wired,
    pub(super) sources: SourceMap,
    /// The file of each source.
    pub(super) keys: HashMap<SourceId, PathBuf>,
    /// Further files whose contents were checked.
    pub(super) files: Vec<PathBuf>,
    /// All that is wrong, without the findings of the text of the `.ddsl` alone.
    pub(super) found: Diagnostics,
}

/// A slot of a network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct End {
    /// `COMPONENT.SLOT`
    pub(super) path: String,
    /// The slot in its `.cdsl`; the array of a member.
    pub(super) slot: Symbol,
    /// `Module::Name`
    pub(super) interface: String,
}

/// A connection of two slots.
#[derive(Clone, Debug)]
pub(super) struct Joined {
    pub(super) consumer: End,
    pub(super) provider: End,
    /// The middleware of the connection.
    pub(super) middleware: Option<&'static str>,
    /// Its address.
    pub(super) address: String,
}

/// The connections of a network.
#[derive(Debug, Default)]
pub(super) struct Wired {
    pub(super) network: String,
    pub(super) connections: Vec<Joined>,
    /// All slots.
    pub(super) ends: Vec<End>,
}

/// The networks: those whose components are being read, and the last findings.
#[derive(Default)]
pub(super) struct Networks {
    wirings: VecDeque<Wiring>,
    wired: BTreeMap<PathBuf, Wired>,
}

impl Networks {
    /// Whether a network waits for its connections.
    pub(super) fn is_waiting(&self) -> bool {
        !self.wirings.is_empty()
    }

    /// Whether the connections of all networks were known a moment ago.
    pub(super) fn are_known(&self) -> bool {
        let mut waiting = self.wirings.iter();
        waiting.all(|wiring| self.wired.contains_key(&wiring.path))
    }

    /// Reads no further component.
    pub(super) fn stop(&mut self) {
        self.wirings.clear();
    }

    /// Forgets the connections of a network that cannot be parsed, or is a part of another one.
    pub(super) fn forget(&mut self, network: &Path) {
        self.wirings.retain(|wiring| wiring.path != network);
        self.wired.remove(network);
    }

    /// Computes the connections of a network as soon as nothing else waits. Until then, those that
    /// it had are known.
    pub(super) fn begin(&mut self, wiring: Wiring) {
        self.wirings.retain(|other| other.path != wiring.path);
        self.wirings.push_back(wiring);
    }

    /// Reads the next component of a network. After its last component, checks the network and
    /// returns it with its `.ddsl`.
    pub(super) fn read_next(&mut self, loader: &FileLoader) -> Option<(PathBuf, Checked)> {
        let wiring = self.wirings.front_mut()?;
        if wiring.read_next(loader) {
            return None;
        }
        let wiring = self.wirings.pop_front()?;
        Some((wiring.path.clone(), wiring.check(loader)))
    }

    /// Takes the connections of a network.
    pub(super) fn put(&mut self, network: &Path, wired: Wired) {
        self.wired.insert(network.to_path_buf(), wired);
    }

    /// The connections of a network.
    pub(super) fn get(&self, network: &Path) -> Option<&Wired> {
        self.wired.get(network)
    }

    /// The connections of all networks.
    pub(super) fn wired(&self) -> impl Iterator<Item = &Wired> {
        self.wired.values()
    }
}

impl Wiring {
    /// A network of which no component is read yet.
    pub(super) fn new(path: &Path, sources: SourceMap, deployment: Deployment) -> Self {
        Self {
            path: path.to_path_buf(),
            sources,
            reading: Reading::new(path, deployment),
        }
    }

    /// Reads the component of the next instance, or of the next external slot. Returns whether there
    /// was one.
    fn read_next(&mut self, loader: &FileLoader) -> bool {
        self.reading.read_next(&mut self.sources, loader)
    }

    /// Reads all components that were not read yet, and checks the network.
    pub(super) fn check(mut self, loader: &FileLoader) -> Checked {
        while self.read_next(loader) {}
        let overrides = Overrides::default();
        let (network, found) = self.reading.check(&overrides, &mut self.sources, loader);
        let mut known = Keys::default();
        let wired = wired(&network, &mut known);
        let ids = self.sources.ids();
        let keys = ids.map(|id| (id, known.of(self.sources.path(id))));
        Checked {
            wired,
            keys: keys.collect(),
            files: network.files.iter().map(|file| known.of(file)).collect(),
            sources: self.sources,
            found,
        }
    }
}

/// The slots and connections of a network.
fn wired(network: &Network, keys: &mut Keys) -> Wired {
    let deployment = &network.deployment;
    let components = network.projects.iter().map(Option::as_deref);
    let components = components.map(|project| Some(&project?.component));
    let components: Vec<Option<&Component>> = components.collect();
    let mut ends: HashMap<Endpoint, End> = HashMap::new();
    let mut all = Vec::new();
    for (number, component) in components.iter().enumerate() {
        let instance = &deployment.instances[number];
        let Some(component) = component else { continue };
        let is_made = instance.adaptor.is_some() || instance.proxy.is_some();
        let Some(cdsl) = instance.cdsl.as_ref().filter(|_| !is_made) else {
            continue;
        };
        let file = keys.of(&named_component(&instance.folder, &cdsl.text));
        for (slot, described) in component.slots.iter().enumerate() {
            let array = rc_vocabulary::member::split(&described.name);
            let name = array.map_or(described.name.as_str(), |(array, _)| array);
            let end = End {
                path: format!("{}.{}", instance.path, described.name),
                slot: Symbol {
                    file: file.clone(),
                    kind: Kind::Slot,
                    name: name.to_owned(),
                },
                interface: component.library.interface_path(described.interface),
            };
            let instance = number;
            ends.insert(Endpoint { instance, slot }, end.clone());
            all.push(end);
        }
    }
    // A slot of a proxy is declared where the slot behind it is.
    for (number, group) in deployment.groups.iter().enumerate().rev() {
        let Some(proxy) = &group.proxy else { continue };
        let behind = rc_ddsl::proxied(deployment, &components, number);
        let instance = proxy.instance;
        let slots = components[instance].map_or(&[][..], |made| &made.slots);
        for (slot, own) in slots.iter().enumerate() {
            let inside = behind.get(slot % behind.len().max(1));
            let Some(inside) = inside.and_then(|(_, inside)| ends.get(inside)).cloned() else {
                continue;
            };
            let path = format!("{}.{}", group.path, own.name);
            let end = End { path, ..inside };
            ends.insert(Endpoint { instance, slot }, end.clone());
            if slot < behind.len() {
                all.push(end);
            }
        }
    }
    let connections = &network.connections;
    // The file has no adaptors: the provider that the file names is behind one.
    let behind = |end: Endpoint| {
        let mut all = connections.connections.iter();
        let is_adaptor = deployment.instances[end.instance].adaptor.is_some();
        let own = |of: &&Connection| is_adaptor && of.consumer.instance == end.instance;
        all.find(own).map_or(end, |of| of.provider)
    };
    let joined = |connection: &Connection| {
        let middleware = connections.transports.get(connection);
        Some(Joined {
            consumer: ends.get(&connection.consumer)?.clone(),
            provider: ends.get(&behind(connection.provider))?.clone(),
            middleware: middleware.map(|middleware| middleware.word()),
            address: network.address(connection.consumer)?.to_owned(),
        })
    };
    Wired {
        network: network.name().to_owned(),
        connections: connections.connections.iter().filter_map(joined).collect(),
        ends: all,
    }
}
