//! Channels and files of a recording.

use crate::qos;
use crate::schema::Schema;
use std::collections::BTreeMap;

/// Memory of a message in addition to its bytes.
pub(crate) const OVERHEAD: usize = 64;

/// A channel.
#[derive(Clone, Debug)]
pub struct NewChannel {
    /// Topic of the messages.
    pub topic: String,
    /// The encoding of its messages.
    pub encoding: &'static str,
    /// Type of the messages.
    pub schema: Option<Schema>,
    /// Further facts, by key (metadata of MCAP).
    pub metadata: BTreeMap<String, String>,
}

impl NewChannel {
    /// Whether its last message holds until the next one.
    pub(crate) fn is_latched(&self) -> bool {
        qos::is_latched(&self.metadata)
    }
}

/// A file that belongs to a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttachedFile {
    /// File name.
    pub name: String,
    /// Media type, such as `text/plain`.
    pub media_type: &'static str,
    /// Bytes of the file.
    pub data: Vec<u8>,
}
