//! A world with the types of its schema: the parts of the code that `rcgen` generates for a clause
//! `world`.
//!
//! [`geometry`] has the types of `geometry.gdsl`. Generated code declares a type for each other type
//! of the schema ([`node!`], [`edge!`]) with its attributes, and the writable parts ([`edit_element!`],
//! [`edit_edge!`]). A [`View`] is one version, which never changes. A [`Change`] has the changes of one
//! type between two versions. [`dsr`] has the names of DSR, for moving code.
//!
#![doc = include_str!("example.md")]

mod change;
mod declare;
pub mod dsr;
mod edit;
mod error;
// As `rcgen` prints it.
#[rustfmt::skip]
#[expect(missing_docs, reason = "the documentation is that of the schema")]
pub mod geometry;
mod kind;
mod overruled;
#[cfg(feature = "queries")]
pub mod query;
pub mod read;
mod schema;
mod units;
mod view;
mod world;
pub mod write;

pub use change::Change;
pub use edit::{added, edge, existing, existing_edge};
pub use error::Error;
pub use kind::Kind;
pub use overruled::Overruled;
pub use property_graph::{
    EdgeId, EdgeRef, Edit, Element, NodeId, NodeRef, Point, Pose, Sample, Snapshot, Time,
    Transform, Value,
};
pub use rc_world::{News, Rights, Token};
pub use rc_world_member::{Member, slot};
pub use schema::{domain, schema};
pub use units::set_in;
pub use view::{End, View};
pub use world::{between, change};
