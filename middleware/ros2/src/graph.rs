//! The graph of ROS: each participant announces on `ros_discovery_info` its nodes and their
//! endpoints.

use crate::names::NodeName;
use rc_middleware::{Cdr, Durability, OpenError, Qos, Writer};
use rc_network::{Guid, Session, stamp};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::Duration;

/// The topic of all participants; it is not below `rt`.
const TOPIC: &str = "ros_discovery_info";
/// `rmw_dds_common/msg/ParticipantEntitiesInfo`
const TYPE: &str = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
/// How long a node that ends waits until others have received its announcement.
const GOODBYE: Duration = Duration::from_millis(100);

/// The node of a component in the graph.
pub(crate) struct Graph {
    node: NodeName,
    participant: Guid,
    writer: rc_ddsc::Writer,
    sent: Cell<u64>,
    ends: RefCell<Ends>,
    // The participant goes after the writer.
    _session: Rc<Session>,
}

/// The endpoints of the node.
#[derive(Default)]
struct Ends {
    readers: Vec<Guid>,
    writers: Vec<Guid>,
}

/// Endpoints in the graph, until it is dropped.
pub(crate) struct Listed {
    graph: Rc<Graph>,
    ends: Vec<Guid>,
}

impl Graph {
    pub(crate) fn join(session: &Rc<Session>, node: NodeName) -> Result<Rc<Self>, OpenError> {
        let qos = Qos {
            durability: Durability::TransientLocal,
            depth: 1,
            ..Qos::PUBLISHER
        };
        let graph = Self {
            node,
            participant: session.guid(),
            writer: session.writer((TOPIC, TYPE), &qos)?,
            sent: Cell::new(0),
            ends: RefCell::default(),
            _session: Rc::clone(session),
        };
        graph.tell(true);
        Ok(Rc::new(graph))
    }

    /// Adds endpoints to the node.
    pub(crate) fn list(self: &Rc<Self>, readers: &[Guid], writers: &[Guid]) -> Listed {
        let mut ends = self.ends.borrow_mut();
        ends.readers.extend(readers);
        ends.writers.extend(writers);
        drop(ends);
        self.tell(true);
        Listed {
            graph: Rc::clone(self),
            ends: [readers, writers].concat(),
        }
    }

    /// Announces the present node, or that it leaves.
    fn tell(&self, is_there: bool) {
        self.sent.set(self.sent.get() + 1);
        let mut writer = Writer::default();
        writer.put(&self.participant);
        writer.length(usize::from(is_there));
        if is_there {
            let ends = self.ends.borrow();
            writer.put(&self.node.namespace);
            writer.put(&self.node.name);
            for guids in [&ends.readers, &ends.writers] {
                writer.length(guids.len());
                guids.iter().for_each(|guid| guid.encode(&mut writer));
            }
        }
        let told = self
            .writer
            .write(self.sent.get(), stamp(0), &writer.into_bytes());
        if let Err(error) = told {
            let node = self.node.full();
            tracing::warn!("ROS 2 does not learn of the endpoints of `{node}`: {error}");
        }
    }
}

impl Drop for Graph {
    fn drop(&mut self) {
        self.tell(false);
        // A peer that does not confirm in time learns it when the participant leaves.
        let _ = self.writer.wait_for_acks(GOODBYE);
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        let mut ends = self.graph.ends.borrow_mut();
        ends.readers.retain(|guid| !self.ends.contains(guid));
        ends.writers.retain(|guid| !self.ends.contains(guid));
        drop(ends);
        self.graph.tell(true);
    }
}
