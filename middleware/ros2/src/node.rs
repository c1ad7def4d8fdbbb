//! The node of a component: its session, its names, and its place in the graph.

use crate::config::{self, Config};
use crate::graph::Graph;
use crate::names::NodeName;
use crate::types::NodeTypes;
use rc_middleware::{Environment, OpenError};
use rc_network::Session;
use rc_vocabulary::ros::ResolvedRemapping;
use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;

/// A node, which its endpoints share.
pub(crate) struct Node {
    pub(crate) name: NodeName,
    /// Names that replace others (remapping).
    pub(crate) rules: Vec<ResolvedRemapping>,
    // The graph goes before the session.
    pub(crate) graph: Rc<Graph>,
    pub(crate) session: Rc<Session>,
    /// The types of its endpoints.
    pub(crate) types: Arc<NodeTypes>,
    clients: Cell<u32>,
}

impl Node {
    pub(crate) fn join(
        environment: &Environment,
        types: &'static [&'static str],
    ) -> Result<Self, OpenError> {
        let Config {
            joining,
            node,
            rules,
        } = config::of(environment)?;
        let session = Rc::new(Session::open(environment, &joining)?);
        Ok(Self {
            graph: Graph::join(&session, node.clone())?,
            name: node,
            rules,
            session,
            types: Arc::new(NodeTypes::new(types)),
            clients: Cell::new(0),
        })
    }

    /// A number for a client of this node, from 1.
    pub(crate) fn number_client(&self) -> u32 {
        self.clients.set(self.clients.get().wrapping_add(1));
        self.clients.get()
    }
}
