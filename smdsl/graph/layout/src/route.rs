//! The way of a line.

use crate::Point;

/// Removes the points of a way that are not corners.
pub(crate) fn straight(points: Vec<Point>) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::with_capacity(points.len());
    for point in points {
        if out.last() == Some(&point) {
            continue;
        }
        if let [.., before, last] = out.as_slice() {
            let (one, other) = (
                (last.x - before.x).signum() == (point.x - last.x).signum(),
                (last.y - before.y).signum() == (point.y - last.y).signum(),
            );
            if one && other {
                out.pop();
            }
        }
        out.push(point);
    }
    out
}
