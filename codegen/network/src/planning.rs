//! Makes the plan of a network: processes with all their arguments.

use crate::bounds::Way;
use crate::chains::{CheckedChain, Link, Port};
use crate::configuration::config;
use crate::error::{Error, refused};
use crate::model::Network;
use crate::network_time;
use crate::path_values::named_files;
use crate::plan::{self, Component, Plan};
use crate::planned_chain::{
    LateAction, PlannedChain, PlannedHop, PlannedMessage, PlannedOutside, ReactsIn,
};
use crate::process_name::process_name;
use crate::profile::Profile;
use crate::python_copies::HostFiles;
use crate::world;
use rc_cdsl::model::Slot;
use rc_codegen::Project;
use rc_codegen::paths::normal;
use rc_ddsl::Endpoint;
use rc_ddsl::model::{Late, Setting};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

impl Network {
    /// The settings of the middlewares that an instance uses.
    fn passed_settings(&self, at: usize) -> impl Iterator<Item = &Setting> {
        let used = self.middlewares_of(at);
        let settings = self.passed_settings[at].iter();
        settings.filter(move |set| used.contains(&set.middleware))
    }

    /// The files that a component of the plan needs in addition to its program: its configuration,
    /// and the files that its parameters name.
    pub fn files(&self, at: usize, component: &Component) -> Vec<PathBuf> {
        let mut options = component.args.windows(2);
        let config = options.find(|option| option[0] == "--config");
        let config = config.map(|option| PathBuf::from(&option[1]));
        let directory = Some(component.directory.as_path());
        let named = self.projects[at].as_deref().map(|project| {
            named_files(project, config.as_deref(), &self.parameters[at], directory)
        });
        let files = config.into_iter().chain(named.into_iter().flatten());
        files.map(|file| normal(&file)).collect()
    }

    /// The names of the slots of an instance for which `is_meant` holds.
    fn slot_names(&self, at: usize, is_meant: impl Fn(Endpoint, &Slot) -> bool) -> Vec<String> {
        let project = self.projects[at].as_deref();
        let slots = project.map_or(&[][..], |project| &project.component.slots);
        let ends = slots.iter().zip(0..).map(|(slot, number)| {
            let end = Endpoint {
                instance: at,
                slot: number,
            };
            (end, slot)
        });
        let meant = ends.filter(|(end, slot)| is_meant(*end, slot));
        meant.map(|(_, slot)| slot.name.clone()).collect()
    }

    /// The slots that provide for a slot, for people, with commas. Empty if they are outside.
    fn provider_names(&self, consumer: Endpoint) -> String {
        let all = self.connections.connections.iter();
        let own = all.filter(|made| made.consumer == consumer);
        let names = own.filter_map(|made| {
            let instance = &self.deployment.instances[made.provider.instance].path;
            Some(format!("{instance}.{}", self.slot(made.provider)?.name))
        });
        names.collect::<Vec<_>>().join(",")
    }

    /// The plan of the network, which has no errors. Paths are absolute.
    ///
    /// # Errors
    /// A manifest is faulty, or the system refuses something.
    pub fn plan(&self, profile: Profile) -> Result<Plan, Error> {
        self.processes(profile).map_err(refused("make the plan"))
    }

