//! The nodes of a network. Each process has one or more.

use crate::ports::{Node, Service};
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::node::{NodeState, NodeView as _};
use iceoryx2::prelude::{CallbackProgression, Config};

/// A node of a dead process.
pub(crate) type Dead = iceoryx2::node::DeadNodeView<Service>;

/// Whether any node of the network is alive in another process.
pub(crate) fn any_alive_elsewhere(config: &Config) -> bool {
    let own = std::process::id();
    let mut found = false;
    list(config, |node| {
        if let NodeState::Alive(node) = node {
            let process = node.id().pid::<Service>();
            found = process.is_err() || process.is_ok_and(|pid| pid.value().cast_unsigned() != own);
        }
        !found
    });
    found
}

/// The nodes of dead processes.
pub(crate) fn dead(config: &Config) -> Vec<Dead> {
    let mut found = Vec::new();
    list(config, |node| {
        if let NodeState::Dead(node) = node {
            found.push(node);
        }
        true
    });
    found
}

/// Whether the node does not exist or its process is dead.
pub(crate) fn is_dead(config: &Config, node: UniqueNodeId) -> bool {
    matches!(
        Node::state_of(config, node),
        Ok(None | Some(NodeState::Dead(_)))
    )
}

/// A number that is smaller for an older node: the time in its id, seconds and nanoseconds.
pub(crate) fn age(node: UniqueNodeId) -> (u32, u32) {
    // `UniqueSystemId`: seconds, nanoseconds, process and counter, 32 bits each.
    let id = node.value();
    (id as u32, (id >> 32) as u32)
}

/// Calls `each` for every node until it returns false.
fn list(config: &Config, mut each: impl FnMut(NodeState<Service>) -> bool) {
    // iceoryx2 ends the list early at an entry that it cannot read; the entries before it are
    // valid.
    let _ = Node::list(config, |node| {
        if each(node) {
            CallbackProgression::Continue
        } else {
            CallbackProgression::Stop
        }
    });
}
