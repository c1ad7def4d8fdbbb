//! What can be set of a middleware: one table for configurations, `.ddsl` files and command lines.

pub mod qos;
pub mod ros;

use rc_diagnostics::{duration_nanoseconds, duration_text, nearest};
use std::ops::RangeInclusive;

/// Something of a middleware that can be set.
#[derive(Debug, PartialEq, Eq)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// What it takes.
    pub kind: Kind,
    /// What holds where nobody sets it; none where that is nothing, or what the middleware finds.
    pub default: Option<&'static str>,
    /// What it is for, as a sentence.
    pub doc: &'static str,
}

/// What a key takes.
#[derive(Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number.
    Int(RangeInclusive<i64>),
    /// Yes or no.
    Bool,
    /// A time, with its limits in nanoseconds.
    Time(RangeInclusive<u64>),
    /// Names of network interfaces, or their addresses.
    Interfaces,
    /// Names or addresses of machines, each with a port where the usual one is not meant.
    Peers,
    /// One of these words.
    Word(&'static [&'static str]),
    /// The namespace of a node of ROS 2.
    Namespace,
    /// The name of a node of ROS 2, without its namespace.
    Node,
    /// Rules `FROM:=TO`, see [`ros::remapping`].
    Remappings,
    /// Rules `SLOT.POLICY:=VALUE`, see [`qos::Rule`].
    Qos,
}

/// The longest time that can be set; what is longer is a slip of the pen.
const DAY: u64 = 24 * 60 * 60 * 1_000_000_000;

/// DDS counts its ports from the domain's number; with 233 there are none left.
const DDS: [Key; 5] = [
    Key {
        name: "domain",
        kind: Kind::Int(0..=232),
        default: Some("0"),
        doc: "Only who is in the same domain is seen.",
    },
    Key {
        name: "interfaces",
        kind: Kind::Interfaces,
        default: None,
        doc: "The network interfaces that are used.",
    },
    Key {
        name: "peers",
        kind: Kind::Peers,
        default: None,
        doc: "Machines that are looked for by their addresses, where multicast does not find them.",
    },
    Key {
        name: "multicast",
        kind: Kind::Bool,
        default: Some("true"),
        doc: "Whether others are looked for by multicast.",
    },
    Key {
        name: "lease",
        kind: Kind::Time(100_000_000..=DAY),
        default: Some("1s"),
        doc: "After how long of silence another process counts as dead.",
    },
];

/// ROS 2 counts its ports as DDS does.
const ROS2: [Key; 8] = [
    Key {
        name: "domain",
        kind: Kind::Int(0..=232),
        default: None,
        doc: "Only who is in the same domain is seen; where it is not set, ROS_DOMAIN_ID says it, else it is 0.",
    },
    Key {
        name: "interfaces",
        kind: Kind::Interfaces,
        default: None,
        doc: "The network interfaces that are used; where none is set, the variables of ROS 2 say it, else all are.",
    },
    Key {
        name: "lease",
        kind: Kind::Time(100_000_000..=DAY),
        default: Some("1s"),
        doc: "After how long of silence another component counts as dead.",
    },
    Key {
        name: "service_mapping",
        kind: Kind::Word(&["enhanced", "cyclone"]),
        default: Some("enhanced"),
        doc: "How requests and replies are told apart, the same on both sides: enhanced as Fast DDS does, or cyclone as Cyclone DDS does.",
    },
    Key {
        name: "namespace",
        kind: Kind::Namespace,
        default: None,
        doc: "The namespace of the node; where it is not set, the network's name.",
    },
    Key {
        name: "node",
        kind: Kind::Node,
        default: None,
        doc: "The name of the node; where it is not set, that of the component in its network.",
    },
    Key {
        name: "remap",
        kind: Kind::Remappings,
        default: None,
        doc: "What slots, their operations, topics and services are called in ROS instead; the first rule that fits counts.",
    },
    Key {
        name: "qos",
        kind: Kind::Qos,
        default: None,
        doc: "What holds for topics in the place of the quality of service in the .cdsl; a rule for an operation counts before one for its slot.",
    },
];

