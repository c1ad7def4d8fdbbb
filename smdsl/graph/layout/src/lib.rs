//! A layout of nested boxes and the lines between them.
//!
//! Sources are left of targets: a layered layout (Sugiyama, Tagawa, Toda 1981). Each cluster is
//! laid out separately, inner clusters first, and is a box with ports in the cluster around it. So
//! boxes never overlap, and a line enters a cluster only if it ends inside. Lines are horizontal or
//! vertical, and the lines of a net share their route until they part. Units are those of the
//! caller; y grows downwards; equal input gives equal output.
//!
//! ```text
//! nest: a cluster at a time ─→ pack: its connected parts ─→ layers (rank → order → place → tracks)
//! ```

mod elements;
mod layers;
mod nest;
mod order;
mod pack;
mod place;
mod rank;
mod route;
mod tracks;

pub use nest::layout;

/// A box.
#[derive(Clone, Debug)]
pub struct Node {
    /// The cluster that contains it: an index into the same list, smaller than its own.
    pub parent: Option<usize>,
    /// Node, slot or cluster.
    pub shape: Shape,
}

/// Kind of a box.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A box of this size.
    Leaf {
        /// Its width.
        width: i32,
        /// Its height.
        height: i32,
        /// Where lines enter its left side, as distances from its upper edge.
        left: Vec<i32>,
        /// Where lines leave its right side, as distances from its upper edge.
        right: Vec<i32>,
    },
    /// A box around others.
    Cluster {
        /// The least that it is wide.
        width: i32,
        /// The room that is left free at its upper edge.
        header: i32,
    },
}

/// A port of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Port {
    /// The leaf: an index into the list of boxes.
    pub node: usize,
    /// An index into its ports on the side that is meant.
    pub port: usize,
}

/// A line with one beginning and any number of ends.
#[derive(Clone, Debug)]
pub struct Net {
    /// A port on a right side.
    pub from: Port,
    /// Ports on left sides.
    pub to: Vec<Port>,
}

/// A place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Point {
    /// From left to right.
    pub x: i32,
    /// From top to bottom.
    pub y: i32,
}

/// A rectangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rect {
    /// Distance of the left edge from that of the drawing.
    pub x: i32,
    /// Distance of the upper edge from that of the drawing.
    pub y: i32,
    /// Its width.
    pub width: i32,
    /// Its height.
    pub height: i32,
}

/// The result.
#[derive(Clone, Debug)]
pub struct Layout {
    /// The width of the whole layout, which begins at 0, 0.
    pub width: i32,
    /// The height of the whole layout.
    pub height: i32,
    /// One for each box.
    pub boxes: Vec<Rect>,
    /// For each net and each of its ends the corners of the way from the beginning, both included.
    pub routes: Vec<Vec<Vec<Point>>>,
}

impl Point {
    /// A place.
    pub fn new(x: i32, y: i32) -> Self {
        Self { x, y }
    }

    pub(crate) fn moved(self, by: Point) -> Self {
        Self::new(self.x + by.x, self.y + by.y)
    }
}
