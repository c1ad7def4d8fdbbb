//! The keys of each middleware.

use crate::duration::LONGEST;
use crate::kind::Kind;
use crate::value::Value;
use std::ops::RangeInclusive;
use std::time::Duration;

/// One setting of a middleware.
#[derive(Debug, PartialEq, Eq)]
pub struct Key {
    /// The name, as users write it.
    pub name: &'static str,
    /// The values that it takes.
    pub kind: Kind,
    /// The default value. `None` if there is none, or if the middleware finds one
    /// by itself.
    pub default: Option<Value>,
    /// The purpose, as a sentence.
    pub doc: &'static str,
}

/// The leases that a participant may ask for.
const LEASES: RangeInclusive<Duration> = Duration::from_millis(100)..=LONGEST;
const LEASE: Option<Value> = Some(Value::Duration(Duration::from_secs(1)));
const QUEUES: RangeInclusive<i64> = 1..=65_536;
const QUEUE: Option<Value> = Some(Value::Int(256));
const QUEUE_DOC: &str = "The most MiB of received data that waits in each slot. A full topic drops its oldest samples; a full server refuses requests.";
/// DDS computes its ports from the number of the domain. Domain 233 would need ports above 65535.
const DOMAINS: RangeInclusive<i64> = 0..=232;

pub(crate) static DDS: [Key; 6] = [
    Key {
        name: "domain",
        kind: Kind::Int(DOMAINS),
        default: Some(Value::Int(0)),
        doc: "Participants discover each other only within one domain.",
    },
    Key {
        name: "interfaces",
        kind: Kind::Interfaces,
        default: None,
        doc: "The network interfaces to use; the default is the choice of Cyclone DDS.",
    },
    Key {
        name: "peers",
        kind: Kind::Peers,
        default: None,
        doc: "Machines that discovery contacts by address, for networks without multicast.",
    },
    Key {
        name: "multicast",
        kind: Kind::Bool,
        default: Some(Value::Bool(true)),
        doc: "Whether discovery uses multicast.",
    },
    Key {
        name: "lease",
        kind: Kind::Duration(LEASES),
        default: LEASE,
        doc: "The time of silence after which a participant counts as dead.",
    },
    Key {
        name: "queue_mib",
        kind: Kind::Int(QUEUES),
        default: QUEUE,
        doc: QUEUE_DOC,
    },
];

pub(crate) static ROS2: [Key; 10] = [
    Key {
        name: "domain",
        kind: Kind::Int(DOMAINS),
        default: None,
        doc: "Nodes discover each other only within one domain; the default is ROS_DOMAIN_ID, else 0.",
    },
    Key {
        name: "interfaces",
        kind: Kind::Interfaces,
        default: None,
        doc: "The network interfaces to use; the default is what the variables of ROS 2 say, else all.",
    },
    Key {
        name: "lease",
        kind: Kind::Duration(LEASES),
        default: LEASE,
        doc: "The time of silence after which another component counts as dead.",
    },
    Key {
        name: "queue_mib",
        kind: Kind::Int(QUEUES),
        default: QUEUE,
        doc: QUEUE_DOC,
    },
    Key {
        name: "namespace",
        kind: Kind::Namespace,
        default: None,
        doc: "The namespace of the node; the default is the name of the network.",
    },
    Key {
        name: "node",
        kind: Kind::Node,
        default: None,
        doc: "The name of the node; the default is the name of the component in its network.",
    },
    Key {
        name: "remap",
        kind: Kind::Remappings,
        default: None,
        doc: "Other names in ROS 2 for slots, their operations, topics and services; the first matching rule applies.",
    },
    Key {
        name: "qos",
        kind: Kind::Qos,
        default: None,
        doc: "Overrides the quality of service of the .cdsl for topics; a rule for an operation takes precedence over one for its slot.",
    },
    Key {
        name: "use_sim_time",
        kind: Kind::Bool,
        default: Some(Value::Bool(false)),
        doc: "Whether time comes from the topic /clock, as rosgraph_msgs/msg/Clock, instead of the system's clock.",
    },
    Key {
        name: "rosout",
        kind: Kind::Bool,
        default: Some(Value::Bool(true)),
        doc: "Whether the log is published on the topic /rosout, as rcl_interfaces/msg/Log.",
    },
];
