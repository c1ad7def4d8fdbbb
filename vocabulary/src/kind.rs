//! Values that a key takes, and their parsing from a scalar or a text.

use crate::duration;
use crate::qos;
use crate::ros::{self, Remapping};
use crate::scalar::Scalar;
use crate::value::Value;
use std::ops::RangeInclusive;
use std::time::Duration;

/// The values that a key takes.
#[derive(Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number within limits.
    Int(RangeInclusive<i64>),
    /// `true` or `false`.
    Bool,
    /// A duration within limits.
    Duration(RangeInclusive<Duration>),
    /// A list of network interfaces, by name or address.
    Interfaces,
    /// A list of machines, by name or address, each with an optional port.
    Peers,
    /// The namespace of a node of ROS 2.
    Namespace,
    /// The name of a node of ROS 2, without its namespace.
    Node,
    /// A list of rules `FROM:=TO`, see [`Remapping`].
    Remappings,
    /// A list of rules `SLOT.POLICY:=VALUE`, see [`qos::Rule`].
    Qos,
}

/// Why a scalar is not a value of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueError {
    /// It has another type.
    Type,
    /// It is outside the limits.
    Range,
    /// It is a text in another format.
    Format,
}

impl Kind {
    /// Whether a key takes any number of elements.
    pub fn is_list(&self) -> bool {
        self.empty_list().is_some()
    }

    /// The allowed values, or elements of a list, for messages.
    pub fn allowed(&self) -> String {
        match self {
            Self::Int(range) => {
                format!("an integer from {} to {}", range.start(), range.end())
            }
            Self::Bool => "true or false".to_owned(),
            Self::Duration(range) => format!(
                "a duration of at least {}, at most a day",
                duration::text_of(*range.start())
            ),
            Self::Interfaces => {
                "the name or the address of a network interface, such as \"eth0\" or \"10.0.0.2\""
                    .to_owned()
            }
            Self::Peers => {
                "the name or the address of a machine, such as \"robot.local\" or \"10.0.0.2:7410\""
                    .to_owned()
            }
            Self::Namespace => {
                "a namespace of ROS 2, such as \"/robot\": each `/` is followed by letters, digits and single `_`, no digit first"
                    .to_owned()
            }
            Self::Node => {
                "the name of a node, such as \"lidar_front\": letters, digits and `_`, no digit first"
                    .to_owned()
            }
            Self::Qos => format!(
                "a rule SLOT.POLICY:=VALUE or SLOT/operation.POLICY:=VALUE, such as \"LaserPub/newScan.depth:=1\", of {}",
                qos::all_allowed()
            ),
            Self::Remappings => {
                "a rule FROM:=TO, such as \"LaserPub/newScan:=/scan\": FROM is a slot, SLOT/operation or a name of ROS 2, TO is the new name"
                    .to_owned()
            }
        }
    }

    /// Converts one scalar. For a list, the value has one element; [`Kind::join`] joins them.
    pub fn convert(&self, scalar: Scalar<'_>) -> Result<Value, ValueError> {
        use Scalar::{Bool, Duration as Nanoseconds, Int, Text};
        match (self, scalar) {
            (Self::Int(range), Int(number)) => {
                let fits = range.contains(&number);
                fits.then_some(Value::Int(number)).ok_or(ValueError::Range)
            }
            (Self::Bool, Bool(choice)) => Ok(Value::Bool(choice)),
            (Self::Duration(range), Nanoseconds(nanoseconds)) => {
                let duration = Duration::from_nanos(nanoseconds);
                let fits = range.contains(&duration);
                fits.then_some(Value::Duration(duration))
                    .ok_or(ValueError::Range)
            }
            (Self::Duration(_), Int(milliseconds)) => {
                let nanoseconds = duration::from_milliseconds(milliseconds);
                self.convert(Nanoseconds(nanoseconds.ok_or(ValueError::Range)?))
            }
            (Self::Duration(_), Text(text)) => {
                let nanoseconds = duration::parse(text).ok_or(ValueError::Type)?;
                self.convert(Nanoseconds(nanoseconds))
            }
            (Self::Remappings, Text(text)) => {
                let rule = Remapping::parse(text).ok_or(ValueError::Format)?;
                Ok(Value::Remappings(vec![rule]))
            }
            (Self::Qos, Text(text)) => {
                let rule = qos::Rule::parse(text).map_err(|_| ValueError::Format)?;
                Ok(Value::Qos(vec![rule]))
            }
            (_, Text(text)) => {
                let fits = match self {
                    Self::Interfaces => is_host(text),
                    Self::Peers => is_peer(text),
                    Self::Namespace => ros::is_namespace(text),
                    Self::Node => ros::is_node(text),
                    Self::Int(_)
                    | Self::Bool
                    | Self::Duration(_)
                    | Self::Remappings
                    | Self::Qos => return Err(ValueError::Type),
                };
                let text = text.to_owned();
                let value = if self.is_list() {
                    Value::Texts(vec![text])
                } else {
                    Value::Text(text)
                };
                fits.then_some(value).ok_or(ValueError::Format)
            }
            _ => Err(ValueError::Type),
        }
    }

