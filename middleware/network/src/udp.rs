//! The UDP ports of a domain, which another program may occupy.

use rustix::net::{AddressFamily, SocketType, bind, socket, sockopt};
use std::net::{Ipv4Addr, SocketAddrV4};
use std::ops::Range;

/// Domains with ports from 32,768 to 60,999 (RTPS 2.5, 9.6.2.3), which Linux assigns to any
/// program.
const SHARED: Range<u32> = 102..215;
/// The first port of domain 0, the number of ports of a domain, and those that all participants
/// share: the multicast ports of discovery and of data.
const BASE: u32 = 7400;
const EACH: u32 = 250;
const COMMON: Range<u32> = 0..2;

/// The remedy for a domain that cannot be joined.
pub(crate) fn advice(domain: u32) -> String {
    let first = BASE + EACH * domain;
    let mut common = COMMON.filter_map(|offset| u16::try_from(first + offset).ok());
    if let Some(port) = common.find(|port| is_taken(*port)) {
        return format!(
            "another program has UDP port {port}, which is one of domain {domain}: `ss -ulpn sport = :{port}` says which; end it, or take another `domain`"
        );
    }
    let look = "the log says why; look at `interfaces` and `peers`, and at CYCLONEDDS_URI";
    if !SHARED.contains(&domain) {
        return look.to_owned();
    }
    format!(
        "{look}. The ports of domain {domain} are among those that the system gives to anybody; those of domains up to {} are not",
        SHARED.start - 1
    )
}

/// Whether a program occupies this port alone: participants of a domain share it.
fn is_taken(port: u16) -> bool {
    let Ok(socket) = socket(AddressFamily::INET, SocketType::DGRAM, None) else {
        return false;
    };
    let shared = sockopt::set_socket_reuseaddr(&socket, true);
    let address = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port);
    let bound = shared.and_then(|()| bind(&socket, &address));
    bound == Err(rustix::io::Errno::ADDRINUSE)
}
