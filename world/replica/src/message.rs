//! The messages of replicas.

use crate::content::{Content, Topic};
use crate::wire;
use rc_middleware::{DecodeError, Reader, Writer};

/// How many bytes of an answer one chunk has at most.
pub const MOST_CHUNK: usize = 60 * 1024;

/// The topics of the interface `World`, in the order of `World.idsl`: losses are repaired.
pub const STATE: [Topic; 4] = [Topic::Change, Topic::Digest, Topic::Ask, Topic::Chunk];

/// The topic of the interface `WorldStream`: the newest value counts.
pub const STREAM: [Topic; 1] = [Topic::Samples];

/// A message of a replica to the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Message(pub(crate) Content);

impl Message {
    /// The topic on which it is published.
    pub fn topic(&self) -> Topic {
        match self.0 {
            Content::Change { .. } => Topic::Change,
            Content::Samples { .. } => Topic::Samples,
            Content::Digest(_) => Topic::Digest,
            Content::Ask { .. } => Topic::Ask,
            Content::Chunk { .. } => Topic::Chunk,
        }
    }

    /// Writes the one parameter of its topic.
    pub fn encode(&self, writer: &mut Writer<'_>) {
        wire::encode(&self.0, writer);
    }

    /// Reads the one parameter of a topic.
    ///
    /// # Errors
    /// The bytes are no such message.
    pub fn decode(topic: Topic, reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        wire::decode(topic, reader).map(Self)
    }

    /// About how many bytes it has.
    pub(crate) fn size(&self) -> usize {
        match &self.0 {
            Content::Change { change, .. } => wire::size(&change.records),
            Content::Samples { samples, .. } => samples
                .iter()
                .map(|s| 64 + s.name.len() + s.value.size())
                .sum(),
            Content::Digest(digest) => 128 + digest.seen.len() * 16 + digest.ranges.len() * 8,
            Content::Ask { since, chunks, .. } => 64 + since.len() * 16 + chunks.len() * 4,
            Content::Chunk { bytes, .. } => 64 + bytes.len(),
        }
    }
}
