//! Replicas of a property graph, which converge whatever the network loses, repeats or reorders.
//!
//! A [`Replica`] is changed without asking anybody, and gives others [`Delta`]s. Each attribute is
//! a register whose latest [`Stamp`] wins. An element is removed by a tombstone, which is forgotten
//! when all known replicas have seen it; a replica that lacks it nevertheless gets the whole graph.
//! [`Replica::view`] repairs what two replicas did against each other, in the same way everywhere:
//! what loses is listed as a conflict, and stays. A running graph takes a view over by
//! [`property_graph::Graph::adopt`].

mod bounds;
mod digest;
mod error;
mod hash;
mod hidden;
mod limits;
mod record;
mod replica;
mod sound;
mod view;

pub use error::Error;
pub use hidden::Hidden;
pub use limits::MOST_ELEMENTS;
pub use record::{Delta, Record, Stamp, Vector};
pub use replica::{MOST_TOMBSTONES, Replica, unique_writer};
pub use sound::{allows, has_attribute, missing};
pub use view::{Conflict, Reason, Shown, View};