/// Every middleware, with its keys.
pub const MIDDLEWARES: [(&str, &[Key]); 4] = [
    ("iceoryx2", &[]),
    ("dds", &DDS),
    ("ros2", &ROS2),
    ("local", &[]),
];

/// The keys of a middleware; none where there is no such middleware.
pub fn keys(middleware: &str) -> Option<&'static [Key]> {
    let mut all = MIDDLEWARES.iter();
    all.find(|(name, _)| *name == middleware)
        .map(|(_, keys)| *keys)
}

/// A key of a middleware.
pub fn key(middleware: &str, name: &str) -> Option<&'static Key> {
    keys(middleware)?.iter().find(|key| key.name == name)
}

/// What to say to somebody who has named a key that `middleware` does not have.
pub fn instead(middleware: &str, name: &str) -> String {
    let names = keys(middleware).unwrap_or_default().iter().map(|k| k.name);
    if let Some(near) = nearest(name, names.clone()) {
        return format!("did you mean `{near}`?");
    }
    let names: Vec<&str> = names.collect();
    if names.is_empty() {
        format!("there is nothing yet that can be set of {middleware}")
    } else {
        format!("there are {}", names.join(", "))
    }
}

/// A single value, as it is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// A whole number; where a time is wanted, of milliseconds.
    Int(i64),
    /// A choice.
    Bool(bool),
    /// A time in nanoseconds.
    Time(u64),
    /// A text.
    Text(&'a str),
    /// Something else.
    Other,
}

/// Why something is no value of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misfit {
    /// It is of another kind.
    Type,
    /// It is beyond the limits.
    Range,
    /// It is a text that is none of those that are wanted.
    Form,
}

impl Kind {
    /// Whether a key takes any number of values.
    pub fn is_list(&self) -> bool {
        matches!(
            self,
            Self::Interfaces | Self::Peers | Self::Remappings | Self::Qos
        )
    }

    /// What one value may be, for messages.
    pub fn allowed(&self) -> String {
        match self {
            Self::Int(range) => {
                format!("a whole number from {} to {}", range.start(), range.end())
            }
            Self::Bool => "a choice, true or false".to_owned(),
            Self::Time(range) => format!(
                "a time of at least {}, at most a day",
                duration_text(*range.start())
            ),
            Self::Interfaces => {
                "the name or the address of a network interface, such as \"eth0\" or \"10.0.0.2\""
                    .to_owned()
            }
            Self::Peers => {
                "the name or the address of a machine, such as \"robot.local\" or \"10.0.0.2:7410\""
                    .to_owned()
            }
            Self::Word(words) => format!("one of {}", words.join(", ")),
            Self::Namespace => {
                "a namespace of ROS 2, such as \"/robot\": letters, digits and single `_`, no digit first, behind each `/`"
                    .to_owned()
            }
            Self::Node => {
                "the name of a node, such as \"lidar_front\": letters, digits and `_`, no digit first"
                    .to_owned()
            }
            Self::Qos => format!(
                "a rule SLOT.POLICY:=VALUE or SLOT/operation.POLICY:=VALUE, such as \"LaserPub/newScan.depth:=1\", of reliability (reliable, best_effort), durability (volatile, transient_local), depth ({} to {}), deadline, lifespan and liveliness (a time, or none)",
                qos::DEPTH.start(),
                qos::DEPTH.end()
            ),
            Self::Remappings => {
                "a rule FROM:=TO, such as \"LaserPub/newScan:=/scan\": a slot, SLOT/operation or a name of ROS 2, and the name in its place"
                    .to_owned()
            }
        }
    }

