//! The quality of service of a channel, in the form of rosbag2's metadata.

use rc_middleware::{Durability, Qos, Reliability};
use std::time::Duration;

/// The longest duration of ROS 2: without end.
const ENDLESS: &str = "sec: 9223372036\n    nsec: 854775807";

/// A list of one profile, as YAML.
pub fn profile(qos: &Qos) -> String {
    let reliability = match qos.reliability {
        Reliability::Reliable => 1,
        Reliability::BestEffort => 2,
    };
    let durability = match qos.durability {
        Durability::TransientLocal => 1,
        Durability::Volatile => 2,
    };
    let time = |time: Option<Duration>| {
        time.map_or(ENDLESS.to_owned(), |time| {
            format!("sec: {}\n    nsec: {}", time.as_secs(), time.subsec_nanos())
        })
    };
    format!(
        "- history: 1\n  depth: {}\n  reliability: {reliability}\n  durability: {durability}\n  \
         deadline:\n    {}\n  lifespan:\n    {}\n  liveliness: 1\n  \
         liveliness_lease_duration:\n    {}\n  avoid_ros_namespace_conventions: false",
        qos.depth,
        time(qos.deadline),
        time(qos.lifespan),
        time(qos.liveliness),
    )
}
