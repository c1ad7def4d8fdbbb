//! Frames and names over an image.

use crate::navigator::middle;
use font8x8::{BASIC_FONTS, GREEK_FONTS, LATIN_FONTS, UnicodeFonts};
use innermodel::{NodeId, NodeRef, Point, Snapshot, Vector};
use innermodel_render::{Image, View};

/// The most characters of a text that are drawn.
const LONGEST: usize = 160;

/// Lines and names over the bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Marks {
    /// The axes of each node that may have children: x red, y green, z blue.
    pub frames: bool,
    /// The id of each node.
    pub names: bool,
    /// A node whose frame and name are always drawn.
    pub picked: Option<NodeId>,
}

/// Draws frames and names over an image of the tree. The axes are `length` millimetres long. No
/// name hides another one: it moves up or down, with a line to its node, or is left out where there
/// is no room.
pub fn draw(image: &mut Image, tree: &Snapshot, view: &View, marks: Marks, length: f64) {
    let mut names = Vec::new();
    for node in tree.nodes() {
        let is_picked = marks.picked == Some(node.node_id());
        let has_frame = node.kind().may_have_children();
        if is_picked || marks.frames && has_frame {
            let long = if is_picked { 2.0 * length } else { length };
            frame(image, &node, view, long);
        }
        if (is_picked || marks.names)
            && let Some(at) = view.pixel(&middle(&node))
        {
            names.push((is_picked, at, node.id()));
        }
    }
    // The picked one has the first choice.
    names.sort_by_key(|(is_picked, ..)| !is_picked);
    let mut labels = Labels::new(image.width, image.height);
    let placed: Vec<_> = names
        .into_iter()
        .filter_map(|(_, at, id)| Some((at, labels.place(at, id)?, id)))
        .collect();
    for (at, (left, top), _) in &placed {
        if (top - at.1).abs() > 2.0 * ROW as f64 {
            line(image, *at, (*left, top + 4.0), [90; 3]);
        }
    }
    for (_, (left, top), id) in placed {
        text(image, left, top, id);
    }
}

/// The height of a line of text with its margin, and the width of a letter, in pixels.
const ROW: usize = 10;
const LETTER: usize = 8;
/// How many rows a name may be away from its node.
const FARTHEST: isize = 12;

/// Which places of an image have names: by rows, then by letters.
struct Labels {
    columns: usize,
    taken: Vec<bool>,
}

impl Labels {
    fn new(width: usize, height: usize) -> Self {
        let columns = width / LETTER;
        Self {
            columns,
            taken: vec![false; columns * (height / ROW)],
        }
    }

    /// The top left corner of a name near a pixel. `None` if there is no room, or the pixel is
    /// outside of the image.
    fn place(&mut self, (x, y): (f64, f64), name: &str) -> Option<(f64, f64)> {
        let rows = self.taken.len().checked_div(self.columns)?;
        if x < 0.0 || y < 0.0 || x >= (self.columns * LETTER) as f64 {
            return None;
        }
        let length = name.chars().count().clamp(1, LONGEST);
        // The name ends at the right side, if it is not longer than the image.
        let first = (x as usize / LETTER + 1).min(self.columns.saturating_sub(length));
        let last = (first + length).min(self.columns);
        let here = isize::try_from(y as usize / ROW).ok()?;
        let offsets = (0..=FARTHEST).flat_map(|away| [away, -away]);
        let row = offsets
            .filter_map(|offset| usize::try_from(here.checked_add(offset)?).ok())
            .filter(|row| *row < rows)
            .find(|row| {
                let start = row * self.columns;
                // A letter of room on both sides.
                let (left, right) = (first.saturating_sub(1), (last + 1).min(self.columns));
                !self.taken[start + left..start + right].contains(&true)
            })?;
        let start = row * self.columns;
        self.taken[start + first..start + last].fill(true);
        Some(((first * LETTER) as f64, (row * ROW) as f64))
    }
}

