//! Surfaces through which others are seen: layer by layer, the nearest one of each pixel first.
//!
//! This is depth peeling (Everitt, "Interactive Order-Independent Transparency", 2001). It is exact
//! for surfaces that cross each other, and needs no memory for each of them.

use crate::image::Image;
use innermodel::NodeId;

/// How many layers a pixel has at most. Surfaces behind them are drawn as if there were no more
/// layers.
pub(crate) const MOST: usize = 16;
/// A surface begins a new layer if its depth is greater by this part. Triangles that share an edge
/// are one layer there.
const APART: f64 = 1e-9;

/// The light of one pixel from the layers that were drawn so far.
#[derive(Clone, Copy)]
struct Pixel {
    /// The depth of the last layer, 0 before the first one.
    depth: f64,
    /// The light of all layers.
    colour: [f32; 3],
    /// The part of the light from behind that they let through.
    passes: f32,
}

/// The surface of the layer that is being drawn, where one was found.
#[derive(Clone, Copy)]
struct Found {
    depth: f64,
    node: NodeId,
    colour: [u8; 3],
    alpha: f32,
}

/// The layers in front of an image of opaque surfaces.
pub(crate) struct Layers<'i> {
    pub(crate) image: &'i mut Image,
    pixels: Vec<Pixel>,
    found: Vec<Option<Found>>,
    /// The first layer: pixel, depth and node.
    nearest: Vec<(usize, f64, NodeId)>,
}

impl<'i> Layers<'i> {
    pub(crate) fn new(image: &'i mut Image) -> Self {
        let count = image.depths.len();
        let pixel = Pixel {
            depth: 0.0,
            colour: [0.0; 3],
            passes: 1.0,
        };
        Self {
            image,
            pixels: vec![pixel; count],
            found: vec![None; count],
            nearest: Vec::new(),
        }
    }

    /// Sets a pixel of the layer, if the surface is behind the previous layers, and no nearer one
    /// is found.
    pub(crate) fn set(
        &mut self,
        at: usize,
        depth: f64,
        node: NodeId,
        alpha: impl FnOnce() -> f32,
        colour: impl FnOnce() -> [u8; 3],
    ) {
        let limit = self.found[at].map_or(self.image.depths[at], |found| found.depth);
        if depth >= limit || depth <= self.pixels[at].depth * (1.0 + APART) {
            return;
        }
        let alpha = alpha();
        if alpha > 0.0 {
            self.found[at] = Some(Found {
                depth,
                node,
                colour: colour(),
                alpha,
            });
        }
    }

    /// Ends the layer. Returns whether a pixel has one.
    pub(crate) fn next(&mut self) -> bool {
        let mut is_seen = false;
        for (at, (pixel, found)) in self.pixels.iter_mut().zip(&mut self.found).enumerate() {
            let Some(found) = found.take() else {
                continue;
            };
            if pixel.depth == 0.0 {
                self.nearest.push((at, found.depth, found.node));
            }
            let part = pixel.passes * found.alpha;
            for (sum, colour) in pixel.colour.iter_mut().zip(found.colour) {
                *sum += part * f32::from(colour);
            }
            pixel.passes -= part;
            pixel.depth = found.depth;
            is_seen = true;
        }
        is_seen
    }

    /// Puts the layers in front of the image. Depth and node of a pixel become those of the first
    /// layer.
    pub(crate) fn finish(self) {
        for (at, depth, node) in self.nearest {
            let pixel = &self.pixels[at];
            let behind = self.image.colours[at];
            self.image.colours[at] = [0, 1, 2].map(|part| {
                let light = pixel.colour[part] + pixel.passes * f32::from(behind[part]);
                light.round() as u8
            });
            self.image.depths[at] = depth;
            self.image.nodes[at] = Some(node);
        }
    }
}
