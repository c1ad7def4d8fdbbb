//! Problems of a replica, in words for people.

use crate::core::Core;
use crate::peers::missing;
use graph_merge::{Conflict, Reason};
use property_graph::{Id, NodeRef, Snapshot};
use rc_diagnostics::foreign::clean_to;
use std::collections::BTreeSet;

/// How many conflicts are listed.
const MOST_TOLD: usize = 8;
/// How many characters of a name are listed.
const MOST_NAME: usize = 64;

/// The problems of a replica. Reading them takes no time in proportion to the world.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// How many changes it has not seen, of those that another replica has.
    pub behind: u64,
    /// How many elements are not shown.
    pub conflicts: usize,
    /// The first of them, each with the element that hides it.
    pub first_conflicts: Vec<String>,
    /// Why the newest changes are not shown.
    pub fault: Option<String>,
    /// How many messages were refused.
    pub refused: u64,
    /// Why the last one was.
    pub last_refusal: String,
    /// Names of the replicas that take part.
    pub live: BTreeSet<String>,
    /// Names of replicas that have said goodbye.
    pub left: BTreeSet<String>,
}

impl Health {
    pub(crate) fn of(core: &Core, now: &Snapshot) -> Self {
        let peers = &core.protocol.peers;
        let behind = peers
            .live()
            .map(|(_, peer)| missing(&peer.seen, core.replica.seen()));
        let left = peers.all.values().filter(|peer| peer.is_leaving);
        let told = core.conflicts.iter().take(MOST_TOLD);
        Self {
            behind: behind.max().unwrap_or_default(),
            conflicts: core.conflicts.len(),
            first_conflicts: told.map(|conflict| core.words_of(conflict, now)).collect(),
            fault: core.fault.clone(),
            refused: core.protocol.counts.refused,
            last_refusal: core.protocol.counts.last_refusal.clone(),
            live: peers.live().map(|(_, peer)| peer.name.clone()).collect(),
            left: left.map(|peer| peer.name.clone()).collect(),
        }
    }
}

impl Core {
    /// A conflict in words: the hidden element, and the one that hides it.
    pub(crate) fn words_of(&self, conflict: &Conflict, now: &Snapshot) -> String {
        let Some(loser) = self.replica.element(&self.schema, conflict.id) else {
            return "an element that was removed".to_owned();
        };
        let kind = clean_to(loser.kind, MOST_NAME);
        let what = match loser.ends {
            Some((from, to)) => format!("{kind} from {} to {}", self.name(from), self.name(to)),
            None => format!("{kind} {}", self.name(conflict.id)),
        };
        let child = loser.ends.and_then(|(_, to)| now.find_node(to));
        let child = child.and_then(|child| now.node(child).ok());
        let mut winners = child
            .into_iter()
            .flat_map(|child: NodeRef<'_>| child.in_edges());
        let winner = winners.find(|edge| edge.type_name() == loser.kind);
        let parent = winner.and_then(|edge| now.node(edge.from()).ok());
        let against = match conflict.reason {
            Reason::SecondParent => match parent {
                Some(parent) => format!("the later one is from {}", self.name(parent.id())),
                None => "the child has a parent by a later one".to_owned(),
            },
            Reason::Key => "an older node has the same key".to_owned(),
            Reason::Cycle => "with later ones, it would close a circle".to_owned(),
            Reason::Cardinality => {
                "its node has as many later ones as the schema allows".to_owned()
            }
            Reason::EndRemoved => "one of its ends was removed meanwhile".to_owned(),
            Reason::Schema => "the schema does not allow it".to_owned(),
        };
        format!("{what}: {against}")
    }

    /// The name of a node, or its kind.
    fn name(&self, id: Id) -> String {
        match self.replica.element(&self.schema, id) {
            Some(shown) => {
                let name = shown.get("name");
                match name.and_then(property_graph::Value::as_str) {
                    Some(name) => format!("`{}`", clean_to(name, MOST_NAME)),
                    None => format!("a {}", clean_to(shown.kind, MOST_NAME)),
                }
            }
            None => "what was removed".to_owned(),
        }
    }
}
