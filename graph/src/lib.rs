//! A property graph: typed nodes and edges with attributes, checked against a schema, in versions.
//!
//! [`Graph`] holds it. A reader takes a [`Snapshot`], which never changes, and never waits. A
//! writer changes several things at once with [`Graph::change`]; the change is checked when it
//! ends, and is published whole or not at all. Relations that a schema calls `tree interpolated`
//! have the transforms of [`innermodel`].
//!
//! ```
//! use property_graph::{Error, Graph, Schema, Time};
//!
//! let graph = Graph::new(Schema::anything().into(), 1);
//! let (ada, kitchen) = graph.change(Time::ZERO, |edit| {
//!     let ada = edit.add_node("person")?;
//!     edit.set(ada, "name", "Ada")?;
//!     let kitchen = edit.add_node("room")?;
//!     edit.set(kitchen, "name", "kitchen")?;
//!     edit.add_edge("in", ada, kitchen)?;
//!     Ok::<_, Error>((ada, kitchen))
//! })?;
//! let now = graph.snapshot();
//! let is_in = now.symbol("in").expect("a relation");
//! assert_eq!(now.out(ada, is_in).next(), Some(kitchen));
//! assert_eq!(now.named("Ada").next(), Some(ada));
//! # Ok::<(), Error>(())
//! ```

mod adopt;
mod chain;
mod check;
mod compose;
mod difference;
mod edit;
mod element;
mod error;
mod graph;
mod history;
mod last;
mod names;
mod order;
mod snapshot;
mod stored;
mod tree;
mod types;
mod value;

pub use chain::{Chain, Disagreement, Link, Loop};
pub use check::fits;
pub use difference::Change;
pub use edit::{Edit, MOST_ELEMENTS, MOST_STEPS};
pub use element::{EdgeId, Element, Id, NodeId};
pub use error::Error;
pub use graph::Graph;
pub use graph_schema as schema;
pub use graph_schema::Schema;
pub use history::{Keep, Moment};
pub use innermodel::{Point, Pose, Time, Transform};
pub use names::{KnownName, Named, Symbol};
pub use order::in_order;
pub use snapshot::{EdgeRef, NodeRef, Snapshot, Step};
pub use tree::Frame;
pub use value::{MOST_BYTES, Sample, Value};
