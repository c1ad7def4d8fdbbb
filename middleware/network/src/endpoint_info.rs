//! What an end of ours tells the others of itself: in its user data on the network, and on the notice board of its
//! network on this machine.

use crate::Guid;
use rc_middleware::{TypeIdentity, qos};
use std::fmt;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

/// What comes first, so that nobody else's user data is taken for ours.
const BEGIN: &str = "robocomp/1";

/// What an end is there for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Sends values.
    Publisher,
    /// Hears values.
    Subscriber,
    /// The end on which a client sends, and the one on which it hears its answers.
    Client,
    /// The end on which a server hears, and the one on which it answers.
    Server,
}

impl Role {
    const ALL: [(Self, &str); 4] = [
        (Self::Publisher, "publisher"),
        (Self::Subscriber, "subscriber"),
        (Self::Client, "client"),
        (Self::Server, "server"),
    ];

    /// What people call it.
    pub fn word(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(role, _)| *role == self)
            .map_or("", |(_, word)| word)
    }
}

/// Who an end is of, and what it says and hears.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EndpointInfo {
    /// What the end is there for.
    pub role: Role,
    /// The types of the connection.
    pub types: TypeIdentity,
    /// The component.
    pub instance: String,
    /// Its process.
    pub pid: u32,
    /// Where it is, see `host`.
    pub host: String,
}

impl EndpointInfo {
    /// Reads one; `None` for a stranger.
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(bytes).ok()?;
        let mut words = text.split(' ');
        if words.next()? != BEGIN {
            return None;
        }
        let role = words.next()?;
        let (role, _) = Role::ALL.iter().find(|(_, word)| *word == role)?;
        let hash = u64::from_str_radix(words.next()?, 16).ok()?;
        let name = words.next()?.to_owned();
        let pid = words.next()?.parse().ok()?;
        let instance = words.next()?.to_owned();
        let host = words.next()?.to_owned();
        Some(Self {
            role: *role,
            types: TypeIdentity { name, hash },
            instance,
            pid,
            host,
        })
    }

    /// Who it is, for people on `host`.
    pub fn who(&self, host: &str) -> String {
        let Self { pid, instance, .. } = self;
        if self.host == host {
            format!("pid {pid} ({instance})")
        } else {
            let name = self.host.split('@').next().unwrap_or_default();
            format!("pid {pid} ({instance}) on {name}")
        }
    }
}

impl fmt::Display for EndpointInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let TypeIdentity { name, hash } = &self.types;
        let (role, pid) = (self.role.word(), self.pid);
        let (instance, host) = (&self.instance, &self.host);
        write!(f, "{BEGIN} {role} {hash:x} {name} {pid} {instance} {host}")
    }
}

/// The name of this machine for people, `@`, and for comparisons a number that only those have who share the notice board
/// in `folder`: two robots can both be called `raspberrypi`, and each of two containers has a board.
pub fn host(folder: &Path) -> String {
    let name = rustix::system::uname();
    let name = name.nodename().to_string_lossy();
    // It becomes a word among others.
    let name = name.split_whitespace().collect::<Vec<_>>().join("-");
    let boot = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    let device = std::fs::metadata(folder).map_or(0, |metadata| metadata.dev());
    // By its path, for a folder that is removed and made again is the same board.
    let registry = format!("{}\n{device}\n{}", boot.trim(), folder.display());
    format!("{name}@{:016x}", fnv(&registry))
}

