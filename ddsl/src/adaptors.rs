//! Components that convert in a process of their own: for `convert via process;`, and for programs
//! outside, which cannot be told to convert.
//!
//! An adaptor has the connection that the `bind` declares, with the conversion, and serves the
//! consumer: with the meaning and over the middleware of the consumer. Everything else sees a
//! component as any other.

use crate::endpoint::{Endpoint, slot};
use crate::exports::{Exports, is_provider};
use crate::model::{
    Bind, Deployment, External, Instance, InstanceOrGroup, LONGEST_NAME, NODE, Peer, READY, STOP,
    Setting, SlotPath,
};
use crate::peers::{find, peer_slot};
use rc_cdsl::Component;
use rc_cdsl::model::{Reaction, Role, Slot, Step};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use rc_vocabulary::qos::Policies;
use std::time::Duration;

/// The name of the component that adaptors are.
const ADAPTOR: &str = "adaptor";
/// The slot that is connected with the provider.
const PROVIDER: &str = "provider";
/// The slot that the consumer is connected with.
const CONSUMER: &str = "consumer";
/// The end of the name of a slot that knows where frames are, if it would be one of both others.
const FRAMES: &str = "frames";
/// An adaptor does nothing in a period.
const PERIOD: Duration = Duration::from_secs(1);

/// An adaptor of a network.
#[derive(Debug)]
pub struct Adaptor {
    /// The slot that gives it its meaning and its files.
    pub of: Origin,
    /// Its component, which has no file.
    pub component: Component,
    /// The instance that it serves: an index into [`Deployment::instances`].
    pub beside: usize,
    /// Its slots that are in place of one of that instance, each with the name of the latter.
    pub slots: Vec<(String, String)>,
}

/// The consumer whose connection an adaptor converts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// An index into [`Deployment::instances`].
    Instance(usize),
    /// A program outside: an index into [`Deployment::externals`].
    External(usize),
}

/// A `bind` with `via process` whose ends are known, or an external slot with an adaptor.
struct Found<'a> {
    clause: Clause,
    of: Origin,
    span: Span,
    /// The slot and its instance. For a program outside: its slot, and the end of its peer.
    consumer: (Endpoint, &'a Slot),
    provider: (Endpoint, &'a Slot),
    /// The settings of the consumer.
    component: &'a Component,
    trees: Vec<Tree<'a>>,
}

/// The declaration that requires an adaptor.
#[derive(Clone, Copy)]
enum Clause {
    /// An index into [`Deployment::binds`].
    Bind(usize),
    /// An index into [`Deployment::externals`].
    External(usize),
}

/// The slot of a consumer that knows where frames are.
struct Tree<'a> {
    slot: &'a Slot,
    peer: TreePeer,
}

/// The declared peer of a slot.
enum TreePeer {
    /// To these, each with its `convert`.
    Bound(Vec<(SlotPath, Option<Span>)>),
    /// With the address, if the file names one.
    External(Option<Name>),
    Unsaid,
}

/// Adds an adaptor for each `bind` with `via process`, and for each program outside for which values
/// are converted, at the end of [`Deployment::instances`], and connects it. `components` has one
/// entry for each instance, after [`crate::expand`], then one for each external slot. Returns the
/// adaptors in the order of their instances. [`crate::connect`] reports ends that do not fit.
pub fn add_adaptors(
    deployment: &mut Deployment,
    components: &[Option<&Component>],
    diagnostics: &mut Diagnostics,
) -> Vec<Adaptor> {
    let mut adaptors = Vec::new();
    for found in all(deployment, components, diagnostics) {
        let instance = instance(deployment, &found);
        if instance.path.len() > LONGEST_NAME {
            let message = format!(
                "the name of the adaptor `{}` has {} bytes, but the maximum is {LONGEST_NAME}",
                instance.path,
                instance.path.len()
            );
            let error = Diagnostic::error("name-too-long", found.span, message);
            diagnostics.push(error.help("choose a shorter name for the component or its slot"));
            continue;
        }
        let trees = found.trees.iter().map(|tree| &tree.slot.name);
        let trees = trees.map(|name| (frames(name), name.clone()));
        let own = (PROVIDER.to_owned(), found.consumer.1.name.clone());
        let own = matches!(found.of, Origin::Instance(_)).then_some(own);
        adaptors.push(Adaptor {
            of: found.of,
            component: component(deployment, &found),
            beside: found.consumer.0.instance,
            slots: own.into_iter().chain(trees).collect(),
        });
        deployment.instances.push(instance);
        connect(deployment, &found);
    }
    adaptors
}

