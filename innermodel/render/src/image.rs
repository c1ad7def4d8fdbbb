//! Images of a camera.

use innermodel::{NodeId, Snapshot};
use std::collections::HashMap;
use std::io;

/// The pixels, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
    /// Red, green and blue.
    pub colours: Vec<[u8; 3]>,
    /// The coordinate z in the frame of the camera, in millimetres; infinite where nothing is.
    pub depths: Vec<f64>,
    /// The node that is seen.
    pub nodes: Vec<Option<NodeId>>,
}

impl Image {
    pub(crate) fn new(width: usize, height: usize, background: [u8; 3]) -> Self {
        let count = width * height;
        Self {
            width,
            height,
            colours: vec![background; count],
            depths: vec![f64::INFINITY; count],
            nodes: vec![None; count],
        }
    }

    /// Sets a pixel, if nothing nearer is seen there.
    pub(crate) fn set(
        &mut self,
        at: usize,
        depth: f64,
        node: NodeId,
        colour: impl FnOnce() -> [u8; 3],
    ) {
        if depth < self.depths[at] {
            self.depths[at] = depth;
            self.colours[at] = colour();
            self.nodes[at] = Some(node);
        }
    }

    /// The node at a pixel.
    pub fn node(&self, x: usize, y: usize) -> Option<NodeId> {
        let at = (x < self.width).then_some(y * self.width + x)?;
        *self.nodes.get(at)?
    }

    /// The colours as a file in the format PNG.
    pub fn png(&self) -> io::Result<Vec<u8>> {
        self.encoded(self.colours.as_flattened())
    }

    /// The nodes as a file in the format PNG: each node of the drawn tree has the colour of
    /// [`id_colours`], the background is black.
    pub fn id_png(&self, tree: &Snapshot) -> io::Result<Vec<u8>> {
        let known: HashMap<NodeId, [u8; 3]> = id_colours(tree)
            .map(|(node, _, colour)| (node, colour))
            .collect();
        let colour = |node: &Option<NodeId>| {
            let colour = node.and_then(|node| known.get(&node));
            colour.copied().unwrap_or_default()
        };
        let colours: Vec<u8> = self.nodes.iter().flat_map(colour).collect();
        self.encoded(&colours)
    }

    fn encoded(&self, colours: &[u8]) -> io::Result<Vec<u8>> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(colours).map_err(io::Error::other)?;
        writer.finish().map_err(io::Error::other)?;
        Ok(file)
    }
}

/// The nodes of a tree with their ids and the colours that [`Image::id_png`] gives them. No two of
/// 16,777,215 nodes have the same colour, and none is black.
pub fn id_colours(tree: &Snapshot) -> impl Iterator<Item = (NodeId, &str, [u8; 3])> {
    tree.nodes().zip(1_u32..).map(|(node, number)| {
        // A product with an odd number is another one for each of 2²⁴ numbers, and neighbours
        // differ much.
        let [_, red, green, blue] = number.wrapping_mul(0x9e_3779).to_be_bytes();
        (node.node_id(), node.id(), [red, green, blue])
    })
}