/// The hash FNV-1a.
pub fn fnv(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// A GUID as people write it.
pub fn hex(guid: &Guid) -> String {
    guid.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What a writer offers too little of for a reader, each with both values (DDS 1.4, 2.2.3: requested and offered).
pub fn differences(offered: &QosContract, requested: &QosContract) -> Vec<String> {
    let time = |time: Option<Duration>| time.map_or("none".to_owned(), |t| format!("{t:?}"));
    let word = |yes: bool, one: &str, other: &str| if yes { one } else { other }.to_owned();
    let mut found = Vec::new();
    let mut differ = |policy: &str, offered: String, requested: String| {
        found.push(format!(
            "{policy}: offered {offered}, requested {requested}"
        ));
    };
    if requested.reliable && !offered.reliable {
        let reliability = |yes| word(yes, "reliable", "best_effort");
        differ("reliability", reliability(false), reliability(true));
    }
    if requested.transient_local && !offered.transient_local {
        let durability = |yes| word(yes, "transient_local", "volatile");
        differ("durability", durability(false), durability(true));
    }
    let longer = |offered: Option<Duration>, requested: Option<Duration>| {
        requested.is_some_and(|r| offered.is_none_or(|o| o > r))
    };
    if longer(offered.deadline, requested.deadline) {
        differ("deadline", time(offered.deadline), time(requested.deadline));
    }
    if longer(offered.liveliness, requested.liveliness) {
        let times = (time(offered.liveliness), time(requested.liveliness));
        differ("liveliness", times.0, times.1);
    }
    found
}

/// What an end offers or asks for that has to fit the other end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QosContract {
    /// What was sent arrives.
    pub reliable: bool,
    /// Those who come late get what was sent before.
    pub transient_local: bool,
    /// The longest time between two values.
    pub deadline: Option<Duration>,
    /// After how long of silence a publisher counts as dead.
    pub liveliness: Option<Duration>,
}

impl From<&rc_middleware::Qos> for QosContract {
    fn from(qos: &rc_middleware::Qos) -> Self {
        Self {
            reliable: qos.reliability == qos::Reliability::Reliable,
            transient_local: qos.durability == qos::Durability::TransientLocal,
            deadline: qos.deadline,
            liveliness: qos.liveliness,
        }
    }
}

impl QosContract {
    /// Reads what `Display` writes.
    pub fn parse(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        let time = |word: &str| match word {
            "-" => Some(None),
            _ => Some(Some(Duration::from_nanos(word.parse().ok()?))),
        };
        Some(Self {
            reliable: words.next()? == "true",
            transient_local: words.next()? == "true",
            deadline: time(words.next()?)?,
            liveliness: time(words.next()?)?,
        })
    }
}

impl fmt::Display for QosContract {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time =
            |time: Option<Duration>| time.map_or("-".to_owned(), |t| t.as_nanos().to_string());
        let (deadline, liveliness) = (time(self.deadline), time(self.liveliness));
        let (reliable, kept) = (self.reliable, self.transient_local);
        write!(f, "{reliable} {kept} {deadline} {liveliness}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hello_comes_back_and_a_stranger_is_none() {
        let info = EndpointInfo {
            role: Role::Server,
            types: TypeIdentity {
                name: "Test::Types".to_owned(),
                hash: 7,
            },
            instance: "lidar".to_owned(),
            pid: 4711,
            host: "robot".to_owned(),
        };
        assert_eq!(
            EndpointInfo::parse(info.to_string().as_bytes()),
            Some(info.clone())
        );
        assert_eq!(info.who("robot"), "pid 4711 (lidar)");
        assert_eq!(info.who("desk"), "pid 4711 (lidar) on robot");
        let other = EndpointInfo {
            host: "robot@1".to_owned(),
            ..info.clone()
        };
        assert_eq!(other.who("robot@1"), "pid 4711 (lidar)");
        assert_eq!(other.who("robot@2"), "pid 4711 (lidar) on robot");
        for stranger in [&b""[..], b"typehash=RIHS01", b"robocomp/1 server", &[255]] {
            assert_eq!(EndpointInfo::parse(stranger), None);
        }
    }

    #[test]
    fn what_is_offered_has_to_be_enough() {
        let offered = QosContract {
            liveliness: Some(Duration::from_secs(2)),
            ..QosContract::default()
        };
        let requested = QosContract {
            reliable: true,
            deadline: Some(Duration::from_millis(100)),
            liveliness: Some(Duration::from_secs(1)),
            ..QosContract::default()
        };
        assert_eq!(
            differences(&offered, &requested),
            [
                "reliability: offered best_effort, requested reliable",
                "deadline: offered none, requested 100ms",
                "liveliness: offered 2s, requested 1s",
            ]
        );
        assert!(differences(&requested, &offered).is_empty());
    }
}