    /// One value in its usual form: numbers are decimal, times have a unit.
    pub fn accept(&self, value: Value<'_>) -> Result<String, Misfit> {
        match (self, value) {
            (Self::Int(range), Value::Int(number)) => {
                let fits = range.contains(&number);
                fits.then(|| number.to_string()).ok_or(Misfit::Range)
            }
            (Self::Bool, Value::Bool(choice)) => Ok(choice.to_string()),
            (Self::Time(range), Value::Time(time)) => {
                let fits = range.contains(&time);
                fits.then(|| duration_text(time)).ok_or(Misfit::Range)
            }
            (Self::Time(_), Value::Int(milliseconds)) => {
                let time = u64::try_from(milliseconds).ok();
                let time = time.and_then(|ms| ms.checked_mul(1_000_000));
                self.accept(Value::Time(time.ok_or(Misfit::Range)?))
            }
            (Self::Time(_), Value::Text(text)) => {
                let time = duration_nanoseconds(text).ok_or(Misfit::Type)?;
                self.accept(Value::Time(time))
            }
            (Self::Interfaces, Value::Text(text)) => {
                is_host(text).then(|| text.to_owned()).ok_or(Misfit::Form)
            }
            (Self::Peers, Value::Text(text)) => {
                is_peer(text).then(|| text.to_owned()).ok_or(Misfit::Form)
            }
            (Self::Word(words), Value::Text(text)) => {
                let known = words.contains(&text);
                known.then(|| text.to_owned()).ok_or(Misfit::Form)
            }
            (Self::Namespace, Value::Text(text)) => {
                let fits = ros::is_namespace(text);
                fits.then(|| text.to_owned()).ok_or(Misfit::Form)
            }
            (Self::Node, Value::Text(text)) => {
                let fits = ros::is_node(text);
                fits.then(|| text.to_owned()).ok_or(Misfit::Form)
            }
            (Self::Remappings, Value::Text(text)) => {
                let rule = ros::remapping(text);
                rule.map(|_| text.to_owned()).ok_or(Misfit::Form)
            }
            (Self::Qos, Value::Text(text)) => {
                let rule = qos::Rule::parse(text);
                rule.map(|rule| rule.text()).map_err(|_| Misfit::Form)
            }
            _ => Err(Misfit::Type),
        }
    }

    /// The values that a command line gives as one text; a list is parted by commas.
    pub fn accept_text(&self, text: &str) -> Result<Vec<String>, Misfit> {
        let values: Vec<&str> = match self {
            _ if !self.is_list() => vec![text],
            _ if text.is_empty() => Vec::new(),
            _ => text.split(',').map(str::trim).collect(),
        };
        let value = |text| match self {
            Self::Int(_) => str::parse(text).map_or(Value::Text(text), Value::Int),
            Self::Time(_) => match str::parse(text) {
                Ok(milliseconds) => Value::Int(milliseconds),
                Err(_) => Value::Text(text),
            },
            Self::Bool => match text {
                "true" => Value::Bool(true),
                "false" => Value::Bool(false),
                _ => Value::Text(text),
            },
            Self::Interfaces
            | Self::Peers
            | Self::Word(_)
            | Self::Namespace
            | Self::Node
            | Self::Remappings
            | Self::Qos => Value::Text(text),
        };
        values
            .into_iter()
            .map(|text| self.accept(value(text)))
            .collect()
    }
}

/// What to say where `name` is neither one of `slots` nor `SLOT/operation` of what they have: the nearest one, else what `may`
/// stand there.
fn misses(name: &str, slots: &[(&str, Vec<&str>)], may: &str) -> Option<String> {
    let operations = slots
        .iter()
        .flat_map(|(slot, operations)| operations.iter().map(move |o| format!("{slot}/{o}")));
    let own = slots.iter().map(|(slot, _)| (*slot).to_owned());
    let names: Vec<String> = own.chain(operations).collect();
    if names.iter().any(|known| known == name) {
        return None;
    }
    let near = nearest(name, names.iter().map(String::as_str));
    Some(near.map_or(may.to_owned(), |near| format!("did you mean `{near}`?")))
}

/// A name, or an IP address of either kind.
fn is_host(text: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | ':' | '%');
    !text.is_empty() && !text.starts_with('-') && text.chars().all(allowed)
}

