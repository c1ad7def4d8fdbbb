//! What components exchange besides their topics and services, on two hidden topics of ROS.
//!
//! ROS 2 does not transport type hashes, and its discovery notices a killed process only after most
//! of a minute. On `/_robocomp/ends` each component publishes its endpoints and the peers that they
//! have found, whenever that changes. On `/_robocomp/alive` it publishes a sign of life four times
//! a lease. Both are `std_msgs/msg/String`.

use crate::wire::Body;
use rc_middleware::{Cdr, Reader, Writer};
use rc_network::{EndpointInfo, Guid, hex};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::time::Duration;

/// The topics in DDS.
pub(crate) const ENDS: &str = "rt/_robocomp/ends";
pub(crate) const ALIVE: &str = "rt/_robocomp/alive";
/// The type of both.
pub(crate) const TYPE: &str = "std_msgs::msg::dds_::String_";

/// An endpoint, as its component describes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Told {
    pub(crate) info: EndpointInfo,
    /// The number of its connection in its component. All endpoints of one client have the same
    /// number.
    pub(crate) connection: u32,
    /// The topic of DDS.
    pub(crate) topic: String,
    /// The peers that it has found.
    pub(crate) found: BTreeSet<Guid>,
}

/// The beginning of the first line.
const LEASE: &str = "lease ";

/// The message of a component: its lease in milliseconds, and a line for each endpoint with its
/// identity, its connection, its topic, its info, `|` and the peers that it has found.
pub(crate) fn message<'a>(lease: Duration, ends: impl Iterator<Item = (&'a Guid, Told)>) -> Body {
    let mut text = format!("{LEASE}{}\n", lease.as_millis());
    for (guid, told) in ends {
        let Told {
            info,
            connection,
            topic,
            found,
        } = &told;
        // Writing to a string cannot fail.
        let _ = write!(text, "{} {connection} {topic} {info}|", hex(guid));
        for other in found {
            let _ = write!(text, " {}", hex(other));
        }
        text.push('\n');
    }
    string(&text)
}

/// A message of the type of both topics.
pub(crate) fn string(text: &str) -> Body {
    let mut writer = Writer::default();
    rc_middleware::cdr::text(text, &mut writer);
    Body::of(&[&writer.into_bytes()])
}

/// Reads the lease and the endpoints of a message. It skips lines that cannot be read.
pub(crate) fn read(body: &[u8]) -> (Duration, BTreeMap<Guid, Told>) {
    let Ok(text) = String::decode(&mut Reader::new(body)) else {
        return Default::default();
    };
    let lease = text.lines().find_map(|line| line.strip_prefix(LEASE));
    let lease = lease.and_then(|lease| lease.parse().ok());
    let ends = text.lines().filter_map(end).collect();
    (Duration::from_millis(lease.unwrap_or(0)), ends)
}

fn end(line: &str) -> Option<(Guid, Told)> {
    let (end, found) = line.split_once('|')?;
    let (id, end) = end.split_once(' ')?;
    let (connection, end) = end.split_once(' ')?;
    let (topic, info) = end.split_once(' ')?;
    let told = Told {
        connection: connection.parse().ok()?,
        info: EndpointInfo::parse(info.as_bytes())?,
        topic: topic.to_owned(),
        found: found.split_whitespace().filter_map(guid).collect(),
    };
    Some((guid(id)?, told))
}

fn guid(text: &str) -> Option<Guid> {
    let number = u128::from_str_radix(text, 16).ok()?;
    (text.len() == 32).then(|| number.to_be_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Copying, Passing};
    use rc_middleware::TypeIdentity;
    use rc_network::Role;
    use rustdds::RepresentationIdentifier;
    use rustdds::no_key::{Decode, SerializerAdapter};

    #[test]
    fn what_is_told_comes_back() {
        let told = Told {
            info: EndpointInfo {
                role: Role::Server,
                types: TypeIdentity {
                    name: "Test::Types".to_owned(),
                    hash: 7,
                },
                instance: "lidar".to_owned(),
                pid: 4711,
                host: "robot@1".to_owned(),
            },
            connection: 7,
            topic: "rq/default/LaserRequest".to_owned(),
            found: BTreeSet::from([[1; 16], [2; 16]]),
        };
        let both = [([3; 16], told.clone()), ([4; 16], told)];
        let lease = Duration::from_millis(2500);
        let message = message(lease, both.iter().map(|(guid, told)| (guid, told.clone())));
        let Ok(bytes) = Passing::to_bytes(&message);
        let Ok(taken) = Copying::default().decode_bytes(&bytes, RepresentationIdentifier::CDR_LE);
        let body = taken.body().expect("a body");
        assert_eq!(read(body), (lease, BTreeMap::from(both)));
        for wrong in [&[][..], &[9, 0, 0, 0], &body[..40]] {
            assert_eq!(read(wrong), (Duration::ZERO, BTreeMap::new()));
        }
        // A message without a valid lease.
        for other in ["", "lease \n", "lease -1\n", "lease 99999999999999999999\n"] {
            let Ok(bytes) = Passing::to_bytes(&string(other));
            assert_eq!(read(&bytes), (Duration::ZERO, BTreeMap::new()));
        }
    }
}
