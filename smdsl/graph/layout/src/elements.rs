//! Elements of one connected part of one level: items in columns, lanes, and the lines in the
//! gaps.

use crate::Point;

/// A box of one level.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) width: i32,
    pub(crate) height: i32,
    /// Where lines enter, from the upper edge.
    pub(crate) left: Vec<i32>,
    /// Where lines leave, from the upper edge.
    pub(crate) right: Vec<i32>,
    /// Its ports have to stay where they are.
    pub(crate) rigid: bool,
}

/// A line of one level; where there is no item, it comes from or goes to the border.
#[derive(Clone, Debug)]
pub(crate) struct LevelNet {
    pub(crate) source: Option<(usize, usize)>,
    pub(crate) targets: Vec<Option<(usize, usize)>>,
}

/// Items and lines in their places.
#[derive(Clone, Debug, Default)]
pub(crate) struct Placed {
    pub(crate) width: i32,
    pub(crate) height: i32,
    pub(crate) items: Vec<Point>,
    /// Where each net crosses the left border.
    pub(crate) left: Vec<Option<i32>>,
    /// Where each net crosses the right border.
    pub(crate) right: Vec<Option<i32>>,
    /// For each net and each target its corners, with both ends.
    pub(crate) routes: Vec<Vec<Vec<Point>>>,
}

/// An item of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ColumnItem {
    /// A box.
    Item(usize),
    /// Room for a line that passes.
    Lane { net: usize, back: bool },
}

/// Something in a column.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) what: ColumnItem,
    pub(crate) column: usize,
    pub(crate) height: i32,
    /// Distance of the upper edge from that of the drawing.
    pub(crate) y: i32,
}

/// Where a line touches an element: which port of an item's side, or the only place of a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Touch {
    pub(crate) element: usize,
    pub(crate) port: usize,
}

/// A net within one gap.
#[derive(Clone, Debug)]
pub(crate) struct Wire {
    pub(crate) net: usize,
    /// On the right sides of the column before.
    pub(crate) left: Vec<Touch>,
    /// On the left sides of the next column.
    pub(crate) right: Vec<Touch>,
    /// Where it runs up and down.
    pub(crate) x: i32,
}

/// All of a part.
#[derive(Debug)]
pub(crate) struct Layers {
    pub(crate) items: Vec<Item>,
    pub(crate) elements: Vec<Element>,
    /// The elements of each column, from top to bottom.
    pub(crate) columns: Vec<Vec<usize>>,
    /// The nets in each gap.
    pub(crate) gaps: Vec<Vec<Wire>>,
}

impl Layers {
    /// How far below the upper edge of its element a line touches it.
    pub(crate) fn offset(&self, touch: Touch, on_its_right: bool) -> i32 {
        match self.elements[touch.element].what {
            ColumnItem::Lane { .. } => 0,
            ColumnItem::Item(item) => {
                let item = &self.items[item];
                let ports = if on_its_right {
                    &item.right
                } else {
                    &item.left
                };
                ports.get(touch.port).copied().unwrap_or(item.height / 2)
            }
        }
    }

    /// Where a line touches an element: `on_its_right`, or on its left.
    pub(crate) fn y(&self, touch: Touch, on_its_right: bool) -> i32 {
        self.elements[touch.element].y + self.offset(touch, on_its_right)
    }
}
