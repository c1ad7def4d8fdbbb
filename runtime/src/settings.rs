//! The settings of middlewares. The command line precedes the configuration.

use crate::arguments::Arguments;
use crate::configuration::{LoadedConfiguration, configured};
use crate::description::Description;
use crate::slots::{NamedSlot, OpenSlot, SlotTable};
use rc_management::component::Role;
use rc_middleware::linked::{TopicNames, TopicOverride, UnmatchedRule};
use rc_middleware::{OpenError, Qos, Reliability, Settings};
use rc_vocabulary::Value;
use rc_vocabulary::qos;

/// Collects all settings. The log reports a rule that matches nothing in the component; a network
/// may have it for another component.
pub(crate) fn settings(
    description: &Description,
    arguments: &Arguments,
    loaded: &LoadedConfiguration,
    slots: &SlotTable,
) -> Result<Settings, OpenError> {
    let mut settings = configured(&loaded.configuration);
    settings.extend(&arguments.settings);
    settings.extend(&loaded.node.settings);
    if let Some((middleware, given)) = &arguments.node {
        for (key, rules) in &loaded.node.rules {
            prepend(&mut settings, middleware, key, rules.clone());
        }
        let names = given.topic_names(&arguments.node_name(), &settings);
        let topics = topics(slots, middleware)?;
        let overrides = overrides(description, &loaded.node.qos, &topics, &names);
        if !overrides.is_empty() {
            prepend(&mut settings, middleware, "qos", Value::Qos(overrides));
        }
        let option = option(middleware);
        for ignored in &loaded.node.ignored {
            tracing::warn!("{option}: {ignored}");
        }
    }
    make_reliable(&arguments.reliable, &mut settings, slots)?;
    warn(description, &settings, slots)?;
    Ok(settings)
}

/// Adds the rules of `--reliable` behind those that are set, which precede.
fn make_reliable(
    reliable: &[String],
    settings: &mut Settings,
    slots: &SlotTable,
) -> Result<(), OpenError> {
    let named = slots.named()?;
    let reliable: Vec<String> = reliable.iter().map(|slot| slot.replace('.', "/")).collect();
    for slot in named.iter().filter(|slot| reliable.contains(&slot.path)) {
        let rule = qos::Rule {
            target: slot.path.clone(),
            policy: qos::Policy::Reliability(Reliability::Reliable),
        };
        for middleware in &slot.transports {
            let mut rules = settings.qos(middleware, "qos").to_vec();
            rules.push(rule.clone());
            settings.set(middleware, "qos", Value::Qos(rules));
        }
    }
    Ok(())
}

/// The option that begins the arguments of nodes.
fn option(middleware: &str) -> &'static str {
    let known = rc_vocabulary::Middleware::from_word(middleware);
    let option = known.and_then(|middleware| middleware.can().node_arguments);
    option.unwrap_or_default()
}

/// Adds rules in front of those that are set.
fn prepend(settings: &mut Settings, middleware: &str, key: &str, mut rules: Value) {
    if let Some(later) = settings.value(middleware, key) {
        rules.append(later.clone());
    }
    settings.set(middleware, key, rules);
}

/// The slots of topics of a middleware. For arrays, the members that the network lists.
fn topics(slots: &SlotTable, middleware: &str) -> Result<Vec<NamedSlot>, OpenError> {
    let mut topics = slots.named()?;
    topics.retain(|slot| {
        slot.transports.contains(&middleware)
            && matches!(slot.of.role, Role::Publishes | Role::SubscribesTo)
    });
    Ok(topics)
}

/// The quality of service that arguments set by the names of topics in the middleware, as rules by
/// slot and operation.
fn overrides(
    description: &Description,
    given: &[TopicOverride],
    topics: &[NamedSlot],
    names: &TopicNames,
) -> Vec<qos::Rule> {
    let mut named = Vec::new();
    for NamedSlot {
        path, of, address, ..
    } in topics
    {
        for operation in of.operations {
            let topic = names(address, path, operation.name);
            named.push((topic, of.role, format!("{path}/{}", operation.name)));
        }
    }
    let mut rules = Vec::new();
    for TopicOverride {
        topic,
        role,
        policy,
    } in given
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
    rules
}

/// Logs the rules that match nothing in this component.
fn warn(
    description: &Description,
    settings: &Settings,
    slots: &SlotTable,
) -> Result<(), OpenError> {
    let operations = |slot: &NamedSlot| {
        let names: Vec<&str> = slot.of.operations.iter().map(|o| o.name).collect();
        (slot.path.clone(), names)
    };
    let named = |slots: &[NamedSlot]| slots.iter().map(operations).collect::<Vec<_>>();
    let all = named(&slots.named()?);
    let all: Vec<(&str, Vec<&str>)> = all.iter().map(|(n, o)| (n.as_str(), o.clone())).collect();
    let name = description.name;
    for linked in description.backends {
        let middleware = linked.name;
        let unmatched = (linked.unmatched)(settings, &all).into_iter();
        for UnmatchedRule { rule, target, help } in unmatched {
            if !slots.may_have(&target) {
                tracing::warn!("{rule}: {name} has no `{target}`; {help}");
            }
        }
        let topics = named(&topics(slots, middleware)?);
        let mut topics: Vec<(&str, Vec<&str>)> = topics
            .iter()
            .map(|(n, o)| (n.as_str(), o.clone()))
            .collect();
        // A rule for an array is one for all of its members.
        let arrays = description.slots.iter().filter(|slot| slot.is_array);
        topics.extend(
            arrays.map(|slot| (slot.name, slot.operations.iter().map(|o| o.name).collect())),
        );
        for rule in settings.qos(middleware, "qos") {
            let target = &rule.target;
            if let Some(hint) = qos::unknown_topic_help(target, &topics)
                && !slots.may_have(target)
            {
                tracing::warn!(
                    "qos `{rule}`: {name} has no topic `{target}` over {middleware}; {hint}"
                );
            }
        }
    }
    Ok(())
}

/// The quality of service of a topic over a middleware: that of its slot, changed by the settings. A rule for a
/// member precedes one for its array.
pub(crate) fn topic_qos(
    slot: &OpenSlot,
    operation: usize,
    middleware: &str,
    settings: &Settings,
) -> Qos {
    let mut qos = slot.qos;
    let rules = settings.qos(middleware, "qos");
    let operation = slot.operations[operation].name;
    let mut policies = qos::policies(rules, slot.slot.name, operation);
    if slot.member.is_some() {
        policies.extend(qos::policies(rules, &slot.path(), operation));
    }
    for policy in policies {
        qos.set(policy);
    }
    qos
}
