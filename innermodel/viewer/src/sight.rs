//! Lines of sight, and their intersections.

use innermodel::{Point, Vector};

/// The line of sight at a pixel, in the root.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// Where the camera is.
    pub(crate) from: Point,
    /// A direction, along which the depth grows by 1.
    pub(crate) direction: Vector,
}

impl Sight {
    /// The place along a line through `origin` that is nearest to the line of sight. The axis has
    /// the length 1. `None` if both are parallel, or the point is not in front.
    pub(crate) fn along(&self, origin: &Point, axis: &Vector) -> Option<f64> {
        let back = origin - self.from;
        let (along, square) = (axis.dot(&self.direction), self.direction.norm_squared());
        let (own, other) = (axis.dot(&back), self.direction.dot(&back));
        let apart = square - along * along;
        let depth = (other - along * own) / apart;
        let place = (along * other - square * own) / apart;
        (apart > 1e-9 * square && depth > 0.0).then_some(place)
    }

    /// Where the line of sight meets a plane. `None` if it does not in front.
    pub(crate) fn on_plane(&self, origin: &Point, normal: &Vector) -> Option<Point> {
        let depth = (origin - self.from).dot(normal) / self.direction.dot(normal);
        let is_seen = depth.is_finite() && depth > 0.0;
        is_seen.then(|| self.from + self.direction * depth)
    }

    /// The depth of a point.
    pub(crate) fn depth(&self, point: &Point) -> f64 {
        (point - self.from).dot(&self.direction) / self.direction.norm_squared()
    }
}
