//! Replicas of a property graph, which converge whatever the network loses, repeats or reorders.
//!
//! A [`Replica`] is changed without asking anybody, and gives others [`Delta`]s. Each attribute is
//! a register whose latest [`Stamp`] wins. An element is removed by a tombstone, which is kept until
//! all known replicas have seen it. [`Replica::view`] repairs what two replicas did against each
//! other, in the same way everywhere: what loses is listed as a conflict, and stays.

mod replica;
mod view;

pub use replica::{Delta, Record, Replica, Stamp, Vector, unique_writer};
pub use view::{Conflict, Reason, View};
