//! The settings of middlewares. The command line precedes the configuration.

use crate::addresses::address;
use crate::arguments::{Arguments, ROS2, RosOverride};
use crate::configuration::{LoadedConfiguration, configured};
use crate::description::{Description, Slot};
use crate::ros_arguments::RosOverrides;
use rc_management::component::Role;
use rc_middleware::{Address, Durability, OpenError, Qos, Reliability, Settings};
use rc_settings::Value;
use rc_settings::qos::{self, Policy};
use rc_settings::ros::ResolvedRemapping;
use std::collections::BTreeMap;

/// Collects all settings. The log reports a rule that matches nothing in the component; a network may have it for
/// another component.
pub(crate) fn settings(
    description: &Description,
    arguments: &Arguments,
    loaded: &LoadedConfiguration,
    bindings: &BTreeMap<String, Address>,
) -> Result<Settings, OpenError> {
    let ros = &loaded.ros;
    let mut settings = configured(&loaded.configuration);
    settings.extend(&arguments.settings);
    settings.extend(&ros.settings);
    if !ros.remap.is_empty() {
        prepend(&mut settings, "remap", Value::Remappings(ros.remap.clone()));
    }
    let overrides = overrides(description, arguments, ros, &settings, bindings)?;
    if !overrides.is_empty() {
        prepend(&mut settings, "qos", Value::Qos(overrides));
    }
    warn(description, &settings);
    for ignored in &ros.ignored {
        tracing::warn!("--ros-args: {ignored}");
    }
    Ok(settings)
}

/// Adds rules in front of those that are set.
fn prepend(settings: &mut Settings, key: &str, mut rules: Value) {
    if let Some(later) = settings.value(ROS2, key) {
        rules.append(later.clone());
    }
    settings.set(ROS2, key, rules);
}

/// The slots of topics that a middleware carries.
fn topics(description: &Description, middleware: &str) -> impl Iterator<Item = &'static Slot> {
    let slots = description.slots.iter();
    slots.filter(move |slot| {
        slot.backend == middleware && matches!(slot.role, Role::Publishes | Role::SubscribesTo)
    })
}

/// The quality of service that the command line of ROS 2 sets by topic, as rules by slot and operation.
fn overrides(
    description: &Description,
    arguments: &Arguments,
    ros: &RosOverrides,
    settings: &Settings,
    bindings: &BTreeMap<String, Address>,
) -> Result<Vec<qos::Rule>, OpenError> {
    if ros.qos.is_empty() {
        return Ok(Vec::new());
    }
    let own = |key: &str| settings.text(ROS2, key).map(str::to_owned);
    let (network, name) = (&arguments.network, &arguments.name);
    let (namespace, node) = rc_settings::ros::node(network, name, own("namespace"), own("node"));
    let remap = settings.remappings(ROS2, "remap").iter();
    let remap = remap.map(|rule| rule.resolve(&namespace, &node));
    let remap: Vec<ResolvedRemapping> = remap.collect();
    let mut named = Vec::new();
    for slot in topics(description, ROS2) {
        let own_address = address(network, slot, bindings)?;
        for operation in slot.operations {
            let own = own_address.join(operation.name);
            let topic =
                rc_settings::ros::operation(own.as_str(), slot.name, operation.name, &remap);
            named.push((
                topic,
                slot.role,
                format!("{}/{}", slot.name, operation.name),
            ));
        }
    }
    let mut rules = Vec::new();
    for RosOverride {
        topic,
        role,
        policy,
    } in &ros.qos
    {
        let of = named
            .iter()
            .filter(|(name, r, _)| (name, r) == (topic, role));
        let of = of.map(|(_, _, own)| qos::Rule {
            target: own.clone(),
            policy: *policy,
        });
        let before = rules.len();
        rules.extend(of);
        if rules.len() == before {
            let names = named.iter().filter(|(_, r, _)| r == role);
            let names: Vec<&str> = names.map(|(name, ..)| name.as_str()).collect();
            let hint = match rc_diagnostics::nearest(topic, names.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("there are: {}", names.join(", ")),
            };
            let (name, word) = (description.name, role.word());
            tracing::warn!("qos_overrides: {name} has no topic `{topic}` that it {word}; {hint}");
        }
    }
    Ok(rules)
}

/// Logs the rules that match nothing in this component.
fn warn(description: &Description, settings: &Settings) {
    let of = |slot: &Slot| slot.operations.iter().map(|o| o.name).collect();
    let name = description.name;
    let slots: Vec<(&str, Vec<&str>)> = description.slots.iter().map(|s| (s.name, of(s))).collect();
    for (middleware, _) in description.backends {
        for rule in settings.remappings(middleware, "remap") {
            let from = &rule.from;
            if let Some(hint) = rc_settings::ros::unknown_target_help(from, &slots) {
                tracing::warn!("remap `{rule}`: {name} has no `{from}`; {hint}");
            }
        }
        let topics = topics(description, middleware).map(|slot| (slot.name, of(slot)));
        let topics: Vec<(&str, Vec<&str>)> = topics.collect();
        for rule in settings.qos(middleware, "qos") {
            let target = &rule.target;
            if let Some(hint) = qos::unknown_topic_help(target, &topics) {
                tracing::warn!(
                    "qos `{rule}`: {name} has no topic `{target}` over {middleware}; {hint}"
                );
            }
        }
    }
}

/// The quality of service of a topic: that of its slot, changed by the settings.
pub(crate) fn topic_qos(slot: &Slot, operation: usize, settings: &Settings) -> Qos {
    let mut qos = slot.qos;
    let rules = settings.qos(slot.backend, "qos");
    for policy in qos::policies(rules, slot.name, slot.operations[operation].name) {
        match policy {
            Policy::Reliable(true) => qos.reliability = Reliability::Reliable,
            Policy::Reliable(false) => qos.reliability = Reliability::BestEffort,
            Policy::TransientLocal(true) => qos.durability = Durability::TransientLocal,
            Policy::TransientLocal(false) => qos.durability = Durability::Volatile,
            Policy::Depth(depth) => qos.depth = depth,
            Policy::Deadline(limit) => qos.deadline = limit,
            Policy::Lifespan(limit) => qos.lifespan = limit,
            Policy::Liveliness(limit) => qos.liveliness = limit,
        }
    }
    qos
}
