//! Types of nodes and edges.

use property_graph::{Element, Snapshot};

/// A type of nodes or edges. [`node!`](crate::node) and [`edge!`](crate::edge!) declare one.
pub trait Kind {
    /// Name of the type in the schema.
    const NAME: &'static str;
    /// An element of a version that has the type, or one that inherits from it.
    type In<'s>: Copy;

    /// The element, if it has the type, or one that inherits from it.
    fn of(snapshot: &Snapshot, element: Element) -> Option<Self::In<'_>>;

    /// All elements of the type in a version.
    fn all(snapshot: &Snapshot) -> Box<dyn Iterator<Item = Self::In<'_>> + '_>;
}
