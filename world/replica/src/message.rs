//! The messages of replicas.

use crate::streams::Sample;
use crate::wire;
use graph_merge::{Delta, Vector};
use property_graph::Time;
use rc_middleware::{DecodeError, Reader, Writer};

/// How many bytes of an answer one chunk has at most.
pub const MOST_CHUNK: usize = 60 * 1024;

/// The topics of the interface `World`, in the order of `World.idsl`: losses are repaired.
pub const STATE: [Topic; 4] = [Topic::Change, Topic::Digest, Topic::Ask, Topic::Chunk];

/// The topic of the interface `WorldStream`: the newest value counts.
pub const STREAM: [Topic; 1] = [Topic::Samples];

/// A topic of the interfaces of worlds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// What one change has done.
    Change,
    /// Values of streams.
    Samples,
    /// What a replica has.
    Digest,
    /// What a replica lacks.
    Ask,
    /// A part of what another one lacks.
    Chunk,
}

/// A message of a replica to the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Message(pub(crate) Content);

/// What a message says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Content {
    Change {
        schema: u64,
        time: Time,
        /// Of the sender alone.
        delta: Delta,
    },
    Samples {
        schema: u64,
        sender: u64,
        time: Time,
        samples: Vec<Sample>,
    },
    Digest(DigestOf),
    Ask {
        sender: u64,
        to: u64,
        number: u64,
        since: Vector,
        ranges: Vec<u32>,
        /// The chunks that the sender lacks; empty at first.
        chunks: Vec<u32>,
    },
    Chunk {
        sender: u64,
        to: u64,
        number: u64,
        at: u32,
        count: u32,
        bytes: Vec<u8>,
    },
}

/// What a replica has.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DigestOf {
    pub(crate) schema: u64,
    pub(crate) sender: u64,
    pub(crate) name: String,
    pub(crate) seen: Vector,
    pub(crate) ranges: Vec<u64>,
    pub(crate) streams: u64,
    pub(crate) elements: u64,
    pub(crate) conflicts: u32,
    pub(crate) is_leaving: bool,
}

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
            Content::Change { delta, .. } => wire::size(&delta.records),
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
