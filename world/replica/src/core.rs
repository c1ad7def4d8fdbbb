//! The state of a replica, behind the lock of its world.

use crate::overruled::Overruled;
use crate::protocol::Protocol;
use crate::rights::Rights;
use crate::streams::Streams;
use crate::token::Token;
use crate::world::Setup;
use graph_merge::{Conflict, Hidden, Replica};
use graph_schema::Schema;
use std::collections::VecDeque;
use std::sync::Arc;

/// How many elements a world has at most.
pub(crate) const MOST_ELEMENTS: usize = 1 << 20;

/// The state of a replica.
pub(crate) struct Core {
    pub(crate) replica: Replica,
    pub(crate) schema: Arc<Schema>,
    pub(crate) rights: Rights,
    pub(crate) streams: Streams,
    /// Whether the graph shows every element that the replica has: then a change can be shown
    /// without looking at the others.
    pub(crate) is_whole: bool,
    /// Whether the whole replica is to be shown at the next turn.
    pub(crate) is_stale: bool,
    /// The hidden elements, and the effect of a change on them.
    pub(crate) hidden: Hidden,
    pub(crate) conflicts: Vec<Conflict>,
    pub(crate) fault: Option<String>,
    /// Values that lost against those of this replica, until the component takes them.
    pub(crate) overruled: VecDeque<Overruled>,
    pub(crate) protocol: Protocol,
    /// Whether it removes edges of which an end was removed.
    pub(crate) tidies: bool,
}

impl Core {
    pub(crate) fn new(setup: Setup) -> Self {
        Self {
            replica: Replica::new(setup.writer, []),
            protocol: Protocol::new(setup.writer, setup.name, &setup.schema, setup.most_answer),
            schema: setup.schema,
            rights: setup.rights,
            tidies: setup.tidies,
            streams: Streams::default(),
            is_whole: true,
            is_stale: false,
            hidden: Hidden::default(),
            conflicts: Vec::new(),
            fault: None,
            overruled: VecDeque::new(),
        }
    }

    /// How many changes of a writer are known.
    pub(crate) fn seen(&self, writer: u64) -> u64 {
        self.replica
            .seen()
            .get(&writer)
            .copied()
            .unwrap_or_default()
    }

    pub(crate) fn has(&self, token: Token) -> bool {
        !self.is_stale && self.seen(token.writer) >= token.sequence
    }
}
