//! Point clouds on the raster.

use crate::image::Image;
use crate::view::Projection;
use innermodel::{ColouredPoint, NodeId, Point, Transform};

/// How far the square of a point reaches from its pixel, in pixels.
const REACH: usize = 1;

/// Draws each point as a square of 3 × 3 pixels around the pixel where it is seen. Light does not
/// matter.
pub(crate) fn draw(
    image: &mut Image,
    projection: &Projection,
    node: NodeId,
    cloud: &[ColouredPoint],
    to_camera: &Transform,
) {
    for point in cloud {
        let position = point.position.map(f64::from);
        let place = to_camera.point(&Point::from(position)).coords;
        // NaN is not in front.
        if !(place.z >= projection.near && place.z.is_finite()) {
            continue;
        }
        let (u, v) = projection.pixel(&place);
        let inside = |at: f64, count: usize| at >= 0.0 && at < count as f64;
        if !(inside(u, image.width) && inside(v, image.height)) {
            continue;
        }
        let (column, row) = (u as usize, v as usize);
        let rows = row.saturating_sub(REACH)..image.height.min(row + REACH + 1);
        for row in rows {
            let columns = column.saturating_sub(REACH)..image.width.min(column + REACH + 1);
            for column in columns {
                let at = row * image.width + column;
                image.set(at, place.z, node, || point.colour);
            }
        }
    }
}
