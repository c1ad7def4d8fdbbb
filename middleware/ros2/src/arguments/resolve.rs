//! Applies the arguments of ROS 2 to a node, whose name and namespace are then known.

use super::given::{For, RosArguments, Source, Untyped};
use super::params_file;
use super::qos::{QOS, quality};
use crate::{NAME, remap};
use rc_middleware::Settings;
use rc_middleware::linked::{GivenArguments, NodeName, Overrides, ParameterOverride, TopicNames};
use rc_vocabulary::ros::{self, Remapping, ResolvedRemapping};
use rc_vocabulary::{Kind, Value};
use serde_json::Value as Json;

/// Parameters that every node of ROS 2 has, and that change nothing here.
const WITHOUT_EFFECT: [&str; 1] = ["start_type_description_service"];

impl GivenArguments for RosArguments {
    fn prints_log(&self) -> Option<bool> {
        self.prints_log
    }

    fn resolve(
        &self,
        node: &NodeName<'_>,
        set: &Settings,
        configured: &Settings,
    ) -> Result<Overrides, String> {
        resolve(self, node, set, configured)
    }

    fn topic_names(&self, node: &NodeName<'_>, settings: &Settings) -> TopicNames {
        let own = |key: &str| settings.text(NAME, key).map(str::to_owned);
        let (namespace, name) = ros::node(node.network, node.name, own("namespace"), own("node"));
        let remap = remap::rules(settings).iter();
        let remap = remap.map(|rule| rule.resolve(&namespace, &name));
        let remap: Vec<ResolvedRemapping> = remap.collect();
        Box::new(move |address, slot, operation| {
            let address = address.join(operation);
            ros::operation(address.as_str(), slot, operation, &remap)
        })
    }
}

fn resolve(
    given: &RosArguments,
    of: &NodeName<'_>,
    set: &Settings,
    configured: &Settings,
) -> Result<Overrides, String> {
    let mut out = Overrides::default();
    let mut remap = Vec::new();
    let usual = |settings: &Settings, key: &str| {
        let set = settings.text(NAME, key).or_else(|| set.text(NAME, key));
        set.or_else(|| configured.text(NAME, key))
            .map(str::to_owned)
    };
    let name = |settings: &Settings| {
        let own = |key: &str| usual(settings, key);
        ros::node(of.network, of.name, own("namespace"), own("node"))
    };
    let (_, first) = name(&out.settings);
    for For {
        node,
        value: (key, value),
    } in &given.settings
    {
        if is_for(
            node.as_ref(),
            &[&first],
            &format!("-r {key}"),
            &mut out.ignored,
        ) {
            out.settings.set(NAME, key, value.clone());
        }
    }
    let (namespace, node) = name(&out.settings);
    // A namespace of a file is that of the node alone; one of the command line is that of its
    // names, too.
    if out.settings.text(NAME, "namespace").is_some() {
        remap.push(Remapping::of_namespace(of.network, &namespace));
    }
    let names = [first.as_str(), node.as_str()];
    for For { node, value } in &given.remap {
        if is_for(
            node.as_ref(),
            &names,
            &format!("-r {value}"),
            &mut out.ignored,
        ) {
            remap.push(value.clone());
        }
    }
    let path = ros::full(&node, &namespace, &node);
    let logger = path.trim_start_matches('/').replace('/', ".");
    for For { node, value } in &given.log {
        let loggers = [names[0], names[1], &logger];
        if is_for(
            node.as_ref(),
            &loggers,
            &format!("--log-level {value}"),
            &mut out.ignored,
        ) {
            out.log = Some(value);
        }
    }
    if let Some(rosout) = given.rosout {
        out.settings.set(NAME, "rosout", Value::Bool(rosout));
    }
    parameters(given, &names, &path, &mut out)?;
    if !remap.is_empty() {
        out.rules.push((remap::KEY, Value::Remappings(remap)));
    }
    Ok(out)
}

/// Whether an argument is for this node. Notes arguments that are not.
fn is_for(node: Option<&String>, names: &[&str], what: &str, ignored: &mut Vec<String>) -> bool {
    let Some(node) = node else {
        return true;
    };
    let is_ours = names.contains(&node.as_str());
    if !is_ours {
        ignored.push(format!(
            "{what} is for `{node}`; this node is `{}`",
            names.last().copied().unwrap_or_default()
        ));
    }
    is_ours
}

fn parameters(
    given: &RosArguments,
    names: &[&str],
    path: &str,
    out: &mut Overrides,
) -> Result<(), String> {
    for source in &given.parameters {
        match source {
            Source::Argument(For {
                node,
                value: (name, value),
            }) => {
                if is_for(
                    node.as_ref(),
                    names,
                    &format!("-p {name}"),
                    &mut out.ignored,
                ) {
                    set(name, value.clone(), "-p", false, out)?;
                }
            }
            Source::File(file) => {
                let from = file.display().to_string();
                for (name, value) in params_file::parameters(file, path)? {
                    let value = Untyped { text: None, value };
                    set(&name, value, &from, true, out)?;
                }
            }
        }
    }
    Ok(())
}

/// Sets one parameter. The last value counts.
fn set(
    name: &str,
    value: Untyped,
    from: &str,
    is_optional: bool,
    out: &mut Overrides,
) -> Result<(), String> {
    let text = || match (&value.text, &value.value) {
        (Some(text), _) | (None, Json::String(text)) => text.clone(),
        (None, other) => other.to_string(),
    };
    if let Some(rule) = name.strip_prefix(QOS) {
        let rule = quality(rule, &text()).map_err(|error| format!("{error}\n"))?;
        // The first rule of a topic counts.
        out.qos.splice(0..0, rule);
        return Ok(());
    }
    // Every node of ROS 2 has this parameter.
    if name == "use_sim_time" {
        let value = Kind::Bool.parse(&text().to_ascii_lowercase());
        let value = value.map_err(|_| {
            let (is, allowed) = (text(), Kind::Bool.allowed());
            format!("error: {from}: `{name}` cannot be `{is}`; allowed is {allowed}\n")
        })?;
        out.settings.set(NAME, name, value);
        return Ok(());
    }
    if WITHOUT_EFFECT.contains(&name) {
        return Ok(());
    }
    out.parameters.retain(|other| other.name != name);
    out.parameters.push(ParameterOverride {
        name: name.to_owned(),
        text: value.text,
        value: value.value,
        from: from.to_owned(),
        is_optional,
    });
    Ok(())
}
