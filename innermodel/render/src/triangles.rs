//! Triangles on the raster.

use crate::colours::shade;
use crate::image::Image;
use crate::texture::Paint;
use crate::view::Projection;
use innermodel::{NodeId, Vector};
use std::ops::Range;

/// Half the width of a line, in pixels.
const HALF_LINE: f64 = 0.75;

/// Where the body of one node is drawn.
pub(crate) struct Canvas<'c> {
    pub(crate) image: &'c mut Image,
    pub(crate) projection: &'c Projection,
    pub(crate) paint: Paint<'c>,
    /// Whether only the edges of triangles are drawn.
    pub(crate) wireframe: bool,
    pub(crate) node: NodeId,
    /// The direction to the light, if it is not at the camera.
    pub(crate) light: Option<Vector>,
}

impl Canvas<'_> {
    /// Draws a triangle with its corners in the frame of the camera.
    pub(crate) fn triangle(&mut self, corners: [Vector; 3]) {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        if normal.norm_squared() == 0.0 {
            return;
        }
        // What is behind the near plane is cut off: a triangle becomes at most a quadrangle.
        let near = self.projection.near;
        let (mut cut, mut count) = ([Vector::zeros(); 4], 0);
        let mut add = |corner: Vector| {
            cut[count] = corner;
            count += 1;
        };
        for at in 0..3 {
            let (a, b) = (corners[at], corners[(at + 1) % 3]);
            if a.z >= near {
                add(a);
            }
            if (a.z >= near) != (b.z >= near) {
                add(a + (b - a) * ((near - a.z) / (b.z - a.z)));
            }
        }
        for at in 2..count {
            // The diagonals of a quadrangle are no edges.
            let edges = [at == 2, true, at == count - 1];
            self.fill([cut[0], cut[at - 1], cut[at]], &normal, edges);
        }
    }

    fn fill(&mut self, corners: [Vector; 3], normal: &Vector, edges: [bool; 3]) {
        let points = corners.map(|corner| self.projection.pixel(&corner));
        let side = |a: (f64, f64), b: (f64, f64), p: (f64, f64)| {
            (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0)
        };
        let area = side(points[0], points[1], points[2]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let lengths = [0, 1, 2].map(|at: usize| {
            let (a, b) = (points[at], points[(at + 1) % 3]);
            (b.0 - a.0).hypot(b.1 - a.1)
        });
        let columns = pixels(points.map(|p| p.0), self.image.width);
        let rows = pixels(points.map(|p| p.1), self.image.height);
        // The plane of the triangle: normal · p = offset.
        let offset = normal.dot(&corners[0]);
        for row in rows {
            for column in columns.clone() {
                let centre = (column as f64 + 0.5, row as f64 + 0.5);
                let inside = |a: usize, b: usize| side(points[a], points[b], centre) / area >= 0.0;
                if !(inside(0, 1) && inside(1, 2) && inside(2, 0)) {
                    continue;
                }
                let is_edge = |at: usize| {
                    let apart = side(points[at], points[(at + 1) % 3], centre).abs();
                    edges[at] && apart <= HALF_LINE * lengths[at]
                };
                if self.wireframe && !(0..3).any(is_edge) {
                    continue;
                }
                let way = self.projection.ray(centre.0, centre.1);
                let depth = offset / normal.dot(&way);
                if depth >= self.projection.near {
                    let (at, paint) = (row * self.image.width + column, self.paint);
                    let light = self.light.as_ref();
                    self.image.set(at, depth, self.node, || {
                        shade(paint.at(&(way * depth)), normal, &way, light)
                    });
                }
            }
        }
    }
}

/// The pixels from the least to the greatest of some coordinates, as far as an image has them.
pub(crate) fn pixels<const N: usize>(coordinates: [f64; N], size: usize) -> Range<usize> {
    let bound = |value: f64| value.clamp(0.0, size as f64) as usize;
    let least = coordinates.iter().copied().fold(f64::INFINITY, f64::min);
    let most = coordinates
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    bound(least.floor())..bound(most.ceil())
}
