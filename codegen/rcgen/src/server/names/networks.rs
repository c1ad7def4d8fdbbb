//! The names in a network: its components, groups, hosts and processes, and the slots and parameters of the
//! components.

use super::{Collector, Kind, Symbol};
use rc_ddsl::Deployment;
use rc_ddsl::model::{Host, Instance, InstanceOrGroup, SlotPath};
use rc_diagnostics::{Name, Span};
use rc_vocabulary::member;
use std::path::PathBuf;

impl Collector<'_> {
    pub(super) fn network(&mut self, network: &Deployment) {
        let name = &network.name;
        self.declares(Kind::Network, name, name.text.as_str());
        for (span, source) in &network.imports {
            let file = self.file(*source);
            self.refers(*span, Self::whole(file));
        }
        for at in 0..network.hosts.len() {
            let name = host_name(&network.hosts, at);
            self.declares(Kind::Host, &network.hosts[at].name, name);
        }
        for group in &network.groups {
            self.declares(Kind::Group, &group.name, group.path.as_str());
            let inside = &network.instances[group.instances.clone()];
            for export in &group.exports {
                let symbols = slots(inside, &export.text);
                self.add(export.span, symbols, false);
            }
            let exports = group.exports.iter().map(|name| name.text.clone());
            self.names
                .exports
                .insert(group.path.clone(), exports.collect());
        }
        for process in &network.processes {
            self.declares(Kind::Process, &process.name, process.path.as_str());
        }
        for instance in &network.instances {
            self.instance(network, instance);
        }
        for (span, place) in &network.references {
            let symbol = match place {
                InstanceOrGroup::Instance(at) => self.of_instance(&network.instances[*at]),
                InstanceOrGroup::Group(at) => {
                    let group = &network.groups[*at];
                    self.symbol(Kind::Group, group.name.span.source, group.path.as_str())
                }
            };
            self.refers(*span, symbol);
        }
        for bind in &network.binds {
            self.slot_path(network, &bind.consumer);
            if let Some(provider) = &bind.provider {
                self.slot_path(network, provider);
            }
        }
        for external in &network.externals {
            self.slot_path(network, &external.slot);
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
        let Some(cdsl) = cdsl(instance) else {
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
            let symbols = slots(std::slice::from_ref(instance), &array.name.text);
            self.add(array.name.span, symbols, false);
            for member in &array.members {
                let path = format!("{}.{}.{}", instance.path, array.name.text, member.text);
                self.declares(Kind::ArrayMember, member, path);
            }
        }
    }

    /// The slot at the end of a path, or the array and its member.
    fn slot_path(&mut self, network: &Deployment, path: &SlotPath) {
        let inside = &network.instances[network.instances_of(path.place)];
        let Name { text, span } = &path.slot;
        let Some((array, member)) = member::split(text) else {
            return self.add(*span, slots(inside, text), false);
        };
        let end = span.start + array.len();
        self.add(
            Span::new(span.source, span.start, end),
            slots(inside, array),
            false,
        );
        let start = span.end - member.len();
        let members = inside.iter().map(|instance| {
            let name = format!("{}.{array}.{member}", instance.path);
            self.symbol(Kind::ArrayMember, instance.name.span.source, name)
        });
        let members = members.collect();
        self.add(Span::new(span.source, start, span.end), members, false);
    }
}

/// A slot of one of `instances`, by its name.
fn slots(instances: &[Instance], name: &str) -> Vec<Symbol> {
    let files = instances.iter().filter_map(cdsl);
    let symbols = files.map(|file| Symbol {
        file,
        kind: Kind::Slot,
        name: name.to_owned(),
    });
    symbols.collect()
}

fn cdsl(instance: &Instance) -> Option<PathBuf> {
    let cdsl = instance.cdsl.as_ref()?;
    Some(super::super::key(&instance.folder.join(&cdsl.text)))
}

/// The name of a host, with a number where other groups of its file have hosts of this name.
fn host_name(hosts: &[Host], at: usize) -> String {
    let Name { text, span } = &hosts[at].name;
    let same = |host: &&Host| host.name.text == *text && host.name.span.source == span.source;
    format!("{text}#{}", hosts[..at].iter().filter(same).count())
}

/// `motors[2].max` without the numbers of elements.
fn without_indices(path: &str) -> String {
    let steps = path.split('.');
    let steps = steps.map(|step| step.split('[').next().unwrap_or(step));
    steps.collect::<Vec<_>>().join(".")
}