/// A machine, with a port or without; an IPv6 address before a port stands in brackets.
fn is_peer(text: &str) -> bool {
    let is_port = |port: &str| port.parse().is_ok_and(|port: u16| port != 0);
    if let Some(rest) = text.strip_prefix('[') {
        return rest.split_once(']').is_some_and(|(host, rest)| {
            is_host(host) && (rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port))
        });
    }
    match text.split_once(':') {
        Some((host, port)) if !port.contains(':') => is_host(host) && is_port(port),
        _ => is_host(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(name: &str, text: &str) -> Result<Vec<String>, Misfit> {
        let key = key("dds", name).expect("a key");
        key.kind.accept_text(text)
    }

    #[test]
    fn ros_has_names_and_words() {
        let texts = |name: &str, text: &str| {
            let key = key("ros2", name).expect("a key");
            key.kind.accept_text(text)
        };
        let one = |text: &str| Ok(vec![text.to_owned()]);
        assert_eq!(texts("service_mapping", "cyclone"), one("cyclone"));
        assert_eq!(texts("service_mapping", "basic"), Err(Misfit::Form));
        assert_eq!(texts("namespace", "/"), one("/"));
        assert_eq!(texts("namespace", "robot"), Err(Misfit::Form));
        assert_eq!(texts("node", "7"), Err(Misfit::Form));
        let rules = texts("remap", "LaserPub:=/front, /tf:=tf");
        assert_eq!(rules.map(|rules| rules.len()), Ok(2));
        assert_eq!(texts("remap", "LaserPub=/front"), Err(Misfit::Form));
        assert_eq!(
            texts("qos", "LaserPub.deadline:=0.5s"),
            one("LaserPub.deadline:=500ms")
        );
        assert_eq!(texts("qos", "LaserPub.depth:=0"), Err(Misfit::Form));
    }

    #[test]
    fn values_have_one_form() {
        let one = |text: &str| Ok(vec![text.to_owned()]);
        assert_eq!(texts("domain", "7"), one("7"));
        assert_eq!(texts("domain", "233"), Err(Misfit::Range));
        assert_eq!(texts("domain", "seven"), Err(Misfit::Type));
        assert_eq!(texts("lease", "0.5s"), one("500ms"));
        assert_eq!(texts("lease", "500"), one("500ms"));
        assert_eq!(texts("lease", "99ms"), Err(Misfit::Range));
        assert_eq!(texts("lease", "99999min"), Err(Misfit::Range));
        assert_eq!(texts("multicast", "false"), one("false"));
        assert_eq!(texts("multicast", "no"), Err(Misfit::Type));
    }

    #[test]
    fn machines_are_names_and_addresses() {
        let peers = "10.0.0.2, robot.local:7410,fe80::1%eth0,[fe80::1]:7410";
        let peers = texts("peers", peers).expect("peers");
        assert_eq!((peers.len(), peers[0].as_str()), (4, "10.0.0.2"));
        assert_eq!(texts("peers", ""), Ok(Vec::new()));
        for wrong in ["a b", "a:0", "a:70000", "[fe80::1", "-x", "a,,b", "<x/>"] {
            assert_eq!(texts("peers", wrong), Err(Misfit::Form), "{wrong}");
        }
        assert_eq!(texts("interfaces", "<eth0>"), Err(Misfit::Form));
        assert_eq!(texts("interfaces", "eth0").map(|texts| texts.len()), Ok(1));
    }

    #[test]
    fn defaults_are_values_themselves() {
        for key in MIDDLEWARES.iter().flat_map(|(_, keys)| *keys) {
            let Some(default) = key.default else { continue };
            let again = key.kind.accept_text(default);
            assert_eq!(again, Ok(vec![default.to_owned()]), "{}", key.name);
        }
        assert_eq!(instead("dds", "domian"), "did you mean `domain`?");
        assert!(instead("iceoryx2", "domain").contains("nothing yet"));
    }
}
