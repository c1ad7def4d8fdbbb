//! The relation between requests and replies of a service.
//!
//! The middlewares of ROS 2 differ in this, and do not serve each other. `rmw_fastrtps` puts the
//! identity of a request into the inline quality of service, outside the body: a request carries
//! the reader that waits for the reply, and the reply carries this reader and the number of the
//! request among the samples of its writer. `rmw_cyclonedds` puts a header before the body. A
//! component speaks with each peer as the middleware of that peer does; the vendor in the peer's
//! identity names it. A request of another vendor may also have a header, which begins with the
//! client's identity. Components use the way of Fast DDS among each other, with numbers of their
//! own.

use rc_ddsc::{BEFORE_BODY, Identity, Sample};
use rc_middleware::Writer;
use rc_middleware::rpc::{self, ENVELOPE};
use rc_network::{Guid, GuidPrefix, Peer, ReaderState, body, prefix};

/// Where a peer has the identity of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Mapping {
    /// Outside the body, as in `rmw_fastrtps`.
    Beside,
    /// Before the body, as in `rmw_cyclonedds`.
    Before,
}

/// The header before the body: half of the identity of the client, and the number of the request.
pub(crate) const HEADER: usize = 16;
/// The vendor of Cyclone DDS, with which the identities of its endpoints begin (RTPS 2.5, 9.3.1.5).
const CYCLONE: [u8; 2] = [0x01, 0x10];
/// The vendor of Fast DDS.
const FAST: [u8; 2] = [0x01, 0x0f];
/// Vendors by their identifiers, as the OMG lists them.
const VENDORS: [([u8; 2], &str); 8] = [
    ([0x01, 0x01], "RTI Connext"),
    ([0x01, 0x02], "OpenSplice"),
    ([0x01, 0x03], "OpenDDS"),
    (FAST, "Fast DDS"),
    (CYCLONE, "Cyclone DDS"),
    ([0x01, 0x11], "GurumDDS"),
    ([0x01, 0x12], "RustDDS"),
    ([0x01, 0x14], "Dust DDS"),
];
/// Bits of a number that a component gives a request: the higher ones name its client in the
/// component, these count the requests of that client.
const COUNTED: u32 = 40;

impl Mapping {
    /// The mapping that a peer expects.
    pub(crate) fn of(peer: &Peer) -> Self {
        if peer.is_external() && peer.guid.starts_with(&CYCLONE) {
            Self::Before
        } else {
            Self::Beside
        }
    }

    /// Number of bytes before the body of a request or reply.
    pub(crate) fn skipped(self) -> usize {
        match self {
            Self::Beside => 0,
            Self::Before => HEADER,
        }
    }
}

// An envelope fits exactly before the body of a sample.
const _: () = assert!(BEFORE_BODY == ENVELOPE);

/// The body of a sample without its first `skipped` bytes, after an envelope, which `envelope`
/// writes. It stays in place, unless another reader in this process has the sample, too: then
/// `buffer` gets a copy.
pub(crate) fn enveloped<'a>(
    sample: &'a mut Sample,
    skipped: usize,
    buffer: &'a mut Vec<u8>,
    envelope: impl FnOnce(&mut Writer<'_>),
) -> Result<&'a [u8], String> {
    let length = body(sample)?.len();
    let skipped = skipped.min(length);
    buffer.clear();
    let mut writer = Writer::over(std::mem::take(buffer));
    envelope(&mut writer);
    rpc::begin_body(&mut writer, rc_middleware::Profile::Bare);
    *buffer = writer.into_bytes();
    if sample.unique().is_none() {
        buffer.extend_from_slice(&body(sample)?[skipped..]);
        return Ok(buffer);
    }
    let memory = sample.unique().ok_or("a sample has another reader")?;
    let whole = &mut memory[skipped..BEFORE_BODY + length];
    whole[..BEFORE_BODY].copy_from_slice(buffer);
    Ok(whole)
}

/// The vendor of an endpoint, for people.
fn vendor(guid: &Guid) -> String {
    let known = VENDORS.iter().find(|(vendor, _)| guid.starts_with(vendor));
    match known {
        Some((_, name)) => (*name).to_owned(),
        None => format!("the vendor {:02x}.{:02x}", guid[0], guid[1]),
    }
}

