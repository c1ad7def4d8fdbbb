//! Replicas of a property graph, which converge whatever the network loses, repeats or reorders.
//!
//! A [`Replica`] is changed independently of others, and exchanges [`Delta`]s with them. Each
//! attribute is a register whose latest [`Stamp`] wins. An element is removed by a tombstone, which
//! is dropped when all known replicas have seen it; a replica that lacks it nevertheless gets the
//! whole graph. [`Replica::view`] resolves contradictory changes of two replicas in the same way
//! everywhere: losers are kept and listed as conflicts. A running graph takes over a view by
//! [`property_graph::Graph::adopt`].
//!
#![doc = include_str!("example.md")]

mod attributes;
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
pub use record::{Change, Delta, Record, Stamp, Vector};
pub use replica::{MOST_TOMBSTONES, Replica, unique_writer};
pub use sound::{allows, has_attribute, missing};
pub use view::{Conflict, Reason, Shown, View};
