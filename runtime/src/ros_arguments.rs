//! The command line of ROS 2: `--ros-args -r FROM:=TO -p NAME:=VALUE --log-level LEVEL … --`.

use crate::arguments::{Arguments, ROS2, RosOverride};
use crate::description::Description;
use rc_management::component::Role;
use rc_settings::qos::Policy;
use rc_settings::{Scalar, Value};
use std::ffi::OsString;

/// Splits the command line into the arguments outside and inside `--ros-args … --`.
pub(crate) fn split(
    args: impl IntoIterator<Item = OsString>,
) -> (Vec<OsString>, Option<Vec<OsString>>) {
    let (mut own, mut ros, mut inside) = (Vec::new(), None, false);
    for arg in args {
        match arg.to_str() {
            Some("--ros-args") => {
                inside = true;
                ros.get_or_insert_with(Vec::new);
            }
            Some("--") if inside => inside = false,
            _ if inside => ros.get_or_insert_with(Vec::new).push(arg),
            _ => own.push(arg),
        }
    }
    (own, ros)
}

/// The prefix of parameters that set the quality of service of topics.
const QOS: &str = "qos_overrides.";

/// Adds the arguments of ROS 2 to `out`. An error says what is allowed.
pub(crate) fn read(
    description: &Description,
    args: Vec<OsString>,
    out: &mut Arguments,
) -> Result<(), String> {
    if !description.backends.iter().any(|(name, _)| *name == ROS2) {
        return Err(format!(
            "--ros-args is for components that use ros2, and {} does not; generate it with --middleware ros2, or see --help",
            description.name
        ));
    }
    let mut args = args.into_iter().map(|arg| {
        let wrong = |arg: OsString| format!("--ros-args: `{}` is not UTF-8", arg.to_string_lossy());
        arg.into_string().map_err(wrong)
    });
    while let Some(option) = args.next() {
        let option = option?;
        let mut value = || {
            let missing = || Err(format!("--ros-args: {option} takes a value"));
            args.next().unwrap_or_else(missing)
        };
        match option.as_str() {
            "-r" | "--remap" => remap(&value()?, out)?,
            "-p" | "--param" => match parameter(&value()?)? {
                (name, value) if name.starts_with(QOS) => {
                    out.qos.extend(quality(&name[QOS.len()..], &value)?);
                }
                parameter => out.parameters.push(parameter),
            },
            "--log-level" => out.log = Some(level(&value()?)?.to_owned()),
            "--params-file" => {
                return Err(format!(
                    "--ros-args: the parameters of {} are in its own configuration; write them there and name it with --config FILE, or give single ones with -p NAME:=VALUE",
                    description.name
                ));
            }
            "-e" | "--enclave" => {
                return Err(
                    "--ros-args: there is no security here, so an enclave would protect nothing"
                        .to_owned(),
                );
            }
            other => {
                return Err(format!(
                    "--ros-args: `{other}` is not known here; there are -r FROM:=TO, -p NAME:=VALUE and --log-level LEVEL"
                ));
            }
        }
    }
    Ok(())
}

fn remap(rule: &str, out: &mut Arguments) -> Result<(), String> {
    let key = match rule.split_once(":=") {
        Some(("__node" | "__name", name)) => Some(("node", name)),
        Some(("__ns", name)) => Some(("namespace", name)),
        _ => None,
    };
    let (key, value) = key.unwrap_or(("remap", rule));
    let Some(known) = rc_settings::key(ROS2, key) else {
        return Err(format!("--ros-args: `{key}` cannot be set of {ROS2}"));
    };
    let converted = known.kind.convert(Scalar::Text(value));
    let converted = converted.map_err(|_| {
        let allowed = known.kind.allowed();
        format!("--ros-args: -r `{rule}` is refused; behind -r, or its `:=`, is {allowed}")
    })?;
    match converted {
        Value::Remappings(rules) => out.remap.extend(rules),
        value => out.settings.set(ROS2, key, value),
    }
    Ok(())
}

fn parameter(text: &str) -> Result<(String, String), String> {
    match text.split_once(":=") {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err(format!(
            "--ros-args: -p takes NAME:=VALUE, as in `-p motors[0].max:=1.5`, not `{text}`"
        )),
    }
}

/// The level of the log for a level of ROS 2.
fn level(text: &str) -> Result<&'static str, String> {
    Ok(match text.to_ascii_lowercase().as_str() {
        "debug" => "debug",
        "info" => "info",
        "warn" => "warn",
        // `error` is the highest level.
        "error" | "fatal" => "error",
        _ => {
            return Err(format!(
                "--ros-args: `{text}` is not a log level; there are debug, info, warn, error and fatal"
            ));
        }
    })
}

/// Parses `TOPIC.publisher.POLICY` or `TOPIC.subscription.POLICY` with a value in the words of ROS 2. Durations are
/// integers, in nanoseconds. The result is none for a value that always holds.
fn quality(name: &str, value: &str) -> Result<Option<RosOverride>, String> {
    let form = || {
        format!(
            "--ros-args: `{QOS}{name}` is not {QOS}TOPIC.publisher.POLICY or {QOS}TOPIC.subscription.POLICY, with the topic in full, such as {QOS}/scan.publisher.depth"
        )
    };
    let (left, policy) = name.rsplit_once('.').ok_or_else(form)?;
    let (topic, end) = left.rsplit_once('.').ok_or_else(form)?;
    let role = match end {
        "publisher" => Role::Publishes,
        "subscription" => Role::SubscribesTo,
        _ => return Err(form()),
    };
    if !topic.starts_with('/') || !rc_settings::ros::is_name(topic) {
        return Err(form());
    }
    let value = value.trim_matches(['"', '\'']);
    let policy = match (policy, value) {
        ("history", "keep_last")
        | ("liveliness", "automatic")
        | ("avoid_ros_namespace_conventions", "false") => return Ok(None),
        ("history" | "liveliness" | "avoid_ros_namespace_conventions", _) => {
            return Err(format!(
                "--ros-args: `{QOS}{name}` cannot be `{value}`; history is keep_last, liveliness is automatic, and names are those of ROS"
            ));
        }
        ("deadline" | "lifespan" | "liveliness_lease_duration", _) => {
            let nanoseconds: u64 = value.parse().map_err(|_| {
                format!("--ros-args: `{QOS}{name}` takes nanoseconds, not `{value}`")
            })?;
            let own = match policy {
                "liveliness_lease_duration" => "liveliness",
                own => own,
            };
            // In ROS 2, 0 and the largest duration mean that there is no limit.
            let is_none = nanoseconds == 0 || nanoseconds >= i64::MAX as u64;
            let limit = if is_none {
                Scalar::Text("none")
            } else {
                Scalar::Duration(nanoseconds)
            };
            Policy::convert(own, limit)
        }
        (own, value) => Policy::parse(own, value),
    };
    Ok(Some(RosOverride {
        topic: topic.to_owned(),
        role,
        policy: policy.map_err(|error| format!("--ros-args: {error}"))?,
    }))
}
