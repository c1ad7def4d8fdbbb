//! The content of messages of replicas.

use crate::streams::Sample;
use graph_merge::{Change, Vector};
use property_graph::Time;

/// A topic of the interfaces of worlds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// The steps of one change.
    Change,
    /// Values of streams.
    Samples,
    /// The state of a replica.
    Digest,
    /// The missing changes of a replica.
    Ask,
    /// A part of what another one lacks.
    Chunk,
}

/// The content of a message.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Content {
    Change {
        schema: u64,
        time: Time,
        change: Change,
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

/// The state of a replica.
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