/// All of a deployment.
fn all<'a>(
    deployment: &Deployment,
    components: &[Option<&'a Component>],
    diagnostics: &mut Diagnostics,
) -> Vec<Found<'a>> {
    let has_binds = deployment.binds.iter().any(|bind| bind.process.is_some());
    let mut externals = deployment.externals.iter();
    if !has_binds && externals.all(|external| external.peer.is_none()) {
        return Vec::new();
    }
    let (own, peers) = components.split_at(deployment.instances.len());
    let exports = Exports::new(deployment, own, &mut Diagnostics::new());
    let ends = Ends {
        deployment,
        components: own,
        exports: &exports,
    };
    let mut found = Vec::new();
    for (at, bind) in deployment.binds.iter().enumerate() {
        found.extend(ends.of_bind(at, bind, diagnostics));
    }
    for (at, external) in deployment.externals.iter().enumerate() {
        if let Some((peer, known)) = external.peer.as_ref().zip(peers.get(at).copied().flatten()) {
            found.extend(ends.of_external(at, &external.slot, (peer, known), diagnostics));
        }
    }
    found
}

/// The slots of a network.
struct Ends<'a, 'd> {
    deployment: &'d Deployment,
    components: &'d [Option<&'a Component>],
    exports: &'d Exports<'d>,
}

impl<'a> Ends<'a, '_> {
    fn find(&self, path: &SlotPath) -> Option<Endpoint> {
        find(self.exports, self.components, path)
    }

    fn known(&self, path: &SlotPath) -> Option<(Endpoint, &'a Slot)> {
        let end = self.find(path)?;
        Some((end, slot(self.components, end)?))
    }

    fn of_bind(&self, at: usize, bind: &Bind, found: &mut Diagnostics) -> Option<Found<'a>> {
        let span = bind.process?;
        let consumer = self.known(&bind.consumer)?;
        let provider = self.known(bind.provider.as_ref()?)?;
        let component = self.components[consumer.0.instance]?;
        let of_provider = self.components[provider.0.instance]?;
        let path =
            |component: &Component, slot: &Slot| component.library.interface_path(slot.interface);
        let is_pair = is_pair(consumer.1.role, provider.1.role)
            && path(component, consumer.1) == path(of_provider, provider.1);
        is_pair.then_some(Found {
            clause: Clause::Bind(at),
            of: Origin::Instance(consumer.0.instance),
            span,
            consumer,
            provider,
            component,
            trees: self.trees(component, consumer.0, &bind.frames, found)?,
        })
    }

    /// A consumer outside cannot be told to convert, so an adaptor converts its values. A consumer
    /// of the network converts itself, unless the file asks for a process.
    fn of_external(
        &self,
        at: usize,
        path: &SlotPath,
        (peer, known): (&Peer, &'a Component),
        found: &mut Diagnostics,
    ) -> Option<Found<'a>> {
        let own = self.known(path)?;
        let component = self.components[own.0.instance]?;
        let provides = is_provider(own.1.role);
        let convert = peer.convert.span?;
        let span = peer.convert.process.or(provides.then_some(convert))?;
        // Mismatches are reported when the connections are computed.
        let outside = peer_slot(peer, known, (component, own.1), &mut Diagnostics::new())?;
        let outside = (own.0, outside);
        let (of, consumer, provider, component) = if provides {
            (Origin::External(at), outside, own, known)
        } else {
            let of = Origin::Instance(own.0.instance);
            (of, own, outside, component)
        };
        let frames = &peer.convert.frames;
        let trees = if provides {
            if let Some(name) = frames.first() {
                let message = "a program outside has no slot that knows where frames are";
                let error = Diagnostic::error("wrong-frames", name.span, message);
                found.push(error.help("change the frame in a component of the network"));
                return None;
            }
            Vec::new()
        } else {
            self.trees(component, own.0, frames, found)?
        };
        Some(Found {
            clause: Clause::External(at),
            of,
            span,
            consumer,
            provider,
            component,
            trees,
        })
    }

    /// The slots with these names of a consumer. Reports names that it does not have.
    fn trees(
        &self,
        component: &'a Component,
        consumer: Endpoint,
        names: &[Name],
        found: &mut Diagnostics,
    ) -> Option<Vec<Tree<'a>>> {
        let names = names.iter();
        let trees = names.map(|name| self.tree(component, (consumer, name), found));
        trees.collect()
    }

    /// The slot with this name of a consumer. Reports a name that it does not have.
    fn tree(
        &self,
        component: &'a Component,
        (consumer, name): (Endpoint, &Name),
        diagnostics: &mut Diagnostics,
    ) -> Option<Tree<'a>> {
        let deployment = self.deployment;
        let mut slots = component.slots.iter();
        let Some(slot) = slots.position(|slot| slot.name == name.text) else {
            let path = &deployment.instances[consumer.instance].path;
            let message = format!("`{path}` has no slot `{}`", name.text);
            let known = component.slots.iter().filter(|slot| !slot.of_world);
            let known = known.map(|slot| slot.name.as_str());
            diagnostics.push(
                Diagnostic::error("unknown-slot", name.span, message)
                    .label(component.name.span, "its component")
                    .suggest(&name.text, known),
            );
            return None;
        };
        if component.slots[slot].of_world {
            let message = format!(
                "`{}` is a world, of which an adaptor has no replica",
                name.text
            );
            diagnostics.push(
                Diagnostic::error("wrong-frames", name.span, message)
                    .help("leave out `via process`: the consumer asks its own replica"),
            );
            return None;
        }
        let end = Endpoint { slot, ..consumer };
        let binds = deployment.binds.iter();
        let bound = binds.filter(|bind| self.find(&bind.consumer) == Some(end));
        let bound = bound.filter_map(|bind| Some((bind.provider.clone()?, bind.convert)));
        let bound: Vec<_> = bound.collect();
        let mut externals = deployment.externals.iter();
        let external = externals.find(|external| self.find(&external.slot) == Some(end));
        let peer = match external {
            Some(external) => TreePeer::External(external.address.clone()),
            None if bound.is_empty() => TreePeer::Unsaid,
            None => TreePeer::Bound(bound),
        };
        Some(Tree {
            slot: &component.slots[slot],
            peer,
        })
    }
}

