//! The user headers, which travel beside every body. iceoryx2 compares them by name, size and alignment.
//!
//! The body comes right behind its header; so that it is aligned to 16 bytes, as the memory image of a plain type
//! wants it, the headers are aligned to 16 and their sizes are multiples of it. (The alignment of the payload, which
//! could be set too, counts for each single byte of a `[u8]` in iceoryx2 0.10.0: 16 times the memory is reserved.)

use iceoryx2::prelude::ZeroCopySend;
use rc_middleware::{Encoding, Header};

/// The version of these headers.
const VERSION: u16 = 1;
/// The encoding of a body: CDR in the version XCDR1, little endian (in its envelope, for a call).
const CDR: u16 = 1;
/// The encoding of a body: the memory image of a plain type (behind its envelope, for an answer).
const IMAGE: u16 = 2;
/// Flag of a request: no answer is waited for.
const ONE_WAY: u32 = 1;

/// Beside each value of a topic and each answer: 32 bytes.
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

/// Beside each request: 48 bytes.
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

    /// The header of a message from `sender` in our terms, or why it is not understood.
    pub(crate) fn read(&self, sender: u128) -> Result<Header, String> {
        let encoding = match (self.version, self.encoding) {
            (VERSION, CDR) => Encoding::Cdr,
            // What is in memory is believed only of an end that says that its types are the same.
            (VERSION, IMAGE) if self.type_hash != 0 => Encoding::Image,
            (version, encoding) => {
                return Err(format!(
                    "a message of version {version} and encoding {encoding} came, this side knows version {VERSION}, \
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

    /// Whose event service waits for the answer; all zero where none does.
    pub(crate) fn client(&self) -> [u8; 16] {
        self.client
    }

    pub(crate) fn is_one_way(&self) -> bool {
        self.message.flags & ONE_WAY != 0
    }
}
