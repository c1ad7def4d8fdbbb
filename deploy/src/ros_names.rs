//! Where two nodes, or ends that nobody connects, become the same name in ROS 2: before anything starts, and not as
//! calls that two components execute or values that nobody hears.
//!
//! Names are made here as the components make them, by `rc_settings::ros`.

use crate::addresses::process_name;
use crate::network::Network;
use rc_cdsl::model::{Backend, Role, Slot};
use rc_codegen::Project;
use rc_ddsl::Endpoint;
use rc_ddsl::model::{Instance, Setting};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, Span};
use rc_idsl::canonical::{interface_hash, operation_hash};
use rc_idsl::model::Operation;
use rc_settings::ros::{self, Rule};
use std::collections::{BTreeMap, BTreeSet};

/// Options of a component after which its names are others than the files say: nothing is said of them.
const RENAMING: [&str; 3] = ["--ros-args", "--set-middleware", "--bind"];
/// How many names a message lists.
const LISTED: usize = 8;

/// A component that is in ROS 2.
struct Node<'a> {
    at: usize,
    instance: &'a Instance,
    project: &'a Project,
    /// What the files say of its domain.
    domain: Option<u16>,
    /// Its name in full.
    name: String,
    rules: Vec<Rule>,
}

/// An operation of a slot that is in ROS 2.
struct End<'a> {
    node: &'a Node<'a>,
    place: Endpoint,
    slot: &'a Slot,
    operation: &'a Operation,
    address: String,
    is_renamed: bool,
}

impl Network {
    /// Finds nodes, services and topics that are several by the network and one in ROS 2.
    pub(crate) fn check_ros_names(&self, found: &mut Diagnostics) {
        let nodes = self.ros_nodes();
        let merged = self.ros_ends(&nodes, found);
        let mut named: BTreeMap<(Option<u16>, &str), Vec<&Node<'_>>> = BTreeMap::new();
        for node in &nodes {
            named
                .entry((node.domain, &node.name))
                .or_default()
                .push(node);
        }
        for ((_, name), mut same) in named {
            let first = same[0].at;
            // Another name for the one that this was told of is another one for its node.
            same.retain(|node| !merged.contains(&(first, node.at)));
            if same.len() > 1 {
                found.push(one_node(name, &same));
            }
        }
    }

