//! Announcement of an endpoint: in its user data on the network, and in its
//! registration on this machine.

use crate::Guid;
use rc_diagnostics::foreign::{clean, clean_to};
use rc_middleware::TypeIdentity;
use std::fmt;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// The first word, which distinguishes it from the user data of other programs.
const BEGIN: &str = "robocomp/1";
/// The key of the text among other labels. ROS 2 allows letters and digits in a key.
const LABEL: &str = "endpoint=";

/// How many characters of a type's name are kept.
const LONGEST_TYPE: usize = 1024;

/// The purpose of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Sends samples of a topic.
    Publisher,
    /// Receives samples of a topic.
    Subscriber,
    /// Sends requests, or receives replies.
    Client,
    /// Receives requests, or sends replies.
    Server,
    /// Receives or sends samples for a tool. Components do not count it as a peer.
    Observer,
}

impl Role {
    const ALL: [(Self, &str); 5] = [
        (Self::Publisher, "publisher"),
        (Self::Subscriber, "subscriber"),
        (Self::Client, "client"),
        (Self::Server, "server"),
        (Self::Observer, "observer"),
    ];

    /// Name in messages.
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(role, _)| *role == self)
            .map_or("", |(_, word)| word)
    }
}

/// The owner and the types of an endpoint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EndpointInfo {
    /// Role of the endpoint in its component.
    pub role: Role,
    /// The types of the connection.
    pub types: TypeIdentity,
    /// The name of its component.
    pub instance: String,
    /// The process of the component.
    pub pid: u32,
    /// The machine of the process, see [`host`].
    pub host: String,
}

impl EndpointInfo {
    /// The user data of an endpoint. Where a middleware has labels of its own there
    /// (`KEY=VALUE;`), the text that `Display` writes is one more of them.
    pub fn user_data(&self, labels: &str) -> String {
        match labels {
            "" => self.to_string(),
            labels => format!("{labels}{LABEL}{self};"),
        }
    }

    /// Reads the text in the user data of an endpoint; `None` for those of other programs.
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(bytes).ok()?;
        let mut parts = text.split(';');
        parts.find_map(|part| Self::read(part.strip_prefix(LABEL).unwrap_or(part)))
    }

    /// Reads the text that `Display` writes.
    fn read(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        if words.next()? != BEGIN {
            return None;
        }
        let role = words.next()?;
        let (role, _) = Role::ALL.iter().find(|(_, word)| *word == role)?;
        let hash = u64::from_str_radix(words.next()?, 16).ok()?;
        let name = clean_to(words.next()?, LONGEST_TYPE);
        let pid = words.next()?.parse().ok()?;
        let instance = clean(words.next()?);
        let host = clean(words.next()?);
        Some(Self {
            role: *role,
            types: TypeIdentity { name, hash },
            instance,
            pid,
            host,
        })
    }

    /// Names its process and its component in messages that are read on `host`.
    pub fn describe(&self, host: &str) -> String {
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
        let (role, pid) = (self.role.name(), self.pid);
        let (instance, host) = (&self.instance, &self.host);
        write!(f, "{BEGIN} {role} {hash:x} {name} {pid} {instance} {host}")
    }
}

/// Whether two endpoints have the same types, as far as they announce them: hash 0 represents types
/// that no component generated.
pub fn types_match(ours: &TypeIdentity, theirs: &TypeIdentity) -> bool {
    // A name longer than the limit arrived cut.
    let is_same = || clean_to(&ours.name, LONGEST_TYPE) == clean_to(&theirs.name, LONGEST_TYPE);
    ours.hash == 0 || theirs.hash == 0 || (ours.hash == theirs.hash && is_same())
}

/// Identifies this machine: its name for people, `@`, and a number that all processes with the
/// registry in `folder` share. Two robots can both be called `raspberrypi`, and each of two
/// containers has its own registry.
pub fn host(folder: &Path) -> String {
    let name = rustix::system::uname();
    let name = name.nodename().to_string_lossy();
    // A blank would end the word in the text of an endpoint.
    let name = name.replace(';', "-");
    let name = name.split_whitespace().collect::<Vec<_>>().join("-");
    let boot = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    // The folder may be created later; it will be on the device of the folder that it is in.
    let mut existing = folder.ancestors().map(std::fs::metadata);
    let device = existing.find_map(Result::ok).map_or(0, |found| found.dev());
    // The number depends on the path, so that it stays the same for a folder that is removed and
    // made again.
    let registry = format!("{}\n{device}\n{}", boot.trim(), folder.display());
    format!("{name}@{:016x}", fnv(&registry))
}

/// The hash FNV-1a.
pub fn fnv(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// A GUID in hexadecimal digits.
pub fn hex(guid: &Guid) -> String {
    guid.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_registry_that_does_not_exist_yet_has_the_number_that_it_will_have() {
        let folder = std::env::temp_dir().join(format!("rc-host-{}", std::process::id()));
        let registry = folder.join("network/dds");
        let before = host(&registry);
        std::fs::create_dir_all(&registry).expect("a folder");
        let after = host(&registry);
        std::fs::remove_dir_all(&folder).expect("it is ours");
        assert_eq!(before, after);
    }

    #[test]
    fn an_endpoint_info_is_read_back_and_other_user_data_is_not() {
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
        let labelled = info.user_data("typehash=RIHS01_0;");
        assert_eq!(labelled, format!("typehash=RIHS01_0;endpoint={info};"));
        assert_eq!(EndpointInfo::parse(labelled.as_bytes()), Some(info.clone()));
        assert_eq!(info.describe("robot"), "pid 4711 (lidar)");
        assert_eq!(info.describe("desk"), "pid 4711 (lidar) on robot");
        let other = EndpointInfo {
            host: "robot@1".to_owned(),
            ..info.clone()
        };
        assert_eq!(other.describe("robot@1"), "pid 4711 (lidar)");
        assert_eq!(other.describe("robot@2"), "pid 4711 (lidar) on robot");
        let hostile = EndpointInfo {
            types: TypeIdentity {
                name: "A\u{1b}[2J".to_owned(),
                hash: 7,
            },
            instance: format!("lidar\nerror:\tforged{}", "x".repeat(10_000)),
            host: "robot\u{202e}".to_owned(),
            ..info.clone()
        };
        let read = EndpointInfo::parse(hostile.to_string().as_bytes()).expect("an endpoint");
        assert_eq!(read.types.name, "A\\u{1b}[2J");
        assert_eq!(read.host, "robot\\u{202e}");
        assert!(read.instance.starts_with("lidar\\nerror:\tforgedxxx"));
        assert_eq!(read.instance.chars().count(), 257);
        assert!(types_match(&hostile.types, &read.types));
        for other in [&b""[..], b"typehash=RIHS01", b"robocomp/1 server", &[255]] {
            assert_eq!(EndpointInfo::parse(other), None);
        }
    }
}