    fn processes(&self, profile: Profile) -> io::Result<Plan> {
        let instances = &self.deployment.instances;
        let mut copied: BTreeMap<String, HostFiles> = BTreeMap::new();
        let mut out = Vec::new();
        for (at, instance) in instances.iter().enumerate() {
            // A missing executable was an error, or is not needed.
            let executable = self.programs.executable(at, profile)?;
            let executable = executable.map(std::path::absolute).transpose()?;
            let executable = executable.map(|path| normal(&path)).unwrap_or_default();
            let directory = match instance.folder.as_path() {
                here if here.as_os_str().is_empty() => Path::new(".").canonicalize()?,
                folder => folder.canonicalize()?,
            };
            let mut args: Vec<String> = self.description(at)?.into_iter().collect();
            let mut option = |name: &str, value: String| args.extend([name.to_owned(), value]);
            option("--network", self.name().to_owned());
            option("--name", process_name(&instance.path));
            let project = self.projects[at].as_deref();
            let host = self.deployment.remote_host(instance);
            let config = config(instance, project).map(std::path::absolute);
            let config = config.transpose()?.map(|path| normal(&path));
            let (mut files, mut venv) = (Vec::new(), None);
            if let Some(config) = &config {
                option("--config", config.to_string_lossy().into_owned());
            }
            if let Some(host) = host {
                files.extend(config.clone());
                // In its own workspace, it finds the files that the network names.
                let from = host.workspace.is_none().then_some(directory.as_path());
                let named = project.map(|project| {
                    named_files(project, config.as_deref(), &self.parameters[at], from)
                });
                // Their places on the host are those here, also for a network that is named from its folder.
                let named = named.into_iter().flatten();
                files.extend(named.map(|file| std::path::absolute(&file).unwrap_or(file)));
                let all = copied.entry(plan::Host::from(host).name).or_default();
                if let Some((more, environment)) = self.programs.python_copies(at, profile, all)? {
                    files.extend(more);
                    venv = environment;
                }
            }
            for (path, value) in &self.parameters[at].set {
                option("--set", format!("{path}={value}"));
            }
            let component = project.map(|p| &p.component);
            for part in world::handed(self, at).into_iter().flatten() {
                option("--schema", part);
            }
            for set in self.passed_settings(at) {
                let (middleware, key) = (set.middleware.word(), set.key);
                let value = &set.value;
                option("--set-middleware", format!("{middleware}.{key}={value}"));
            }
            for chosen in self.transport_options(at) {
                option("--transport", chosen);
            }
            for array in &instance.arrays {
                let members = array.members.iter().map(|name| name.text.as_str());
                let members = members.collect::<Vec<_>>().join(",");
                option("--members", format!("{}={members}", array.name.text));
            }
            for (slot, index) in component.iter().flat_map(|c| c.slots.iter().zip(0..)) {
                let end = Endpoint {
                    instance: at,
                    slot: index,
                };
                let address = self.addresses.of(end);
                option("--bind", format!("{}={address}", slot.name));
                if let Some(conversion) = self.connections.conversion(end) {
                    option("--convert", format!("{}={}", slot.name, conversion.plan));
                    let providers = self.provider_names(end);
                    if !providers.is_empty() {
                        option("--providers", format!("{}={providers}", slot.name));
                    }
                    if let Some(tree) = &conversion.tree {
                        option("--frames", format!("{}={tree}", slot.name));
                    }
                }
            }
            for (name, value) in network_time::options(self, at) {
                option(name, value);
            }
            args.extend(instance.args.iter().map(|a| a.text.clone()));
            let after = instance.after.iter();
            let after = after.flat_map(|(place, _)| self.deployment.awaited(*place));
            let required = self.connections.required[at].iter().copied();
            let after: BTreeSet<usize> = after.chain(required).collect();
            out.push(Component {
                thread: self
                    .programs
                    .member_word(at)
                    .zip(instance.process.as_ref())
                    .map(|(component, process)| plan::Thread {
                        process: process.text.clone(),
                        component,
                    }),
                args,
                after: after.iter().map(|i| instances[*i].path.clone()).collect(),
                env: instance
                    .env
                    .iter()
                    .map(|(n, v)| (n.text.clone(), v.text.clone()))
                    .collect(),
                external: self
                    .slot_names(at, |end, _| self.connections.externals.contains_key(&end)),
                optional: self.slot_names(at, |_, slot| slot.optional),
                behind: self.behind(at),
                managed: component.is_some_and(|component| component.managed),
                ready: instance.ready,
                stop: instance.stop,
                restart: instance.restart,
                cpu: instance.cpu.clone(),
                priority: instance.priority.map(|(priority, _)| priority),
                exact: instance.exact.is_some(),
                middleware: self.middleware_text(at),
                transports: self.transports(at),
                host: match instance.host.filter(|_| host.is_some()) {
                    Some((host, _)) => Some(self.programs.planned_host(host, profile)?),
                    None => None,
                },
                built_there: self.programs.is_built_there(at)?,
                files,
                venv,
                ..Component::new(instance.path.clone(), executable, directory)
            });
        }
        Ok(Plan {
            network: self.name().to_owned(),
            ddsl: self.path.canonicalize()?,
            components: out,
            ring: self.deployment.ring,
            chains: PlannedChain::all(self),
        })
    }
}

