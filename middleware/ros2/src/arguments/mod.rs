//! The command line of ROS 2: `--ros-args -r FROM:=TO -p NAME:=VALUE --log-level LEVEL … --`.
//!
//! The command line is read first, as far as it needs no names. `resolve` then applies what concerns
//! the node, whose name the configuration may set.

mod given;
mod params_file;
mod qos;
mod resolve;

use crate::NAME;
use given::{For, RosArguments, Source, Untyped};
use params_file::scalar;
use rc_middleware::linked::{GivenArguments, NodeArguments};
use rc_vocabulary::{Scalar, Value, ros};
use std::sync::Arc;

/// The arguments of ROS 2, for components that are linked with this backend.
pub(crate) const ARGUMENTS: NodeArguments = NodeArguments {
    help: "\nAs a node of ROS 2, NAME … --ros-args … [--]:\n  \
           -r FROM:=TO           rename; FROM is a slot, SLOT/operation, a full name, __node or __ns\n  \
           -p NAME:=VALUE        set a parameter for this run\n  \
           --params-file FILE    set those that a YAML file has for this node\n  \
           --log-level LEVEL     debug, info, warn, error or fatal\n  \
           --disable-rosout-logs, --disable-stdout-logs, --enable-…\n                        \
           whether the log is published on /rosout and printed\n\n\
           NODE:FROM:=TO, NODE:NAME:=VALUE and NODE:=LEVEL are for that node alone.\n",
    read,
};

/// Usage of `--ros-args`, for messages.
const OPTIONS: &str = "-r FROM:=TO, -p NAME:=VALUE, --params-file FILE, --log-level LEVEL, --enable-rosout-logs, --disable-rosout-logs, --enable-stdout-logs, --disable-stdout-logs, --enable-external-lib-logs, --disable-external-lib-logs and --enclave NAME";

/// Parses the arguments. An error says what is allowed.
fn read(args: Vec<String>) -> Result<Arc<dyn GivenArguments>, String> {
    let mut given = RosArguments::default();
    let out = &mut given;
    let mut args = args.into_iter();
    while let Some(option) = args.next() {
        let mut value = || {
            let missing = || format!("--ros-args: {option} takes a value");
            args.next().ok_or_else(missing)
        };
        match option.as_str() {
            "-r" | "--remap" => remap(&value()?, out)?,
            "-p" | "--param" => out.parameters.push(Source::Argument(parameter(&value()?)?)),
            "--params-file" => out.parameters.push(Source::File(value()?.into())),
            "--log-level" => out.log.push(level(&value()?)?),
            "--enable-rosout-logs" => out.rosout = Some(true),
            "--disable-rosout-logs" => out.rosout = Some(false),
            "--enable-stdout-logs" => out.prints_log = Some(true),
            "--disable-stdout-logs" => out.prints_log = Some(false),
            // A component writes no log through a library of ROS 2.
            "--enable-external-lib-logs" | "--disable-external-lib-logs" => {}
            // An enclave takes effect where security is on, and here it is off.
            "-e" | "--enclave" => enclave(&value()?)?,
            other => {
                return Err(format!(
                    "--ros-args: `{other}` is not known here; there are {OPTIONS}"
                ));
            }
        }
    }
    Ok(Arc::new(given))
}

/// Splits `NODE:REST`, where the node is optional.
fn of_node(text: &str) -> (Option<String>, &str) {
    match text.split_once(':') {
        Some((node, rest)) if ros::is_node(node) && !rest.starts_with('=') => {
            (Some(node.to_owned()), rest)
        }
        _ => (None, text),
    }
}

fn remap(text: &str, out: &mut RosArguments) -> Result<(), String> {
    let (node, rule) = of_node(text);
    let key = match rule.split_once(":=") {
        Some(("__node" | "__name", name)) => Some(("node", name)),
        Some(("__ns", name)) => Some(("namespace", name)),
        _ => None,
    };
    let (key, value) = key.unwrap_or(("remap", rule));
    let Some(known) = rc_vocabulary::key(NAME, key) else {
        return Err(format!("--ros-args: `{key}` cannot be set of {NAME}"));
    };
    let converted = known.kind.convert(Scalar::Text(value));
    let converted = converted.map_err(|_| {
        let allowed = known.kind.allowed();
        format!(
            "--ros-args: -r `{text}` is refused; after -r or -r NODE:, or its `:=`, comes {allowed}"
        )
    })?;
    match converted {
        Value::Remappings(rules) => out.remap.extend(rules.into_iter().map(|value| For {
            node: node.clone(),
            value,
        })),
        value => out.settings.push(For {
            node,
            value: (known.name, value),
        }),
    }
    Ok(())
}

fn parameter(text: &str) -> Result<For<(String, Untyped)>, String> {
    let (node, rule) = of_node(text);
    match rule.split_once(":=") {
        Some((name, value)) if !name.is_empty() => {
            if let Some(rule) = name.strip_prefix(qos::QOS) {
                qos::quality(rule, value)?;
            }
            let given = Untyped {
                text: Some(value.to_owned()),
                value: scalar(value),
            };
            let value = (name.to_owned(), given);
            Ok(For { node, value })
        }
        _ => Err(format!(
            "--ros-args: -p takes NAME:=VALUE or NODE:NAME:=VALUE, as in `-p motors[0].max:=1.5`, not `{text}`"
        )),
    }
}

/// The level of the log for a level of ROS 2, and the logger that it is for.
fn level(text: &str) -> Result<For<&'static str>, String> {
    let (node, level) = match text.split_once(":=") {
        Some((node, level)) => (Some(node.to_owned()), level),
        None => (None, text),
    };
    let value = match level.to_ascii_lowercase().as_str() {
        "debug" => "debug",
        "info" => "info",
        "warn" => "warn",
        // `error` is the highest level.
        "error" | "fatal" => "error",
        _ => {
            return Err(format!(
                "--ros-args: `{level}` is not a log level; there are debug, info, warn, error and fatal, alone or as NODE:=LEVEL"
            ));
        }
    };
    if node.as_deref() == Some("") {
        return Err(format!(
            "--ros-args: --log-level takes LEVEL or NODE:=LEVEL, not `{text}`"
        ));
    }
    Ok(For { node, value })
}

fn enclave(name: &str) -> Result<(), String> {
    let secure = std::env::var("ROS_SECURITY_ENABLE").is_ok_and(|value| value == "true");
    if secure && std::env::var("ROS_SECURITY_STRATEGY").is_ok_and(|value| value == "Enforce") {
        return Err(format!(
            "--ros-args: the enclave `{name}` must be secure (ROS_SECURITY_STRATEGY is Enforce), and components neither encrypt nor sign"
        ));
    }
    if ros::is_namespace(name) {
        return Ok(());
    }
    Err(format!(
        "--ros-args: `{name}` is not an enclave; allowed is an absolute name such as `/robot/lidar`"
    ))
}