/// Whether a consumer and a provider have these roles.
fn is_pair(consumer: Role, provider: Role) -> bool {
    matches!(
        (consumer, provider),
        (Role::Requires, Role::Implements) | (Role::SubscribesTo, Role::Publishes)
    )
}

/// The instance of an adaptor, in the group and on the host of its consumer.
fn instance(deployment: &Deployment, found: &Found<'_>) -> Instance {
    let (end, slot) = found.consumer;
    let own = &deployment.instances[end.instance];
    let prefix = own.path.strip_suffix(&own.name.text).unwrap_or_default();
    let name = format!(
        "{}_{}_{ADAPTOR}",
        own.name.text,
        slot.name.replace('.', "_")
    );
    let is_free = |name: &str| {
        let path = format!("{prefix}{name}");
        let instances = deployment.instances.iter().map(|other| &other.path);
        let groups = deployment.groups.iter().map(|group| &group.path);
        let processes = deployment.processes.iter().map(|process| &process.path);
        let mut taken = instances.chain(groups).chain(processes);
        taken.all(|other| !other.eq_ignore_ascii_case(&path))
    };
    let further = (2..).map(|number: u32| format!("{name}_{number}"));
    let mut names = std::iter::once(name.clone()).chain(further);
    let name = names.find(|name| is_free(name)).unwrap_or(name);
    // It is a node of its own.
    let unnamed = |set: &&Setting| set.key != NODE;
    Instance {
        path: format!("{prefix}{name}"),
        name: Name::new(name, found.span),
        doc: vec![format!(
            "{}",
            match found.of {
                Origin::Instance(_) =>
                    format!("Converts what `{}` gets in `{}`.", own.name.text, slot.name),
                Origin::External(_) =>
                    format!("Converts what programs outside get of `{}`.", own.name.text),
            }
        )],
        group: own.group,
        proxy: None,
        process: None,
        folder: own.folder.clone(),
        cdsl: None,
        executable: None,
        config: None,
        host: own.host,
        endpoint: None,
        middleware: own.middleware,
        auto: own
            .auto
            .or(deployment.instances[found.provider.0.instance].auto),
        settings: own.settings.iter().filter(unnamed).cloned().collect(),
        after: Vec::new(),
        restart: own.restart,
        ready: READY,
        stop: STOP,
        env: own.env.clone(),
        args: Vec::new(),
        cpu: Vec::new(),
        cpu_span: None,
        priority: None,
        system_time: own.system_time,
        exact: None,
        parameters: Vec::new(),
        arrays: Vec::new(),
        all_members: None,
        adaptor: Some(found.span),
    }
}