impl PlannedChain {
    /// The chains of a network.
    fn all(network: &Network) -> Vec<Self> {
        let chains = network.chains.iter();
        chains.map(|chain| Self::of(network, chain)).collect()
    }

    fn of(network: &Network, checked: &CheckedChain) -> Self {
        let chain = &network.deployment.chains[checked.declared];
        let path = &checked.path;
        let hops = path.links.iter().enumerate().map(|(at, link)| {
            let next = path.links.get(at + 1);
            let output = next.map_or(path.sent, |next| next.from);
            let cost = checked.costs.as_ref().and_then(|costs| costs.get(at));
            let project = network.projects[link.to.instance].as_deref();
            let says = project.is_some_and(|project| project.component.reactions.is_some());
            PlannedHop {
                input: PlannedMessage::of(network, link.to),
                output: output.map(|port| PlannedMessage::of(network, port)),
                reacts_in: match link.way {
                    Way::Compute if !says => ReactsIn::Unknown,
                    Way::Compute => ReactsIn::Compute,
                    // Its handler runs with the last of the messages that it collects.
                    Way::Handler if is_collected(project, link.to) => ReactsIn::Unknown,
                    Way::Handler => ReactsIn::Handler,
                },
                outside: PlannedOutside::of(network, checked, link),
                worst: cost
                    .map(|cost| [cost.transport, cost.period, cost.work].map(Duration::from_nanos)),
            }
        });
        let first = path.links.first();
        let source = first.and_then(|link| link.from);
        let begins = source.or(first.map(|link| link.to));
        let ends = path.sent.or(path.links.last().map(|link| link.to));
        let name =
            |port: Option<Port>| port.map_or_else(String::new, |port| network.port_name(port));
        let component = |at: usize| network.deployment.instances[at].path.clone();
        Self {
            name: chain.path.clone(),
            from: name(begins),
            to: name(ends),
            within: chain.within,
            age: chain.age,
            late: match &chain.late {
                Late::Warn => LateAction::Warn,
                Late::Event => LateAction::Event,
                Late::Stop(at) => LateAction::Stop(component(*at)),
                Late::Emergency(at) => LateAction::Emergency(component(*at)),
                Late::Fire(at, event) => LateAction::Fire {
                    component: component(*at),
                    event: event.text.clone(),
                },
            },
            source: source.map(|port| PlannedMessage::of(network, port)),
            hops: hops.collect(),
        }
    }
}

impl PlannedOutside {
    fn of(network: &Network, checked: &CheckedChain, link: &Link) -> Option<Self> {
        let mut all = checked.outside.iter();
        let outside = all.find(|of| of.is(link))?;
        Some(Self {
            sent: PlannedMessage::of(network, outside.from),
            stamps: outside.stamps.clone(),
        })
    }
}

impl PlannedMessage {
    fn of(network: &Network, port: Port) -> Self {
        let component = network.deployment.instances[port.instance].path.clone();
        let (slot, operation) = network.port_words(port).unwrap_or_default();
        Self {
            component,
            slot: slot.to_owned(),
            operation: operation.to_owned(),
        }
    }
}

/// Whether a component collects a message with others.
fn is_collected(project: Option<&Project>, port: Port) -> bool {
    let component = project.map(|project| &project.component);
    component.is_some_and(|component| {
        let slot = &component.slots[port.slot];
        let operations = &component.library.interface(slot.interface).operations;
        let name = &operations[port.operation].name.text;
        let mut topics = component.collects.iter().flat_map(|of| &of.topics);
        topics.any(|(of, operation)| *of == slot.name && operation == name)
    })
}