    /// The components that are in ROS 2 under names that are known.
    fn ros_nodes(&self) -> Vec<Node<'_>> {
        let instances = self.deployment.instances.iter().zip(&self.projects);
        let nodes = instances
            .enumerate()
            .filter_map(|(at, (instance, project))| {
                let project = project.as_deref()?;
                let mut slots = project.component.slots.iter();
                let is_in_ros = instance.middleware == Backend::Ros2
                    || slots.any(|slot| slot.backend == Some(Backend::Ros2));
                let mut args = instance.args.iter();
                if !is_in_ros || args.any(|a| RENAMING.iter().any(|r| a.text.starts_with(r))) {
                    return None;
                }
                let values = |key| setting(instance, key).map_or(&[][..], |set| &set.values);
                let one = |key| values(key).first().cloned();
                let mut env = instance.env.iter();
                let variable = || {
                    let (_, value) = env.find(|(name, _)| name.text == "ROS_DOMAIN_ID")?;
                    Some(value.text.clone())
                };
                let domain = one("domain").or_else(variable);
                let (namespace, own) = ros::node(
                    self.name(),
                    &process_name(&instance.path),
                    one("namespace"),
                    one("node"),
                );
                let rules = values("remap").iter();
                let rules = rules.filter_map(|rule| Rule::parse(rule, &namespace, &own));
                Some(Node {
                    at,
                    instance,
                    project,
                    domain: domain.and_then(|domain| domain.parse().ok()),
                    name: ros::full(&own, &namespace, ""),
                    rules: rules.collect(),
                })
            });
        nodes.collect()
    }

    /// Compares the ends at each name; gives pairs of components whose own names are one there.
    fn ros_ends(&self, nodes: &[Node<'_>], found: &mut Diagnostics) -> BTreeSet<(usize, usize)> {
        // What is refused has been told, and may be meant to meet.
        let troubles = self.connections.troubles.iter();
        let refused: BTreeSet<Endpoint> = troubles
            .filter(|t| t.other.is_some() && t.finding.severity == Severity::Error)
            .map(|t| t.end)
            .collect();
        let addresses = self.addresses();
        let mut named: BTreeMap<_, Vec<End<'_>>> = BTreeMap::new();
        for node in nodes {
            let component = &node.project.component;
            for (slot, index) in component.slots.iter().zip(0..) {
                let place = Endpoint {
                    instance: node.at,
                    slot: index,
                };
                let backend = slot.backend.unwrap_or(node.instance.middleware);
                if backend != Backend::Ros2 || refused.contains(&place) {
                    continue;
                }
                for operation in &component.library.interface(slot.interface).operations {
                    let address = format!("{}/{}", addresses[&place], operation.name.text);
                    let name =
                        ros::operation(&address, &slot.name, &operation.name.text, &node.rules);
                    let end = End {
                        node,
                        place,
                        slot,
                        operation,
                        is_renamed: name != ros::name(&address),
                        address,
                    };
                    let key = (node.domain, slot.role.is_topic(), name);
                    named.entry(key).or_default().push(end);
                }
            }
        }
        // What is said of one operation holds for the others of a slot, and what is said of the name of a component for
        // all of its slots.
        let (mut told, mut merged) = (BTreeSet::new(), BTreeSet::new());
        for ((_, _, name), ends) in &named {
            let Some((one, other)) = pair(ends) else {
                continue;
            };
            let is_own = one.node.at == other.node.at;
            let is_new = if is_own || one.is_renamed || other.is_renamed {
                told.insert((one.place, other.place))
            } else {
                merged.insert((one.node.at, other.node.at))
            };
            if is_new {
                found.push(one_name(name, one, other));
            }
        }
        merged
    }
}

fn setting<'a>(instance: &'a Instance, key: &str) -> Option<&'a Setting> {
    instance.setting(Backend::Ros2, key)
}

/// Two ends at one name that must not be there together. Ends of one type that somebody has renamed so are meant to meet.
fn pair<'a, 'b>(ends: &'b [End<'a>]) -> Option<(&'b End<'a>, &'b End<'a>)> {
    let (first, others) = ends
        .split_first()
        .filter(|(_, others)| !others.is_empty())?;
    let mut servers = ends.iter().filter(|e| e.slot.role == Role::Implements);
    let servers = servers.next().zip(servers.next());
    let differ = || {
        let types = first.types();
        Some((first, others.iter().find(|other| other.types() != types)?))
    };
    let merged = || {
        let mut usual = ends.iter().filter(|end| !end.is_renamed);
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

    fn name(&self) -> String {
        let (instance, slot) = (&self.node.instance.path, &self.slot.name);
        format!("`{instance}.{slot}/{}`", self.operation.name.text)
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

fn one_name(name: &str, one: &End<'_>, other: &End<'_>) -> Diagnostic {
    let ends = format!("{} and {}", one.name(), other.name());
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
        "they would meet, though nobody connects them"
    };
    let message = format!("{ends} are one {kind} in ROS 2, `{name}`: {effect}");
    let span = other.node.instance.name.span;
    let mut error = Diagnostic::error(code, span, message);
    error = label(error, one.node.instance.name.span, "the other one");
    for end in [one, other] {
        if one.node.at == other.node.at {
            error = label(error, end.slot.span, "one of both");
        }
        if let Some(set) = setting(end.node.instance, "remap").filter(|_| end.is_renamed) {
            error = label(error, set.span, "renamed here");
        }
    }
    error.help(if one.is_renamed || other.is_renamed {
        "give one of them another name in `remap`"
    } else {
        "names of ROS 2 have letters, digits and single `_`: call one of them otherwise, or give it another name in `remap`"
    })
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
        "give one of them a `node` or a `namespace` of its own in `middleware ros2 { … }`, or call it otherwise",
    )
}
