//! Finds nodes, or ends that no connection joins, which get the same name in ROS 2, and connected
//! ends which get two names. Otherwise two components would execute a call, or values would have no
//! receiver.
//!
//! Names are made here as the components make them, by `rc_vocabulary::ros`.

use crate::model::Network;
use crate::process_name::process_name;
use rc_cdsl::model::{Middleware, Role, Slot};
use rc_codegen::Project;
use rc_ddsl::model::{Instance, Setting};
use rc_ddsl::{Connection, Endpoint};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, Span};
use rc_idsl::canonical::{interface_hash, operation_hash};
use rc_idsl::model::Operation;
use rc_vocabulary::Value;
use rc_vocabulary::ros::{self, ResolvedRemapping};
use std::collections::{BTreeMap, BTreeSet};

/// The variable by which ROS 2 chooses its middleware.
const RMW: &str = "RMW_IMPLEMENTATION";
/// The option of a component that changes its names in ROS 2. No finding is reported for such a
/// component.
const RENAMING: &str = "--ros-args";
/// How many names a message lists.
const LISTED: usize = 8;

/// A component that is in ROS 2.
struct Node<'a> {
    at: usize,
    instance: &'a Instance,
    project: &'a Project,
    /// Domain that the files set.
    domain: Option<i64>,
    /// Name with its namespace.
    name: String,
    rules: Vec<ResolvedRemapping>,
}

/// An operation of a slot that is in ROS 2.
struct End<'a> {
    node: &'a Node<'a>,
    place: Endpoint,
    slot: &'a Slot,
    operation: &'a Operation,
    address: String,
    /// Name with its namespace.
    name: String,
    is_renamed: bool,
}

/// Finds nodes, services and topics that are several by the network and one in ROS 2, and
/// connections whose ends are not. `check_generated` reports types that are one.
pub(crate) fn check(network: &Network, found: &mut Diagnostics) {
    let nodes = nodes(network);
    let ends = ends(network, &nodes);
    let Merged {
        slots,
        nodes: merged,
    } = check_that_no_others_meet(&ends, found);
    check_that_ends_meet(network, &ends, &slots, found);
    let mut named: BTreeMap<(Option<i64>, &str), Vec<&Node<'_>>> = BTreeMap::new();
    for node in &nodes {
        named
            .entry((node.domain, &node.name))
            .or_default()
            .push(node);
    }
    for ((_, name), mut same) in named {
        let first = same[0].at;
        // This component is reported once, so another name is for the other node.
        same.retain(|node| !merged.contains(&(first, node.at)));
        if same.len() > 1 {
            found.push(one_node(name, &same));
        }
    }
}

/// The components that are in ROS 2 under names that are known.
fn nodes(network: &Network) -> Vec<Node<'_>> {
    let instances = network.deployment.instances.iter().zip(&network.projects);
    let nodes = instances
        .enumerate()
        .filter_map(|(at, (instance, project))| node(network, at, instance, project.as_deref()?));
    nodes.collect()
}

/// The first component on this machine with a slot on the middleware ros2, and the value of
/// `RMW_IMPLEMENTATION` in its environment.
pub fn ros_implementation(network: &Network) -> Option<(&Instance, String)> {
    let mut here = network
        .deployment
        .instances
        .iter()
        .enumerate()
        .filter(|(at, instance)| {
            network.deployment.remote_host(instance).is_none()
                && network.middlewares_of(*at).contains(&Middleware::Ros2)
        });
    let (_, instance) = here.next()?;
    let mut own = instance.env.iter();
    let own = own.find(|(name, _)| name.text == RMW);
    let value = own.map(|(_, value)| value.text.clone());
    value
        .or_else(|| std::env::var(RMW).ok())
        .map(|value| (instance, value))
}

fn node<'a>(
    network: &Network,
    at: usize,
    instance: &'a Instance,
    project: &'a Project,
) -> Option<Node<'a>> {
    let is_in_ros = network.middlewares_of(at).contains(&Middleware::Ros2);
    let mut args = instance.args.iter();
    if !is_in_ros || args.any(|arg| arg.text == RENAMING) {
        return None;
    }
    let value = |key| setting(instance, key).map(|set| &set.value);
    let own = |key| match value(key) {
        Some(Value::Text(name)) => Some(name.clone()),
        _ => None,
    };
    let mut env = instance.env.iter();
    let mut variable = || {
        let (_, value) = env.find(|(name, _)| name.text == "ROS_DOMAIN_ID")?;
        value.text.parse().ok()
    };
    let domain = match value("domain") {
        Some(Value::Int(domain)) => Some(*domain),
        _ => variable(),
    };
    let (namespace, node_name) = ros::node(
        network.name(),
        &process_name(&instance.path),
        own("namespace"),
        own("node"),
    );
    let rules = match value("remap") {
        Some(Value::Remappings(rules)) => rules.as_slice(),
        _ => &[],
    };
    let rules = rules
        .iter()
        .map(|rule| rule.resolve(&namespace, &node_name));
    Some(Node {
        at,
        instance,
        project,
        domain,
        name: ros::full(&node_name, &namespace, ""),
        rules: rules.collect(),
    })
}

