//! The names in a network: its components, groups, hosts and processes, and the slots and parameters of the
//! components.

use super::{BindName, Collector, GroupName, Kind, SlotOf, Symbol};
use rc_codegen::installed::named_component;
use rc_ddsl::Deployment;
use rc_ddsl::model::{ChainPoint, Host, Instance, InstanceOrGroup, SlotPath};
use rc_diagnostics::{Name, Span};
use rc_vocabulary::member;
use std::path::{Path, PathBuf};

impl Collector<'_> {
    pub(super) fn network(&mut self, network: &Deployment) {
        let name = &network.name;
        self.declares(Kind::Network, name, name.text.as_str());
        for (span, source) in &network.imports {
            let file = self.file(*source);
            self.names.networks.push(file.clone());
            self.refers(*span, Self::whole(file));
        }
        for at in 0..network.hosts.len() {
            let name = host_name(&network.hosts, at);
            self.declares(Kind::Host, &network.hosts[at].name, name);
        }
        let mut groups: Vec<GroupName> = Vec::new();
        groups.resize_with(network.groups.len(), GroupName::default);
        for instance in &network.instances {
            if let Some(at) = instance.group {
                groups[at].components.extend(self.cdsl(instance));
            }
        }
        for (group, known) in network.groups.iter().zip(&mut groups) {
            self.declares(Kind::Group, &group.name, group.path.as_str());
            for export in &group.exports {
                self.of_group(export.span, &group.path, &export.text);
                known.exports.push(export.text.clone());
            }
        }
        for group in &network.groups {
            if let Some(parent) = group.parent {
                groups[parent].groups.push(group.path.clone());
            }
        }
        let paths = network.groups.iter().map(|group| group.path.clone());
        self.names.groups = paths.zip(groups).collect();
        for process in &network.processes {
            self.declares(Kind::Process, &process.name, process.path.as_str());
        }
        // The proxy of a group has the name of the group, and nothing of its own.
        let declared = network.instances.iter();
        for instance in declared.filter(|instance| instance.proxy.is_none()) {
            self.instance(network, instance);
        }
        for (span, place) in &network.references {
            let symbol = match seen(network, *place) {
                InstanceOrGroup::Instance(at) => self.of_instance(&network.instances[at]),
                InstanceOrGroup::Group(at) => {
                    let group = &network.groups[at];
                    self.symbol(Kind::Group, group.name.span.source, group.path.as_str())
                }
            };
            self.refers(*span, symbol);
        }
        for bind in &network.binds {
            self.slot_path(network, &bind.consumer);
            for frames in &bind.frames {
                self.frames(network, &bind.consumer, frames);
            }
            if let Some(provider) = &bind.provider {
                self.slot_path(network, provider);
                self.bind(network, &bind.consumer, provider);
            }
        }
        for external in &network.externals {
            self.slot_path(network, &external.slot);
            if let Some(peer) = &external.peer {
                self.beside(&peer.folder, &peer.cdsl);
                for frames in &peer.convert.frames {
                    self.frames(network, &external.slot, frames);
                }
            }
        }
        for chain in &network.chains {
            let ends = [&chain.from, &chain.to].into_iter();
            let outside = chain.outside.iter().flat_map(|of| [&of.from, &of.to]);
            for point in ends.chain(&chain.through).chain(outside) {
                self.chain_point(network, point);
            }
        }
    }

    fn of_instance(&self, instance: &Instance) -> Symbol {
        let source = instance.name.span.source;
        self.symbol(Kind::Instance, source, instance.path.as_str())
    }

    fn instance(&mut self, network: &Deployment, instance: &Instance) {
        self.declares(Kind::Instance, &instance.name, instance.path.as_str());
        let files = [&instance.cdsl, &instance.executable, &instance.config];
        for file in files.into_iter().flatten() {
            self.beside(&instance.folder, file);
        }
        if let Some((at, span)) = instance.host {
            let source = network.hosts[at].name.span.source;
            let symbol = self.symbol(Kind::Host, source, host_name(&network.hosts, at));
            self.refers(span, symbol);
        }
        if let Some(name) = &instance.process {
            let declared = network.processes.iter().find(|p| p.path == name.text);
            if let Some(process) = declared.filter(|process| process.name.span != name.span) {
                let source = process.name.span.source;
                let symbol = self.symbol(Kind::Process, source, process.path.as_str());
                self.refers(name.span, symbol);
            }
        }
        let Some(cdsl) = self.cdsl(instance) else {
            return;
        };
        self.names
            .instances
            .push((instance.path.clone(), cdsl.clone()));
        for parameter in &instance.parameters {
            let symbol = Symbol {
                file: cdsl.clone(),
                kind: Kind::OfComponent,
                name: without_indices(&parameter.path.text),
            };
            self.refers(parameter.path.span, symbol);
        }
        for array in &instance.arrays {
            self.of_component(array.name.span, &cdsl, &array.name.text);
            for member in &array.members {
                let path = format!("{}.{}.{}", instance.path, array.name.text, member.text);
                self.declares(Kind::ArrayMember, member, path);
            }
        }
    }

    /// The slot of the consumer's component that knows where frames are.
    fn frames(&mut self, network: &Deployment, consumer: &SlotPath, frames: &Name) {
        let array = |text: &str| {
            let array = member::split(text).map_or(text, |(array, _)| array);
            array.to_owned()
        };
        let own = array(&frames.text);
        let span = Span::new(
            frames.span.source,
            frames.span.start,
            frames.span.start + own.len(),
        );
        match consumer.place {
            InstanceOrGroup::Instance(at) => {
                if let Some(cdsl) = self.cdsl(&network.instances[at]) {
                    self.of_component(span, &cdsl, &own);
                }
            }
            InstanceOrGroup::Group(at) => {
                let (group, exported) = (&network.groups[at].path, array(&consumer.slot.text));
                let symbol = Symbol {
                    file: self.path.to_path_buf(),
                    kind: Kind::BesideExport,
                    name: format!("{group}.{exported}/{own}"),
                };
                self.refers(span, symbol);
            }
        }
    }

    fn bind(&mut self, network: &Deployment, consumer: &SlotPath, provider: &SlotPath) {
        let slot = |path: &SlotPath| {
            let place = match path.place {
                InstanceOrGroup::Instance(at) => &network.instances[at].path,
                InstanceOrGroup::Group(at) => &network.groups[at].path,
            };
            SlotOf {
                place: place.clone(),
                slot: path.slot.text.clone(),
            }
        };
        let file = self.files.get(&provider.span.source);
        if file.is_some_and(|file| file == self.path) && !self.is_full() {
            let (consumer, end) = (slot(consumer), provider.span.end);
            let provider = slot(provider);
            self.names.binds.push(BindName {
                consumer,
                provider,
                end,
            });
        }
    }

    /// The slot and the operation of a step of a chain.
    fn chain_point(&mut self, network: &Deployment, point: &ChainPoint) {
        let Some((slot, operation)) = &point.operation else {
            return;
        };
        let path = SlotPath {
            place: seen(network, InstanceOrGroup::Instance(point.instance)),
            slot: slot.clone(),
            span: point.span,
        };
        self.slot_path(network, &path);
        if let Some(cdsl) = self.cdsl(&network.instances[point.instance]) {
            let name = member::split(&slot.text).map_or(slot.text.as_str(), |(array, _)| array);
            let symbol = Symbol {
                file: cdsl,
                kind: Kind::OfSlot,
                name: format!("{name}.{}", operation.text),
            };
            self.refers(operation.span, symbol);
        }
    }

    /// The slot at the end of a path, or the array and its member.
    fn slot_path(&mut self, network: &Deployment, path: &SlotPath) {
        let Name { text, span } = &path.slot;
        let Some((array, member)) = member::split(text) else {
            return self.slot_of(network, path, *span, text);
        };
        let end = span.start + array.len();
        let of_array = Span::new(span.source, span.start, end);
        self.slot_of(network, path, of_array, array);
        let inside = &network.instances[network.instances_of(path.place)];
        let start = span.end - member.len();
        let members = inside.iter().map(|instance| {
            let name = format!("{}.{array}.{member}", instance.path);
            self.symbol(Kind::ArrayMember, instance.name.span.source, name)
        });
        let members = members.collect();
        self.add(Span::new(span.source, start, span.end), members, false);
    }

    /// A slot of the component, or of the group, that a path names.
    fn slot_of(&mut self, network: &Deployment, path: &SlotPath, span: Span, name: &str) {
        match path.place {
            InstanceOrGroup::Instance(at) => {
                if let Some(cdsl) = self.cdsl(&network.instances[at]) {
                    self.of_component(span, &cdsl, name);
                }
            }
            InstanceOrGroup::Group(at) => self.of_group(span, &network.groups[at].path, name),
        }
    }

    /// The file of a component.
    fn cdsl(&mut self, instance: &Instance) -> Option<PathBuf> {
        let cdsl = instance.cdsl.as_ref()?;
        Some(self.keys.of(&named_component(&instance.folder, &cdsl.text)))
    }

    fn of_component(&mut self, span: Span, cdsl: &Path, name: &str) {
        let symbol = Symbol {
            file: cdsl.to_path_buf(),
            kind: Kind::Slot,
            name: name.to_owned(),
        };
        self.refers(span, symbol);
    }

    /// Which component inside has the slot, the slots of all of them say.
    fn of_group(&mut self, span: Span, group: &str, name: &str) {
        let symbol = Symbol {
            file: self.path.to_path_buf(),
            kind: Kind::OfGroup,
            name: format!("{group}.{name}"),
        };
        self.refers(span, symbol);
    }
}

/// The name of a host, with a number where other groups of its file have hosts of this name.
fn host_name(hosts: &[Host], at: usize) -> String {
    let Name { text, span } = &hosts[at].name;
    let same = |host: &&Host| host.name.text == *text && host.name.span.source == span.source;
    format!("{text}#{}", hosts[..at].iter().filter(same).count())
}

/// A place as the file writes it: of a proxy, its group.
fn seen(network: &Deployment, place: InstanceOrGroup) -> InstanceOrGroup {
    let proxied = match place {
        InstanceOrGroup::Instance(at) => network.instances[at].proxy,
        InstanceOrGroup::Group(_) => None,
    };
    proxied.map_or(place, InstanceOrGroup::Group)
}

/// `motors[2].max` without the numbers of elements.
fn without_indices(path: &str) -> String {
    let steps = path.split('.');
    let steps = steps.map(|step| step.split('[').next().unwrap_or(step));
    steps.collect::<Vec<_>>().join(".")
}
