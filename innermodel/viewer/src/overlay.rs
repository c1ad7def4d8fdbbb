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

/// Draws frames and names over an image of the tree. The axes are `length` millimetres long.
pub fn draw(image: &mut Image, tree: &Snapshot, view: &View, marks: Marks, length: f64) {
    for node in tree.nodes() {
        let is_picked = marks.picked == Some(node.node_id());
        let has_frame = node.kind().may_have_children();
        if is_picked || marks.frames && has_frame {
            let long = if is_picked { 2.0 * length } else { length };
            frame(image, &node, view, long);
        }
        if is_picked || marks.names {
            let there = view.pixel(&middle(&node));
            if let Some((x, y)) = there {
                text(image, x + 3.0, y + 3.0, node.id());
            }
        }
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
