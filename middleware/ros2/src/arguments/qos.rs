//! The quality of service that parameters of ROS 2 set: `qos_overrides.TOPIC.END.POLICY`.

use rc_middleware::linked::TopicOverride;
use rc_vocabulary::{Role, Scalar};

/// The prefix of these parameters.
pub(super) const QOS: &str = "qos_overrides.";

/// Parses `TOPIC.publisher.POLICY` or `TOPIC.subscription.POLICY` with a value in the words of ROS
/// 2. Durations are integers, in nanoseconds. The result is none for a value that always holds.
pub(super) fn quality(name: &str, value: &str) -> Result<Option<TopicOverride>, String> {
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
    if !topic.starts_with('/') || !rc_vocabulary::ros::is_name(topic) {
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
            rc_vocabulary::qos::convert(own, limit)
        }
        (own, value) => rc_vocabulary::qos::parse(own, value),
    };
    Ok(Some(TopicOverride {
        topic: topic.to_owned(),
        role,
        policy: policy.map_err(|error| format!("--ros-args: {error}"))?,
    }))
}
