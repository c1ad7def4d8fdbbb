//! The connections of networks. `rcdeploy check` reads all components of a network at once; here they are
//! read one after another, and a message of the editor goes first.

use super::file_key::Keys;
use super::names::{Kind, Symbol};
use rc_cdsl::Component;
use rc_codegen::{FileLoader, Project, paths};
use rc_ddsl::{Connection, Deployment, Endpoint};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_syntax::Name;
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// A network whose components are being read.
pub(super) struct Wiring {
    /// The `.ddsl`.
    pub(super) path: PathBuf,
    sources: SourceMap,
    deployment: Deployment,
    /// The components that were read, in the order of the instances.
    components: Vec<Option<Rc<Project>>>,
    /// Those of programs outside, in the order of the external slots.
    peers: Vec<Option<Rc<Project>>>,
    known: HashMap<PathBuf, Option<Rc<Project>>>,
    /// The file of each instance, and of each source.
    files: Vec<Option<PathBuf>>,
    pub(super) sources_files: HashMap<SourceId, PathBuf>,
    keys: Keys,
    found: Diagnostics,
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
    /// Its address, unless a configuration has another one.
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

    /// Forgets the connections of a network that has errors, or is a part of another one.
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

    /// Reads the next component of a network. Returns the network after its last component.
    pub(super) fn read_next(&mut self, loader: &FileLoader) -> Option<Wiring> {
        let wiring = self.wirings.front_mut()?;
        if wiring.read_next(loader) {
            return None;
        }
        self.wirings.pop_front()
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

/// The components of projects.
fn described(projects: &[Option<Rc<Project>>]) -> Vec<Option<&Component>> {
    let each = projects.iter().map(Option::as_deref);
    each.map(|project| Some(&project?.component)).collect()
}

impl Wiring {
    /// A network of which no component is read yet.
    pub(super) fn new(path: &Path, sources: SourceMap, deployment: Deployment) -> Self {
        Self {
            path: path.to_path_buf(),
            sources,
            deployment,
            components: Vec::new(),
            peers: Vec::new(),
            known: HashMap::new(),
            files: Vec::new(),
            sources_files: HashMap::new(),
            keys: Keys::default(),
            found: Diagnostics::new(),
        }
    }

    /// Reads the component of the next instance, or of the next external slot. Returns whether there
    /// was one.
    pub(super) fn read_next(&mut self, loader: &FileLoader) -> bool {
        let new = self.sources.ids().skip(self.sources_files.len());
        for id in new {
            let key = self.keys.of(self.sources.path(id));
            self.sources_files.insert(id, key);
        }
        let at = self.components.len();
        let Some(instance) = self.deployment.instances.get(at) else {
            let Some(external) = self.deployment.externals.get(self.peers.len()) else {
                self.make_proxies(loader);
                return false;
            };
            let peer = external.peer.as_ref();
            let file = peer.map(|peer| (peer.folder.join(&peer.cdsl.text), peer.cdsl.clone()));
            let component = file.and_then(|(file, named)| self.component(&file, &named, loader));
            self.peers.push(component);
            return true;
        };
        let Some(named) = instance.cdsl.clone() else {
            self.components.push(None);
            self.files.push(None);
            return true;
        };
        let file = instance.folder.join(&named.text);
        let component = self.component(&file, &named, loader);
        let instance = &mut self.deployment.instances[at];
        let network = &self.deployment.name.text;
        let component = component.map(|mut project| {
            let declared = &project.component;
            let expanded = rc_ddsl::expand(network, instance, declared, &mut self.found);
            if let Some(component) = expanded {
                Rc::make_mut(&mut project).component = component;
            }
            project
        });
        self.components.push(component);
        self.files.push(Some(self.keys.of(&file)));
        true
    }

    /// Makes the components of proxies, which have no files.
    fn make_proxies(&mut self, loader: &FileLoader) {
        let tools = (&mut self.sources, loader as _);
        rc_codegen::proxies::make(
            &mut self.deployment,
            &mut self.components,
            tools,
            &mut self.found,
        );
    }

    /// The component of a file. Reports a file that cannot be read.
    fn component(&mut self, file: &Path, named: &Name, loader: &FileLoader) -> Option<Rc<Project>> {
        let path = paths::normal(file);
        if let Some(known) = self.known.get(&path) {
            return known.clone();
        }
        let component = match Project::load(&path, &mut self.sources, loader) {
            Ok((project, more)) => {
                let project = project.filter(|_| !more.has_errors());
                self.found.extend(more);
                project.map(Rc::new)
            }
            Err(error) => {
                let message = format!("`{}` cannot be read: {error}", named.text);
                let error = Diagnostic::error("component-not-found", named.span, message);
                let error = error.help("the path is relative to this file");
                self.found.push(error);
                None
            }
        };
        self.known.insert(path, component.clone());
        component
    }

    /// The connections, and all that is wrong with them and the components.
    pub(super) fn connected(&self) -> (Wired, &SourceMap, Diagnostics) {
        let mut components = described(&self.components);
        let mut found = Diagnostics::new();
        found.extend(self.found.iter().cloned());
        let mut deployment = self.deployment.clone();
        let peers = described(&self.peers);
        let all = [components.as_slice(), &peers].concat();
        let adaptors = rc_ddsl::add_adaptors(&mut deployment, &all, &mut found);
        components.extend(adaptors.iter().map(|adaptor| Some(&adaptor.component)));
        let all = [components.as_slice(), &peers].concat();
        let (network, more) = rc_ddsl::connect(&deployment, &all);
        found.extend(more);
        let mut ends: HashMap<Endpoint, End> = HashMap::new();
        let mut all = Vec::new();
        for (number, component) in components.iter().enumerate() {
            let instance = &deployment.instances[number];
            let Some(component) = component else { continue };
            let Some(file) = self.files.get(number).cloned().flatten() else {
                continue;
            };
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
            let behind = rc_ddsl::proxied(&deployment, &components, number);
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
        let leaders = network.leaders(&components);
        let address = |end: &Endpoint| {
            let leader = leaders.get(end).unwrap_or(end);
            let instance = deployment.instances.get(leader.instance)?;
            let slot = components
                .get(leader.instance)?
                .as_ref()?
                .slots
                .get(leader.slot)?;
            let component = instance.path.replace('.', "/");
            Some(format!(
                "{}/{component}/{}",
                deployment.name.text,
                slot.path()
            ))
        };
        // The file has no adaptors: the provider that the file names is behind one.
        let behind = |end: Endpoint| {
            let mut all = network.connections.iter();
            let is_adaptor = deployment.instances[end.instance].adaptor.is_some();
            let own = |of: &&Connection| is_adaptor && of.consumer.instance == end.instance;
            all.find(own).map_or(end, |of| of.provider)
        };
        let joined = |connection: &Connection| {
            let middleware = network.transports.get(connection);
            Some(Joined {
                consumer: ends.get(&connection.consumer)?.clone(),
                provider: ends.get(&behind(connection.provider))?.clone(),
                middleware: middleware.map(|middleware| middleware.word()),
                address: address(&connection.consumer)?,
            })
        };
        let wired = Wired {
            network: self.deployment.name.text.clone(),
            connections: network.connections.iter().filter_map(joined).collect(),
            ends: all,
        };
        (wired, &self.sources, found)
    }
}