    /// The value of a list without elements; of any other kind, `None`.
    pub fn empty_list(&self) -> Option<Value> {
        match self {
            Self::Interfaces | Self::Peers => Some(Value::Texts(Vec::new())),
            Self::Remappings => Some(Value::Remappings(Vec::new())),
            Self::Qos => Some(Value::Qos(Vec::new())),
            Self::Int(_) | Self::Bool | Self::Duration(_) | Self::Namespace | Self::Node => None,
        }
    }

    /// Joins the elements of a list. A key that is not a list has one element.
    pub fn join(&self, elements: impl IntoIterator<Item = Value>) -> Option<Value> {
        let mut elements = elements.into_iter();
        let Some(mut list) = self.empty_list() else {
            return elements.next();
        };
        elements.for_each(|element| list.append(element));
        Some(list)
    }

    /// Parses the text of a command line. The elements of a list have commas between them; a
    /// number without a unit counts milliseconds where a duration is expected.
    pub fn parse(&self, text: &str) -> Result<Value, ValueError> {
        let Some(mut list) = self.empty_list() else {
            return self.convert(self.scalar(text));
        };
        for element in text.split(',').filter(|_| !text.is_empty()) {
            list.append(self.convert(Scalar::Text(element.trim()))?);
        }
        Ok(list)
    }

    fn scalar<'t>(&self, text: &'t str) -> Scalar<'t> {
        match self {
            Self::Int(_) | Self::Duration(_) => {
                text.parse().map_or(Scalar::Text(text), Scalar::Int)
            }
            Self::Bool => text.parse().map_or(Scalar::Text(text), Scalar::Bool),
            Self::Interfaces
            | Self::Peers
            | Self::Namespace
            | Self::Node
            | Self::Remappings
            | Self::Qos => Scalar::Text(text),
        }
    }
}

/// Whether `text` may be a name, or an IPv4 or IPv6 address.
fn is_host(text: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | ':' | '%');
    !text.is_empty() && !text.starts_with('-') && text.chars().all(allowed)
}

/// Whether `text` may be a machine with an optional port. An IPv6 address with a port needs
/// brackets.
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
    use crate::key;

    /// The printed value for a text on the command line.
    fn parsed(middleware: &str, name: &str, text: &str) -> Result<String, ValueError> {
        let key = key(middleware, name).expect("a key");
        let value = key.kind.parse(text)?;
        assert_eq!(key.kind.parse(&value.to_string()), Ok(value.clone()));
        Ok(value.to_string())
    }

    #[test]
    fn ros_settings_are_checked() {
        let parsed = |name: &str, text: &str| parsed("ros2", name, text);
        let ok = |text: &str| Ok(text.to_owned());
        assert_eq!(parsed("namespace", "/"), ok("/"));
        assert_eq!(parsed("namespace", "robot"), Err(ValueError::Format));
        assert_eq!(parsed("node", "7"), Err(ValueError::Format));
        assert_eq!(
            parsed("remap", "LaserPub:=/front, /tf:=tf"),
            ok("LaserPub:=/front,/tf:=tf")
        );
        assert_eq!(parsed("remap", "LaserPub=/front"), Err(ValueError::Format));
        assert_eq!(
            parsed("qos", "LaserPub.deadline:=0.5s"),
            ok("LaserPub.deadline:=500ms")
        );
        assert_eq!(parsed("qos", "LaserPub.depth:=0"), Err(ValueError::Format));
    }

    #[test]
    fn texts_convert_to_values() {
        let parsed = |name: &str, text: &str| parsed("dds", name, text);
        let ok = |text: &str| Ok(text.to_owned());
        assert_eq!(parsed("domain", "7"), ok("7"));
        assert_eq!(parsed("domain", "233"), Err(ValueError::Range));
        assert_eq!(parsed("domain", "seven"), Err(ValueError::Type));
        assert_eq!(parsed("lease", "0.5s"), ok("500ms"));
        assert_eq!(parsed("lease", "500"), ok("500ms"));
        assert_eq!(parsed("lease", "100000.001us"), ok("100000.001us"));
        assert_eq!(parsed("lease", "99ms"), Err(ValueError::Range));
        assert_eq!(parsed("lease", "99999min"), Err(ValueError::Range));
        assert_eq!(parsed("multicast", "false"), ok("false"));
        assert_eq!(parsed("multicast", "no"), Err(ValueError::Type));
    }

    #[test]
    fn peers_are_names_and_addresses() {
        let parsed = |name: &str, text: &str| parsed("dds", name, text);
        let peers = parsed(
            "peers",
            "10.0.0.2, robot.local:7410,fe80::1%eth0,[fe80::1]:7410",
        );
        let peers = peers.expect("peers");
        assert_eq!(
            peers,
            "10.0.0.2,robot.local:7410,fe80::1%eth0,[fe80::1]:7410"
        );
        assert_eq!(parsed("peers", ""), Ok(String::new()));
        for wrong in ["a b", "a:0", "a:70000", "[fe80::1", "-x", "a,,b", "<x/>"] {
            assert_eq!(parsed("peers", wrong), Err(ValueError::Format), "{wrong}");
        }
        assert_eq!(parsed("interfaces", "<eth0>"), Err(ValueError::Format));
        assert_eq!(parsed("interfaces", "eth0").as_deref(), Ok("eth0"));
    }
}
