//! Components that convert in a process of their own: `convert via process;`.
//!
//! An adaptor has the connection that the `bind` declares, with the conversion, and serves the
//! consumer: with the meaning and over the middleware of the consumer. Everything else sees a
//! component as any other.

use crate::endpoint::{Endpoint, slot};
use crate::exports::Exports;
use crate::model::{
    Bind, Deployment, External, Instance, InstanceOrGroup, LONGEST_NAME, NODE, READY, STOP,
    Setting, SlotPath,
};
use rc_cdsl::Component;
use rc_cdsl::model::{Reaction, Role, Slot, Step};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
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
    /// The instance whose connection it converts: an index into [`Deployment::instances`].
    pub of: usize,
    /// Its component, of which there is no file.
    pub component: Component,
}

/// A `bind` with `via process` whose ends are known.
struct Found<'a> {
    /// The index of the `bind`.
    bind: usize,
    span: Span,
    consumer: (Endpoint, &'a Slot),
    provider: (Endpoint, &'a Slot),
    component: &'a Component,
    trees: Vec<Tree<'a>>,
}

/// The slot of a consumer that knows where frames are.
struct Tree<'a> {
    slot: &'a Slot,
    peer: Peer,
}

/// What the file says of the peer of a slot.
enum Peer {
    /// To these, each with its `convert`.
    Bound(Vec<(SlotPath, Option<Span>)>),
    /// With the address, if the file names one.
    External(Option<Name>),
    Unsaid,
}

/// Adds an adaptor for each `bind` with `via process`, at the end of [`Deployment::instances`], and
/// connects it. `components` has one entry for each instance, after [`crate::expand`]. Returns the
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
        adaptors.push(Adaptor {
            of: found.consumer.0.instance,
            component: component(deployment, &found),
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
    if deployment.binds.iter().all(|bind| bind.process.is_none()) {
        return Vec::new();
    }
    let exports = Exports::new(deployment, components, &mut Diagnostics::new());
    let find = |path: &SlotPath| match path.place {
        InstanceOrGroup::Group(group) => exports.get(group, &path.slot.text),
        InstanceOrGroup::Instance(instance) => {
            let component = components.get(instance).copied().flatten()?;
            let mut slots = component.slots.iter();
            let slot = slots.position(|slot| slot.name == path.slot.text)?;
            Some(Endpoint { instance, slot })
        }
    };
    let known = |path: &SlotPath| {
        let end = find(path)?;
        Some((end, slot(components, end)?))
    };
    let binds = deployment.binds.iter().enumerate();
    let found = binds.filter_map(|(at, bind)| {
        let span = bind.process?;
        let consumer = known(&bind.consumer)?;
        let provider = known(bind.provider.as_ref()?)?;
        let component = components[consumer.0.instance]?;
        let of_provider = components[provider.0.instance]?;
        let path =
            |component: &Component, slot: &Slot| component.library.interface_path(slot.interface);
        let is_pair = is_pair(consumer.1.role, provider.1.role)
            && path(component, consumer.1) == path(of_provider, provider.1);
        // A slot that the consumer does not have is reported.
        let names = bind.frames.iter().filter(|_| is_pair);
        let trees = names.map(|name| {
            tree(
                deployment,
                component,
                &find,
                (consumer.0, name),
                diagnostics,
            )
        });
        let trees = trees.collect::<Option<Vec<_>>>()?;
        is_pair.then_some(Found {
            bind: at,
            span,
            consumer,
            provider,
            component,
            trees,
        })
    });
    found.collect()
}

/// The slot with this name of a consumer. Reports a name that it does not have.
fn tree<'a>(
    deployment: &Deployment,
    component: &'a Component,
    find: &dyn Fn(&SlotPath) -> Option<Endpoint>,
    (consumer, name): (Endpoint, &Name),
    diagnostics: &mut Diagnostics,
) -> Option<Tree<'a>> {
    let mut slots = component.slots.iter();
    let Some(slot) = slots.position(|slot| slot.name == name.text) else {
        let path = &deployment.instances[consumer.instance].path;
        let message = format!("`{path}` has no slot `{}`", name.text);
        let known = component.slots.iter().map(|slot| slot.name.as_str());
        diagnostics.push(
            Diagnostic::error("unknown-slot", name.span, message)
                .label(component.name.span, "its component")
                .suggest(&name.text, known),
        );
        return None;
    };
    let end = Endpoint { slot, ..consumer };
    let binds = deployment.binds.iter();
    let bound = binds.filter(|bind| find(&bind.consumer) == Some(end));
    let bound = bound.filter_map(|bind| Some((bind.provider.clone()?, bind.convert)));
    let bound: Vec<_> = bound.collect();
    let mut externals = deployment.externals.iter();
    let external = externals.find(|external| find(&external.slot) == Some(end));
    let peer = match external {
        Some(external) => Peer::External(external.address.clone()),
        None if bound.is_empty() => Peer::Unsaid,
        None => Peer::Bound(bound),
    };
    Some(Tree {
        slot: &component.slots[slot],
        peer,
    })
}

/// Whether a consumer and a provider have these roles.
fn is_pair(consumer: Role, provider: Role) -> bool {
    matches!(
        (consumer, provider),
        (Role::Requires, Role::Implements) | (Role::SubscribesTo, Role::Publishes)
    )
}

/// The instance of an adaptor, beside its consumer.
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
            "Converts what `{}` gets in `{}`.",
            own.name.text, slot.name
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
        ..found.component.clone()
    }
}

/// A slot as an adaptor has it: values and replies are copied, and one call follows the other.
fn plain(slot: &Slot) -> Slot {
    Slot {
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
    let bind = &mut deployment.binds[found.bind];
    let span = bind.consumer.span;
    let own = Bind {
        consumer: path(PROVIDER, span),
        provider: bind.provider.replace(path(CONSUMER, span)),
        convert: bind.convert.take(),
        frames: std::mem::take(&mut bind.frames)
            .iter()
            .map(|name| Name::new(frames(&name.text), name.span))
            .collect(),
        process: None,
    };
    deployment.binds.push(own);
    for tree in &found.trees {
        let slot = path(&frames(&tree.slot.name), span);
        match &tree.peer {
            Peer::Bound(providers) => {
                let binds = providers.iter().map(|(provider, convert)| Bind {
                    consumer: slot.clone(),
                    provider: Some(provider.clone()),
                    convert: *convert,
                    frames: Vec::new(),
                    process: None,
                });
                deployment.binds.extend(binds);
            }
            Peer::External(address) => deployment.externals.push(External {
                slot,
                address: address.clone(),
            }),
            Peer::Unsaid => {}
        }
    }
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