/// Advice about a server that does not reply, if its vendor is neither that of Fast DDS nor
/// that of Cyclone DDS: its mapping is unknown.
pub(crate) fn advice_on_server(guid: &Guid) -> Option<String> {
    let is_known = [FAST, CYCLONE]
        .iter()
        .any(|vendor| guid.starts_with(vendor));
    (!is_known).then(|| {
        format!(
            "the server is on {}, and components call it as `rmw_fastrtps` does; if it never replies, let it use that service mapping (`ServiceMapping::Enhanced` in ros2-client)",
            vendor(guid)
        )
    })
}

/// The number of a component's request: `client` is the number of the client in its component,
/// `count` the number of the request there, from 1.
pub(crate) fn number(client: u32, count: u64) -> i64 {
    let client = i64::from(client & 0x3f_ffff) << COUNTED;
    client | (count & ((1 << COUNTED) - 1)) as i64
}

/// A request, as a server sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Request {
    /// Identifies it to its client.
    pub(crate) id: Identity,
    pub(crate) mapping: Mapping,
    /// The time stamp of its reply; 0 for now.
    pub(crate) reply_at: i64,
}

impl Request {
    /// Reads the identity of a request. It fails if the body is too short for a header, or the
    /// sender left before discovery found it.
    pub(crate) fn read(sample: &Sample, reader: &ReaderState) -> Result<Self, String> {
        let own = i64::try_from(sample.sequence()).unwrap_or(0);
        let beside = |guid, number: i64| Self {
            // Fast DDS leaves the number open.
            id: Identity {
                guid,
                number: if number > 0 { number } else { own },
            },
            mapping: Mapping::Beside,
            reply_at: 0,
        };
        if let Some(id) = sample.related().filter(|id| id.guid != [0; 16]) {
            // A stranger could have its reply pass for the reply to another client's request.
            return match reader.participant(sample.writer()) {
                Some(client) if client == prefix(&id.guid) => {
                    let before = Self::before(body(sample)?, &id.guid);
                    Ok(before.unwrap_or_else(|| beside(id.guid, id.number)))
                }
                Some(_) => Err("a request names another client than its sender".to_owned()),
                // The client has left, so the reply has no receiver.
                None => Ok(beside([0; 16], id.number)),
            };
        }
        let peer = reader.peer(sample.writer());
        let peer = peer.ok_or("the client of a request has gone")?;
        let body = body(sample)?;
        match Mapping::of(&peer) {
            Mapping::Beside => {
                let before = Self::before(body, &peer.guid);
                Ok(before.unwrap_or_else(|| beside(peer.guid, 0)))
            }
            Mapping::Before => Ok(Self {
                id: in_header(body, &peer.guid)?,
                mapping: Mapping::Before,
                reply_at: 0,
            }),
        }
    }

    /// The identity in the header of `rmw_cyclonedds`, if a body begins with half of the identity
    /// of its client, as this header does.
    fn before(body: &[u8], client: &Guid) -> Option<Self> {
        let id = in_header(body, client).ok()?;
        (id.guid == *client).then_some(Self {
            id,
            mapping: Mapping::Before,
            reply_at: 0,
        })
    }

    /// Why a request whose body is `body` cannot be served: it has the header of DDS-RPC's basic
    /// mapping, which begins with the identity of the client.
    pub(crate) fn unserved(self, body: &[u8]) -> Option<String> {
        let client = &self.id.guid;
        (self.mapping == Mapping::Beside && body.starts_with(client)).then(|| {
            format!(
                "a client on {} uses the basic service mapping of DDS-RPC, which no middleware of ROS 2 has; let it use that of `rmw_fastrtps` (`ServiceMapping::Enhanced` in ros2-client)",
                vendor(client)
            )
        })
    }

    /// Number of bytes before the body.
    pub(crate) fn skipped(self) -> usize {
        self.mapping.skipped()
    }
}

