//! What a recording gets beside messages: channels and files.

use crate::schema::Schema;
use crate::writer::{ChannelId, Writer};
use std::collections::BTreeMap;

/// What a message takes in memory beside its bytes.
pub(crate) const OVERHEAD: usize = 64;

/// A channel.
#[derive(Clone, Debug)]
pub struct NewChannel {
    /// Its topic.
    pub topic: String,
    /// The encoding of its messages.
    pub encoding: &'static str,
    /// Its type.
    pub schema: Option<Schema>,
    /// What else is known of it.
    pub metadata: BTreeMap<String, String>,
}

impl NewChannel {
    pub(crate) fn add_to(&self, writer: &mut Writer) -> ChannelId {
        let (schema, metadata) = (self.schema.clone(), self.metadata.clone());
        writer.channel(&self.topic, self.encoding, schema, metadata)
    }
}

/// A file that belongs to a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttachedFile {
    /// Its name.
    pub name: String,
    /// What it is.
    pub media_type: &'static str,
    /// Its content.
    pub data: Vec<u8>,
}
