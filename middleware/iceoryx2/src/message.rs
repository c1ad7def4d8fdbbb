//! The user headers of messages. iceoryx2 compares them by name, size and alignment.
//!
//! The body follows its header directly. The memory image of a plain type needs an alignment of 16
//! bytes, so headers are aligned to 16 and their sizes are multiples of it. (iceoryx2 0.10.0
//! applies a payload alignment to each byte of a `[u8]` and reserves 16 times the memory.)

use iceoryx2::prelude::ZeroCopySend;
use rc_middleware::{Encoding, Header};

/// Version of these headers.
const VERSION: u16 = 1;
/// Body encoding: CDR, XCDR1, little endian (for a call, after its envelope).
const CDR: u16 = 1;
/// Body encoding: the memory image of a plain type (for a reply, after its envelope).
const IMAGE: u16 = 2;
/// Flag of a request: the client awaits no reply.
const ONE_WAY: u32 = 1;

/// Header of samples and replies, 32 bytes.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("RcHeader1")]
#[repr(C)]
#[repr(align(16))]
pub(crate) struct MessageHeader {
    version: u16,
    encoding: u16,
    flags: u32,
    type_hash: u64,
    sequence: u64,
    sent: u64,
}

/// Header of requests, 48 bytes.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("RcRequestHeader1")]
#[repr(C)]
#[repr(align(16))]
pub(crate) struct RequestHeader {
    message: MessageHeader,
    client: [u8; 16],
}

impl MessageHeader {
    pub(crate) fn new(header: Header) -> Self {
        Self {
            version: VERSION,
            encoding: match header.encoding {
                Encoding::Cdr => CDR,
                Encoding::Image => IMAGE,
            },
            flags: 0,
            type_hash: header.type_hash,
            sequence: header.sequence,
            sent: header.sent,
        }
    }

    /// The header as the middleware layer knows it, or why it cannot be read.
    pub(crate) fn read(&self, sender: u128) -> Result<Header, String> {
        let encoding = match (self.version, self.encoding) {
            (VERSION, CDR) => Encoding::Cdr,
            // A memory image is accepted only with a type hash, which the receiver compares.
            (VERSION, IMAGE) if self.type_hash != 0 => Encoding::Image,
            (version, encoding) => {
                return Err(format!(
                    "received a message of version {version} and encoding {encoding}, this side knows version {VERSION}, \
                     encoding {CDR} and, with a type hash, {IMAGE}; rebuild both sides with the same framework"
                ));
            }
        };
        Ok(Header {
            type_hash: self.type_hash,
            sequence: self.sequence,
            sent: self.sent,
            encoding,
            sender,
        })
    }
}

impl RequestHeader {
    pub(crate) fn new(header: Header, client: [u8; 16], one_way: bool) -> Self {
        let mut message = MessageHeader::new(header);
        if one_way {
            message.flags = ONE_WAY;
        }
        Self { message, client }
    }

    pub(crate) fn read(&self, sender: u128) -> Result<Header, String> {
        self.message.read(sender)
    }

    /// GUID of the client whose event service to notify; all zero for none.
    pub(crate) fn client(&self) -> [u8; 16] {
        self.client
    }

    pub(crate) fn is_one_way(&self) -> bool {
        self.message.flags & ONE_WAY != 0
    }
}
