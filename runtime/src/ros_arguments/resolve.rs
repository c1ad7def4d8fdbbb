//! Applies the arguments of ROS 2 to a node, whose name and namespace are then known.

use super::qos::{QOS, quality};
use super::{For, RosArguments, Source, params_file};
use crate::arguments::{Arguments, RosOverride};
use crate::description::ROS2;
use rc_configuration::UntypedValue;
use rc_middleware::Settings;
use rc_vocabulary::ros::{self, Remapping};
use rc_vocabulary::{Kind, Value};
use serde_json::Value as Json;

/// Values that the arguments of ROS 2 set for this node.
#[derive(Debug, Default)]
pub(crate) struct RosOverrides {
    /// Rules for names, which precede those of the settings.
    pub(crate) remap: Vec<Remapping>,
    /// The settings of the node.
    pub(crate) settings: Settings,
    /// The quality of service of topics, which precedes that of the settings.
    pub(crate) qos: Vec<RosOverride>,
    /// The parameters of the `.pdsl`, each once, by their paths.
    pub(crate) parameters: Vec<Override>,
    /// The level of the log.
    pub(crate) log: Option<&'static str>,
    /// Arguments that are for other nodes, for the log.
    pub(crate) ignored: Vec<String>,
}

/// A value for a parameter.
#[derive(Debug)]
pub(crate) struct Override {
    pub(crate) name: String,
    pub(crate) value: UntypedValue,
    /// Where the value comes from, for messages.
    pub(crate) from: String,
    /// Whether the component need not have the parameter, since the file is for many nodes.
    pub(crate) is_optional: bool,
}

/// Parameters that every node of ROS 2 has, and that change nothing here.
const WITHOUT_EFFECT: [&str; 1] = ["start_type_description_service"];

/// Applies the arguments to the node. `configured` are the settings of the configuration. An error
/// ends with a line feed.
pub(crate) fn resolve(
    arguments: &Arguments,
    configured: &Settings,
) -> Result<RosOverrides, String> {
    let mut out = RosOverrides::default();
    let given = &arguments.ros;
    let usual = |settings: &Settings, key: &str| {
        let set = settings
            .text(ROS2, key)
            .or_else(|| arguments.settings.text(ROS2, key));
        set.or_else(|| configured.text(ROS2, key))
            .map(str::to_owned)
    };
    let name = |settings: &Settings| {
        let own = |key: &str| usual(settings, key);
        ros::node(
            &arguments.network,
            &arguments.name,
            own("namespace"),
            own("node"),
        )
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
            out.settings.set(ROS2, key, value.clone());
        }
    }
    let (namespace, node) = name(&out.settings);
    // A namespace of a file is that of the node alone; one of the command line is that of its
    // names, too.
    if out.settings.text(ROS2, "namespace").is_some() {
        out.remap
            .push(Remapping::of_namespace(&arguments.network, &namespace));
    }
    let names = [first.as_str(), node.as_str()];
    for For { node, value } in &given.remap {
        if is_for(
            node.as_ref(),
            &names,
            &format!("-r {value}"),
            &mut out.ignored,
        ) {
            out.remap.push(value.clone());
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
        out.settings.set(ROS2, "rosout", Value::Bool(rosout));
    }
    parameters(given, &names, &path, &mut out)?;
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
    out: &mut RosOverrides,
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
                    let value = UntypedValue { text: None, value };
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
    value: UntypedValue,
    from: &str,
    is_optional: bool,
    out: &mut RosOverrides,
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
        out.settings.set(ROS2, name, value);
        return Ok(());
    }
    if WITHOUT_EFFECT.contains(&name) {
        return Ok(());
    }
    out.parameters.retain(|other| other.name != name);
    out.parameters.push(Override {
        name: name.to_owned(),
        value,
        from: from.to_owned(),
        is_optional,
    });
    Ok(())
}
