//! Removes edges that are never shown again: one replica made such an edge while another one removed an end of it.

use crate::core::Core;
use crate::protocol::between;
use graph_merge::Reason;
use property_graph::{Graph, Id, Time};
use std::collections::BTreeSet;

/// How many edges it removes at once: a message holds them.
const MOST: usize = 256;

impl Core {
    /// Removes those of its own, and if it is its turn those of writers that have ended.
    pub(crate) fn tidy(&mut self, graph: &Graph, time: Time) {
        if !self.tidies || !self.has_joined() || self.conflicts.is_empty() {
            return;
        }
        let own = self.replica.writer();
        let others: BTreeSet<u64> = self
            .protocol
            .peers
            .live()
            .map(|(writer, _)| writer)
            .collect();
        let is_its_turn = self.is_its_turn();
        let dangling = self.conflicts.iter().filter(|conflict| {
            let writer = conflict.id.writer();
            conflict.reason == Reason::EndRemoved
                && (writer == own || is_its_turn && !others.contains(&writer))
        });
        let gone: BTreeSet<Id> = dangling.map(|conflict| conflict.id).take(MOST).collect();
        if gone.is_empty() {
            return;
        }
        let time = between(time, graph.snapshot().time(), time);
        let delta = self.replica.recorded(|replica| {
            for id in &gone {
                replica.remove(*id)?;
            }
            Ok::<_, graph_merge::Error>(())
        });
        self.protocol.digests.clear();
        self.show(graph, time, &gone);
        match delta {
            Ok(delta) if delta.records.is_empty() => {}
            Ok(delta) => self.protocol.send_change(time, delta),
            // The next digest tells of those before the error.
            Err(error) => self.protocol.refuse(&error.to_string()),
        }
    }
}