/// The ends of these components in ROS 2, except refused ones, which are reported and may be meant
/// to meet.
fn ends<'a>(network: &'a Network, nodes: &'a [Node<'a>]) -> Vec<End<'a>> {
    let diagnostics = network.connections.diagnostics.iter();
    let refused: BTreeSet<Endpoint> = diagnostics
        .filter(|t| t.peer.is_some() && t.diagnostic.severity == Severity::Error)
        .map(|t| t.endpoint)
        .collect();
    let mut ends = Vec::new();
    for node in nodes {
        let component = &node.project.component;
        for (slot, index) in component.slots.iter().zip(0..) {
            let place = Endpoint {
                instance: node.at,
                slot: index,
            };
            let over = network.middlewares(place);
            if !over.contains(&Middleware::Ros2) || refused.contains(&place) {
                continue;
            }
            let address = network.addresses.of(place);
            for operation in &component.library.interface(slot.interface).operations {
                let address = format!("{address}/{}", operation.name.text);
                let name =
                    ros::operation(&address, &slot.path(), &operation.name.text, &node.rules);
                ends.push(End {
                    node,
                    place,
                    slot,
                    operation,
                    is_renamed: name != ros::name(&address),
                    name,
                    address,
                });
            }
        }
    }
    ends
}

/// Finds connections of which one end was renamed, once a connection. If both were, a foreign
/// program may be meant to be between them. Slots in `reported` have another known mistake.
fn check_that_ends_meet(
    network: &Network,
    ends: &[End<'_>],
    reported: &BTreeSet<Endpoint>,
    found: &mut Diagnostics,
) {
    let mut of: BTreeMap<Endpoint, Vec<&End<'_>>> = BTreeMap::new();
    for end in ends.iter().filter(|end| !reported.contains(&end.place)) {
        of.entry(end.place).or_default().push(end);
    }
    let of = |place| of.get(place).map_or(&[][..], Vec::as_slice);
    for Connection { consumer, provider } in &network.connections.connections {
        let mut pairs = of(consumer).iter().zip(of(provider));
        let parted =
            pairs.find(|(one, other)| one.name != other.name && one.is_renamed != other.is_renamed);
        if let Some((one, other)) = parted {
            found.push(two_names(one, other));
        }
    }
}

/// Conflicts that are reported already.
#[derive(Default)]
struct Merged {
    /// The slots of ends that are one, and were renamed.
    slots: BTreeSet<Endpoint>,
    /// Pairs of components whose own names are one.
    nodes: BTreeSet<(usize, usize)>,
}

/// Compares the ends at each name.
fn check_that_no_others_meet(ends: &[End<'_>], found: &mut Diagnostics) -> Merged {
    let mut named: BTreeMap<_, Vec<&End<'_>>> = BTreeMap::new();
    for end in ends {
        let key = (end.node.domain, end.slot.role.is_topic(), &end.name);
        named.entry(key).or_default().push(end);
    }
    // A finding about one operation holds for the others of a slot, and a finding about the name of
    // a component for all of its slots.
    let (mut reported, mut merged) = (BTreeSet::new(), Merged::default());
    for (one, other) in named.values().filter_map(|ends| pair(ends)) {
        let is_own = one.node.at == other.node.at;
        let is_new = if is_own || one.is_renamed || other.is_renamed {
            merged.slots.extend([one.place, other.place]);
            reported.insert((one.place, other.place))
        } else {
            merged.nodes.insert((one.node.at, other.node.at))
        };
        if is_new {
            found.push(one_name(one, other));
        }
    }
    merged
}

fn setting<'a>(instance: &'a Instance, key: &str) -> Option<&'a Setting> {
    instance.setting(Middleware::Ros2, key)
}

/// Two ends at one name that must not be there together. Ends of one type that a file renames to
/// one name are meant to meet.
fn pair<'a>(ends: &[&'a End<'a>]) -> Option<(&'a End<'a>, &'a End<'a>)> {
    let first = *ends.first().filter(|_| ends.len() > 1)?;
    let all = ends.iter().copied();
    let mut servers = all.clone().filter(|e| e.slot.role == Role::Implements);
    let servers = servers.next().zip(servers.next());
    let differ = || {
        let types = first.types();
        Some((first, all.clone().find(|other| other.types() != types)?))
    };
    let merged = || {
        let mut usual = all.clone().filter(|end| !end.is_renamed);
        let first = usual.next()?;
        Some((first, usual.find(|end| end.address != first.address)?))
    };
    servers.or_else(differ).or_else(merged)
}

