//! Names of networks and addresses in iceoryx2.

use rc_middleware::{Address, RunDirectory};
use std::fmt::Write as _;
use std::os::unix::ffi::OsStrExt;
use std::path::PathBuf;

/// Longest root path: a listener's socket is `ROOT/PREFIX<id>.event`, and the path of a socket has
/// at most 107 bytes. The prefix has 20 bytes, the id at most 36.
const LONGEST_ROOT: usize = 107 - 20 - 36 - 7;

/// Prefix of the names of all shared memory of the network: `rc_<16 hex digits>_`, with the FNV-1a
/// hash of the path of its run directory.
pub fn prefix(directory: &RunDirectory) -> String {
    format!(
        "rc_{:016x}_",
        fnv1a(directory.path().as_os_str().as_bytes())
    )
}

/// The root folder of the network: `iceoryx2` in the run directory, or `/dev/shm/PREFIXroot` if
/// that path is too long for the sockets in it.
pub(crate) fn root(directory: &RunDirectory) -> PathBuf {
    let inside = directory.middleware(crate::NAME);
    if inside.as_os_str().len() <= LONGEST_ROOT {
        inside
    } else {
        PathBuf::from(format!("/dev/shm/{}root", prefix(directory)))
    }
}

/// The publish/subscribe service of volatile publishers, and the event service of the topic.
pub(crate) fn topic(address: &Address) -> String {
    address.to_string()
}

/// The publish/subscribe service of transient-local publishers.
pub(crate) fn transient_local(address: &Address) -> String {
    format!("{address}:kept")
}

/// The event service by which late joiners request history.
pub(crate) fn late_joiners(address: &Address) -> String {
    format!("{address}:late")
}

/// The request/response service.
pub(crate) fn calls(address: &Address) -> String {
    address.to_string()
}

/// The event service that notifies the server.
pub(crate) fn server(address: &Address) -> String {
    format!("{address}:server")
}

/// The event service that notifies one client.
pub(crate) fn client(address: &Address, guid: [u8; 16]) -> String {
    let mut name = format!("{address}:client:");
    for byte in guid {
        // Writing to a String cannot fail.
        let _ = write!(name, "{byte:02x}");
    }
    name
}

/// FNV-1a, 64 bits. Source: draft-eastlake-fnv.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv1a() {
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn a_long_network_gets_a_short_root() {
        let directory = RunDirectory::of(&"n".repeat(60));
        assert!(root(&directory).as_os_str().len() <= LONGEST_ROOT);
    }
}