/// The component of an adaptor. Its values mean what those of the consumer mean.
fn component(deployment: &Deployment, found: &Found<'_>) -> Component {
    let (consumer, provider) = (found.consumer, found.provider);
    // The middleware of the other end, if that is chosen there.
    let middleware = |(end, slot): (Endpoint, &Slot)| {
        let instance = &deployment.instances[end.instance];
        let of_all = instance.auto.is_none().then_some(instance.middleware);
        slot.backend.or(of_all)
    };
    let towards_provider = Slot {
        name: PROVIDER.to_owned(),
        backend: middleware(provider),
        ..plain(consumer.1)
    };
    let towards_consumer = Slot {
        name: CONSUMER.to_owned(),
        role: provider.1.role,
        interface: consumer.1.interface,
        backend: middleware(consumer),
        qos: provider.1.qos.clone(),
        ..plain(consumer.1)
    };
    let operations = &found
        .component
        .library
        .interface(consumer.1.interface)
        .operations;
    let is_call = consumer.1.role == Role::Requires;
    let (from, to) = if is_call {
        (CONSUMER, PROVIDER)
    } else {
        (PROVIDER, CONSUMER)
    };
    let reactions = operations.iter().map(|operation| {
        let step = |slot: &str| Step::Operation {
            slot: slot.to_owned(),
            operation: operation.name.text.clone(),
        };
        Reaction {
            cause: step(from),
            effects: vec![step(to)],
            budget: None,
        }
    });
    let trees = found.trees.iter().map(|tree| Slot {
        name: frames(&tree.slot.name),
        ..plain(tree.slot)
    });
    Component {
        name: Name::new(ADAPTOR, found.span),
        doc: Vec::new(),
        language: Name::new("rust", found.span),
        slots: [towards_provider, towards_consumer]
            .into_iter()
            .chain(trees)
            .collect(),
        parameters: None,
        kinematics: Vec::new(),
        state_machine: None,
        dependencies: Vec::new(),
        python: None,
        period: PERIOD,
        reactions: Some(reactions.collect()),
        simulates_time: false,
        managed: false,
        viewer: None,
        scene_slots: None,
        world: None,
        collects: Vec::new(),
        ..found.component.clone()
    }
}

/// A slot as an adaptor has it: values and replies are copied, and not kept.
fn plain(slot: &Slot) -> Slot {
    let passed = slot.qos.iter().filter(|policy| !policy.name().is_of_ages());
    let mut qos = Policies::default();
    qos.extend(passed);
    Slot {
        qos,
        is_array: false,
        in_place: false,
        asynchronous: false,
        available: Vec::new(),
        name_span: None,
        ..slot.clone()
    }
}

/// Connects the adaptor that is the last instance.
fn connect(deployment: &mut Deployment, found: &Found<'_>) {
    let place = InstanceOrGroup::Instance(deployment.instances.len() - 1);
    let path = |name: &str, span: Span| SlotPath {
        place,
        slot: Name::new(name, span),
        span,
    };
    let (own, span) = match found.clause {
        Clause::Bind(at) => {
            let bind = &mut deployment.binds[at];
            let span = bind.consumer.span;
            let own = Bind {
                consumer: path(PROVIDER, span),
                provider: bind.provider.replace(path(CONSUMER, span)),
                convert: bind.convert.take(),
                frames: renamed(&std::mem::take(&mut bind.frames)),
                process: None,
            };
            (own, span)
        }
        Clause::External(at) => {
            let external = &mut deployment.externals[at];
            let span = external.slot.span;
            let is_outside = matches!(found.of, Origin::External(_));
            let slot = if is_outside { CONSUMER } else { PROVIDER };
            let inside = std::mem::replace(&mut external.slot, path(slot, span));
            let own = if is_outside {
                Bind {
                    consumer: path(PROVIDER, span),
                    provider: Some(inside),
                    convert: external.peer.take().and_then(|peer| peer.convert.span),
                    frames: Vec::new(),
                    process: None,
                }
            } else {
                if let Some(peer) = &mut external.peer {
                    peer.convert.process = None;
                    peer.convert.frames = renamed(&peer.convert.frames);
                }
                Bind {
                    consumer: inside,
                    provider: Some(path(CONSUMER, span)),
                    convert: None,
                    frames: Vec::new(),
                    process: None,
                }
            };
            (own, span)
        }
    };
    deployment.binds.push(own);
    for tree in &found.trees {
        let slot = path(&frames(&tree.slot.name), span);
        match &tree.peer {
            TreePeer::Bound(providers) => {
                let binds = providers.iter().map(|(provider, convert)| Bind {
                    consumer: slot.clone(),
                    provider: Some(provider.clone()),
                    convert: *convert,
                    frames: Vec::new(),
                    process: None,
                });
                deployment.binds.extend(binds);
            }
            TreePeer::External(address) => deployment.externals.push(External {
                slot,
                address: address.clone(),
                peer: None,
            }),
            TreePeer::Unsaid => {}
        }
    }
}

/// These names of slots that know where frames are, as an adaptor has them.
fn renamed(names: &[Name]) -> Vec<Name> {
    let names = names.iter();
    names
        .map(|name| Name::new(frames(&name.text), name.span))
        .collect()
}

/// The name of a slot that knows where frames are: that of the consumer's slot, so that the settings
/// of the consumer, such as `remap` of ROS 2, hold for it.
fn frames(slot: &str) -> String {
    if slot.eq_ignore_ascii_case(PROVIDER) || slot.eq_ignore_ascii_case(CONSUMER) {
        format!("{slot}_{FRAMES}")
    } else {
        slot.to_owned()
    }
}