impl End<'_> {
    /// The hash that ends which run compare.
    fn types(&self) -> u64 {
        let (library, interface) = (&self.node.project.component.library, self.slot.interface);
        if self.slot.role.is_topic() {
            operation_hash(library, interface, self.operation)
        } else {
            interface_hash(library, interface)
        }
    }

    /// The name for messages.
    fn text(&self) -> String {
        let (instance, slot) = (&self.node.instance.path, &self.slot.name);
        format!("`{instance}.{slot}/{}`", self.operation.name.text)
    }

    /// Adds where it was renamed.
    fn label(&self, finding: Diagnostic) -> Diagnostic {
        match setting(self.node.instance, "remap").filter(|_| self.is_renamed) {
            Some(set) => label(finding, set.span, "renamed here"),
            None => finding,
        }
    }
}

/// Adds a further place, once.
fn label(finding: Diagnostic, span: Span, what: &str) -> Diagnostic {
    let known = finding.span == span || finding.labels.iter().any(|l| l.span == span);
    if known {
        finding
    } else {
        finding.label(span, what)
    }
}

fn one_name(one: &End<'_>, other: &End<'_>) -> Diagnostic {
    let (ends, name) = (format!("{} and {}", one.text(), other.text()), &one.name);
    let is_topic = one.slot.role.is_topic();
    let (code, kind) = if is_topic {
        ("ros-same-topic", "topic")
    } else {
        ("ros-same-service", "service")
    };
    let effect = if (one.slot.role, other.slot.role) == (Role::Implements, Role::Implements) {
        "a service has one server"
    } else if one.types() != other.types() {
        "their types differ, so they cannot meet there"
    } else {
        "they would meet, though no connection joins them"
    };
    let message = format!("{ends} are one {kind} in ROS 2, `{name}`: {effect}");
    let span = other.node.instance.name.span;
    let mut error = Diagnostic::error(code, span, message);
    error = label(error, one.node.instance.name.span, "the other one");
    for end in [one, other] {
        if one.node.at == other.node.at {
            error = label(error, end.slot.span, "one of both");
        }
        error = end.label(error);
    }
    error.help(if one.is_renamed || other.is_renamed {
        "give one of them another name in `remap`"
    } else {
        "names of ROS 2 have letters, digits and single `_`: call one of them otherwise, or give it another name in `remap`"
    })
}

/// For a connection, the end that was renamed and the other one.
fn two_names(one: &End<'_>, other: &End<'_>) -> Diagnostic {
    let (renamed, usual) = if one.is_renamed {
        (one, other)
    } else {
        (other, one)
    };
    let message = format!(
        "{} and {} are connected, and do not meet in ROS 2: one is `{}`, the other one `{}`",
        renamed.text(),
        usual.text(),
        renamed.name,
        usual.name
    );
    let warning = Diagnostic::warning("ros-renamed-alone", usual.node.instance.name.span, message);
    let rule = format!(
        "{}/{}:={}",
        usual.slot.name, usual.operation.name.text, renamed.name
    );
    renamed.label(warning).help(format!(
        "give `{}` the same name, `remap \"{rule}\"`, unless something between them that is not a component is meant to hear one and tell the other",
        usual.node.instance.path
    ))
}

fn one_node(name: &str, same: &[&Node<'_>]) -> Diagnostic {
    let listed = same.iter().take(LISTED);
    let mut names: Vec<String> = listed.map(|n| format!("`{}`", n.instance.path)).collect();
    let last = match same.len() - names.len() {
        0 => names.pop().unwrap_or_default(),
        more => format!("{more} more"),
    };
    let names = names.join(", ");
    let message = format!("{names} and {last} are one node in ROS 2, `{name}`");
    let span = same[1].instance.name.span;
    let with_parameters = same.iter().filter(|n| n.project.parameters.is_some());
    let mut finding = if with_parameters.count() > 1 {
        let message = format!("{message}: only one of those with parameters could start");
        Diagnostic::error("ros-same-node", span, message)
    } else {
        let message = format!("{message}: tools of ROS 2 take them for the same");
        Diagnostic::warning("ros-same-node", span, message)
    };
    for node in same.iter().take(LISTED) {
        finding = label(finding, node.instance.name.span, "another one");
        for set in ["node", "namespace"]
            .iter()
            .filter_map(|key| setting(node.instance, key))
        {
            finding = label(finding, set.span, "named here");
        }
    }
    finding.help(
        "give one of them a `node` or a `namespace` of its own in `middleware ros2 { … }`, or rename it",
    )
}
