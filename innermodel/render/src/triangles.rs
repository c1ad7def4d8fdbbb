//! Triangles on the raster.

use crate::colours::{PLAIN, shade};
use crate::image::Image;
use crate::layers::Layers;
use crate::texture::Paint;
use crate::view::Projection;
use innermodel::{NodeId, Vector};
use innermodel_mesh::AlphaMode;
use std::ops::Range;

/// Half the width of a line, in pixels.
const HALF_LINE: f64 = 0.75;

/// Which surfaces are drawn, and where.
pub(crate) enum Target<'c, 'i> {
    /// Opaque triangles.
    Image(&'c mut Image),
    /// Those through which others are seen.
    Layer(&'c mut Layers<'i>),
}

/// Where the body of one node is drawn.
pub(crate) struct Canvas<'c, 'i> {
    pub(crate) target: Target<'c, 'i>,
    pub(crate) projection: &'c Projection,
    pub(crate) paint: Paint<'c>,
    /// Opacity of the surface, without that of its picture.
    pub(crate) alpha: f32,
    pub(crate) alpha_mode: AlphaMode,
    /// Whether only the edges of triangles are drawn.
    pub(crate) wireframe: bool,
    pub(crate) node: NodeId,
    /// The direction to the light, if it is not at the camera.
    pub(crate) light: Option<Vector>,
}

impl<'c, 'i> Canvas<'c, 'i> {
    /// A canvas for opaque bodies without a colour.
    pub(crate) fn new(
        target: Target<'c, 'i>,
        projection: &'c Projection,
        node: NodeId,
        light: Option<Vector>,
    ) -> Self {
        Self {
            target,
            projection,
            paint: Paint::Colour(PLAIN),
            alpha: 1.0,
            alpha_mode: AlphaMode::Opaque,
            wireframe: false,
            node,
            light,
        }
    }

    /// The image that is drawn, or in front of which layers are.
    pub(crate) fn image(&self) -> &Image {
        match &self.target {
            Target::Image(image) => image,
            Target::Layer(layers) => layers.image,
        }
    }

    /// Draws a pixel of a surface with this normal, which a ray in the direction `way` meets.
    pub(crate) fn pixel(&mut self, at: usize, depth: f64, way: &Vector, normal: &Vector) {
        let (paint, light) = (&self.paint, self.light.as_ref());
        let place = way * depth;
        let alpha = || self.alpha * paint.alpha(&place);
        let colour = || shade(paint.at(&place), normal, way, light);
        match &mut self.target {
            Target::Image(image) => {
                let is_hole = match self.alpha_mode {
                    AlphaMode::Mask(least) => depth < image.depths[at] && alpha() < least,
                    AlphaMode::Opaque | AlphaMode::Blend => false,
                };
                if !is_hole {
                    image.set(at, depth, self.node, colour);
                }
            }
            Target::Layer(layers) => layers.set(at, depth, self.node, alpha, colour),
        }
    }

    /// Draws a triangle with its corners in the frame of the camera.
    pub(crate) fn triangle(&mut self, corners: [Vector; 3]) {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        if normal.norm_squared() == 0.0 {
            return;
        }
        // Everything behind the near plane is cut off: a triangle becomes at most a quadrangle.
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
            // The diagonals of a quadrangle are not edges.
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
        let width = self.image().width;
        let columns = pixels(points.map(|p| p.0), width);
        let rows = pixels(points.map(|p| p.1), self.image().height);
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
                    self.pixel(row * width + column, depth, &way, normal);
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
