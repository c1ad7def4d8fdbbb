//! The quality of service of a channel, in the form of rosbag2's metadata.

use rc_management::observation::QosDescription;

/// The longest duration of ROS 2: without end.
const ENDLESS: &str = "sec: 9223372036\n    nsec: 854775807";

/// A list of one profile, as YAML.
pub fn profile(qos: &QosDescription) -> String {
    let reliability = if qos.reliable { 1 } else { 2 };
    let durability = if qos.transient_local { 1 } else { 2 };
    let time = |ms: Option<f64>| {
        ms.map_or(ENDLESS.to_owned(), |ms| {
            let ns = (ms * 1e6) as u64;
            format!(
                "sec: {}\n    nsec: {}",
                ns / 1_000_000_000,
                ns % 1_000_000_000
            )
        })
    };
    format!(
        "- history: 1\n  depth: {}\n  reliability: {reliability}\n  durability: {durability}\n  \
         deadline:\n    {}\n  lifespan:\n    {}\n  liveliness: 1\n  \
         liveliness_lease_duration:\n    {}\n  avoid_ros_namespace_conventions: false",
        qos.depth,
        time(qos.deadline_ms),
        time(qos.lifespan_ms),
        time(qos.liveliness_ms),
    )
}
