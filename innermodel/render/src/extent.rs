//! The size of the bodies of a tree.

use crate::scene::{Part, Scene};
use crate::surfaces::around;
use innermodel::kinds::Shape;
use innermodel::shapes::bars;
use innermodel::{Kind, NodeId, Point, Snapshot, Transform, Vector};

/// A box around the visible bodies of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Extent {
    /// The node.
    pub node: NodeId,
    /// From the frame of the box, whose origin is its middle, to the root.
    pub place: Transform,
    /// Half of its sizes, in millimetres.
    pub half: Vector,
    /// Whether the body fills the box: a `plane`.
    pub is_full: bool,
}

impl Extent {
    /// The corners of the box, in the root.
    pub fn corners(&self) -> [Point; 8] {
        std::array::from_fn(|corner| {
            let side = |axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            let signs = Vector::new(side(0), side(1), side(2));
            self.place
                .point(&Point::from(self.half.component_mul(&signs)))
        })
    }

    /// A box between two points of a frame.
    fn between(node: NodeId, frame: &Transform, least: Vector, most: Vector) -> Option<Self> {
        let half = (most - least) / 2.0;
        let middle = least + half;
        let place = Transform {
            translation: frame.point(&Point::from(middle)).coords,
            ..*frame
        };
        let parts = half.iter().chain(place.translation.iter());
        let is_finite = parts.into_iter().all(|part| part.is_finite());
        is_finite.then_some(Self {
            node,
            place,
            half,
            is_full: false,
        })
    }
}

impl Scene {
    /// The boxes around the bodies and point clouds of a tree. A mesh that cannot be read has none.
    pub fn extents(&mut self, tree: &Snapshot) -> Vec<Extent> {
        let mut extents = Vec::new();
        for node in tree.nodes() {
            let (id, here) = (node.node_id(), node.to_root());
            if let Kind::Axes(axes) = node.kind() {
                for (size, place, _) in bars(axes.lengths, axes.widths) {
                    let half = Vector::from(size).abs() / 2.0;
                    extents.extend(Extent::between(id, &(here * place), -half, half));
                }
                continue;
            }
            if *node.kind() == Kind::PointCloud {
                let cloud = self.clouds.of(id).iter();
                let points = cloud.map(|point| Vector::from(point.position.map(f64::from)));
                if let Some((least, most)) = around(points) {
                    extents.extend(Extent::between(id, &here, least, most));
                }
                continue;
            }
            let Some((part, place)) = self.part(&node) else {
                continue;
            };
            let place = here * place;
            extents.extend(match part {
                Part::Triangles(surface) => {
                    let is_full = !matches!(node.kind(), Kind::Mesh(_));
                    surface.bounds().and_then(|(least, most)| {
                        let extent = Extent::between(id, &place, least, most)?;
                        Some(Extent { is_full, ..extent })
                    })
                }
                Part::Solid(shape) => {
                    let half = match shape {
                        Shape::Sphere { radius } => Vector::repeat(radius.abs()),
                        // Along y.
                        Shape::Cylinder { radius, length } | Shape::Cone { radius, length } => {
                            Vector::new(radius.abs(), length.abs() / 2.0, radius.abs())
                        }
                    };
                    Extent::between(id, &place, -half, half)
                }
            });
        }
        extents
    }
}
