//! The quality of service of a channel, in the form of rosbag2's metadata.

use crate::keys;
use rc_middleware::{Durability, Qos, Reliability};
use std::collections::BTreeMap;
use std::time::Duration;

/// The longest duration of ROS 2: without end.
const ENDLESS: &str = "sec: 9223372036\n    nsec: 854775807";

/// A list of one profile, as YAML.
pub fn profile(qos: &Qos) -> String {
    // All fields, so that a new policy is not forgotten here.
    let Qos {
        reliability,
        durability,
        depth,
        deadline,
        lifespan,
        liveliness,
        timeout: _,
        spin: _,
        fresh: _,
        stale: _,
        cache: _,
        latest: _,
    } = *qos;
    let reliability = match reliability {
        Reliability::Reliable => 1,
        Reliability::BestEffort => 2,
    };
    let durability = match durability {
        Durability::TransientLocal => 1,
        Durability::Volatile => 2,
    };
    let time = |time: Option<Duration>| {
        time.map_or(ENDLESS.to_owned(), |time| {
            format!("sec: {}\n    nsec: {}", time.as_secs(), time.subsec_nanos())
        })
    };
    format!(
        "- history: 1\n  depth: {depth}\n  reliability: {reliability}\n  durability: {durability}\n  \
         deadline:\n    {}\n  lifespan:\n    {}\n  liveliness: 1\n  \
         liveliness_lease_duration:\n    {}\n  avoid_ros_namespace_conventions: false",
        time(deadline),
        time(lifespan),
        time(liveliness),
    )
}

/// Whether the last message of a channel with these metadata holds until the next one: a state,
/// parameters, or a topic whose last samples reach late subscribers (`transient_local`).
pub fn is_latched(metadata: &BTreeMap<String, String>) -> bool {
    let kind = metadata.get(keys::KIND).map(String::as_str);
    let profile = metadata.get(keys::QOS).map_or("", String::as_str);
    // Newer versions of rosbag2 write words.
    let is_kept = |line: &str| {
        matches!(
            line.trim().trim_start_matches("- "),
            "durability: 1" | "durability: transient_local"
        )
    };
    matches!(kind, Some("state" | "parameters")) || profile.lines().any(is_kept)
}