/// The client of a request, to which the server gives its turn, and the place of the request among
/// the requests of that client. Requests without a place are served as they come. `from`: the
/// participant that sent the request, as far as it is known; a client that it only claims to be
/// does not count.
pub(crate) fn turn(sample: &Sample, from: Option<GuidPrefix>) -> (u128, u64) {
    let related = sample.related();
    match related.filter(|id| from.is_none_or(|from| from == prefix(&id.guid))) {
        Some(Identity { guid, number }) if number > 0 => {
            let mut client = guid;
            client[12..].copy_from_slice(&((number >> COUNTED) as u32).to_be_bytes());
            let count = number as u64 & ((1 << COUNTED) - 1);
            (u128::from_be_bytes(client), count)
        }
        Some(Identity { guid, .. }) => (u128::from_be_bytes(guid), 0),
        None => (sample.writer().into(), 0),
    }
}

/// The number of the request that a reply belongs to, and how they relate. `None` if the reply is
/// for another client: `own` are the endpoints of this one, the reader of replies and the writer of
/// requests.
///
/// A negative number says that nothing was executed, and the body holds the reason; only components
/// send such replies, and only to components.
pub(crate) fn read_reply(
    sample: &Sample,
    own: &[Guid; 2],
) -> Result<Option<(i64, Mapping)>, String> {
    let (id, mapping) = match sample.related() {
        Some(id) => (id, Mapping::Beside),
        None => (in_header(body(sample)?, &own[1])?, Mapping::Before),
    };
    // This number has no counterpart of the other sign.
    if id.number == i64::MIN {
        return Err("a reply has a number that no request has".to_owned());
    }
    Ok(own.contains(&id.guid).then_some((id.number, mapping)))
}

/// The header for the identity of a request.
pub(crate) fn header(id: Identity) -> [u8; HEADER] {
    let mut header = [0; HEADER];
    header[..8].copy_from_slice(&id.guid[8..]);
    header[8..].copy_from_slice(&id.number.to_le_bytes());
    header
}

/// Reads the header before a body; `client` has the other half of the identity.
fn in_header(body: &[u8], client: &Guid) -> Result<Identity, String> {
    let Some((header, _)) = body.split_first_chunk::<HEADER>() else {
        return Err(format!(
            "a sample of a program on {} has no header of 16 bytes, as `rmw_cyclonedds` writes it",
            vendor(client)
        ));
    };
    let (mut guid, mut number) = (*client, [0; 8]);
    guid[8..].copy_from_slice(&header[..8]);
    number.copy_from_slice(&header[8..]);
    let number = i64::from_le_bytes(number);
    Ok(Identity { guid, number })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::TypeIdentity;
    use rc_network::{EndpointInfo, Presence, Role};

    #[test]
    fn the_vendor_of_a_peer_names_its_mapping() {
        let info = EndpointInfo {
            role: Role::Client,
            types: TypeIdentity {
                name: "Test::Types".to_owned(),
                hash: 7,
            },
            instance: "a".to_owned(),
            pid: 1,
            host: "here".to_owned(),
        };
        let mapping = |vendor: [u8; 2], info: Option<&EndpointInfo>| {
            let mut guid = [7; 16];
            guid[..2].copy_from_slice(&vendor);
            Mapping::of(&Peer {
                guid,
                info: info.cloned(),
                matches: true,
                presence: Presence::Present,
                lifespan: None,
            })
        };
        assert_eq!(mapping([1, 0x0f], None), Mapping::Beside, "Fast DDS");
        assert_eq!(mapping([1, 0x12], None), Mapping::Beside, "rustdds");
        assert_eq!(mapping(CYCLONE, None), Mapping::Before);
        assert_eq!(mapping(CYCLONE, Some(&info)), Mapping::Beside);
    }

    #[test]
    fn a_header_comes_back() {
        let id = Identity {
            guid: [7; 16],
            number: -3,
        };
        assert_eq!(in_header(&header(id), &[7; 16]), Ok(id));
        assert!(in_header(&[0; HEADER - 1], &[7; 16]).is_err());
    }

    #[test]
    fn a_number_names_its_client_and_counts() {
        assert_eq!(number(3, 9) >> COUNTED, 3);
        assert_eq!(number(3, 9) & 0xff, 9);
        assert!(number(u32::MAX, u64::MAX) > 0);
    }
}