fn frame(image: &mut Image, node: &NodeRef<'_>, view: &View, length: f64) {
    let here = node.to_root();
    let Some(start) = view.pixel(&here.point(&Point::origin())) else {
        return;
    };
    for (axis, colour) in [(0, [255, 0, 0]), (1, [0, 200, 0]), (2, [0, 0, 255])] {
        let mut tip = Vector::zeros();
        tip[axis] = length;
        if let Some(end) = view.pixel(&here.point(&Point::from(tip))) {
            line(image, start, end, colour);
        }
    }
}

fn set(image: &mut Image, x: f64, y: f64, colour: [u8; 3]) {
    let (width, height) = (image.width as f64, image.height as f64);
    if (0.0..width).contains(&x) && (0.0..height).contains(&y) {
        image.colours[y as usize * image.width + x as usize] = colour;
    }
}

fn line(image: &mut Image, from: (f64, f64), to: (f64, f64), colour: [u8; 3]) {
    let (x, y) = (to.0 - from.0, to.1 - from.1);
    let longest = (image.width + image.height) as f64;
    // A point just before the camera is far outside of the image.
    let steps = x.abs().max(y.abs()).min(4.0 * longest).ceil().max(1.0);
    for step in 0..=steps as u32 {
        let part = f64::from(step) / steps;
        set(image, from.0 + x * part, from.1 + y * part, colour);
    }
}

/// Draws a line of three pixels.
pub(crate) fn thick_line(image: &mut Image, from: (f64, f64), to: (f64, f64), colour: [u8; 3]) {
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let moved = |(a, b): (f64, f64)| (a + x, b + y);
        line(image, moved(from), moved(to), colour);
    }
}

/// Writes black on white, so that it is read over every body.
pub(crate) fn text(image: &mut Image, left: f64, top: f64, words: &str) {
    let fonts = |c| {
        let known = BASIC_FONTS.get(c).or_else(|| LATIN_FONTS.get(c));
        known
            .or_else(|| GREEK_FONTS.get(c))
            .or_else(|| BASIC_FONTS.get('?'))
    };
    for (at, glyph) in words.chars().take(LONGEST).filter_map(fonts).enumerate() {
        for (row, bits) in glyph.iter().enumerate() {
            for column in 0..8 {
                let ink = bits >> column & 1 == 1;
                let x = left.floor() + (at * 8 + column) as f64;
                let colour = if ink { [0; 3] } else { [255; 3] };
                set(image, x, top.floor() + row as f64, colour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_one_place_do_not_overlap() {
        let mut labels = Labels::new(320, 240);
        let names = ["base", "base_body", "laser", "camera", "a"];
        let places: Vec<_> = names
            .iter()
            .map(|name| (labels.place((300.0, 100.0), name).expect("room"), name))
            .collect();
        for (at, ((left, top), name)) in places.iter().enumerate() {
            assert!(left + (8 * name.len()) as f64 <= 320.0, "{places:?}");
            assert!((top - 100.0).abs() <= 30.0, "{places:?}");
            let others = places[..at].iter();
            assert!(
                others.into_iter().all(|((_, other), _)| other != top),
                "{places:?}"
            );
        }
    }

    #[test]
    fn names_without_room_are_left_out() {
        let mut labels = Labels::new(64, 30);
        let long = "a name that is longer than the image";
        let placed = (0..5).filter(|_| labels.place((9.0, 15.0), long).is_some());
        assert_eq!(placed.count(), 3);
        for outside in [
            (-1.0, 5.0),
            (5.0, -1.0),
            (64.0, 5.0),
            (5.0, 1e300),
            (f64::NAN, 1.0),
        ] {
            assert_eq!(
                Labels::new(64, 30).place(outside, "x").is_some(),
                outside.0.is_nan()
            );
        }
        assert_eq!(Labels::new(3, 0).place((1.0, 0.0), "x"), None);
    }
}
