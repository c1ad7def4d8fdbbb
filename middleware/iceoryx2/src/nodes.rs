//! The nodes of a network: each of its processes has one or more.

use crate::service::{Node, Service};
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::node::NodeState;
use iceoryx2::prelude::{CallbackProgression, Config};

/// A node whose process is dead.
pub(crate) type Dead = iceoryx2::node::DeadNodeView<Service>;

/// Whether a node of the network is alive.
pub(crate) fn any_alive(config: &Config) -> bool {
    let mut found = false;
    list(config, |node| {
        found = matches!(node, NodeState::Alive(_));
        !found
    });
    found
}

/// The nodes of the network whose processes are dead.
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

/// Whether a node is gone, or its process is dead.
pub(crate) fn is_dead(config: &Config, node: UniqueNodeId) -> bool {
    matches!(
        Node::state_of(config, node),
        Ok(None | Some(NodeState::Dead(_)))
    )
}

/// Lists the nodes for as long as `each` wants more.
fn list(config: &Config, mut each: impl FnMut(NodeState<Service>) -> bool) {
    // A list that breaks off, at something that cannot be read, is as good as it can be.
    let _ = Node::list(config, |node| {
        if each(node) {
            CallbackProgression::Continue
        } else {
            CallbackProgression::Stop
        }
    });
}
