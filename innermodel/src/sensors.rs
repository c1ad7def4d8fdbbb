//! Measurements of the sensors of a file.

use crate::{Point, Vector};
use innermodel_language::model::{Camera, Laser};

/// The pixel of a point in the frame of the camera: u = cx + f·x/z, v = cy − f·y/z. There is none
/// for a point that is not in front of the camera.
pub fn project(camera: &Camera, point: &Point) -> Option<(f64, f64)> {
    (point.z > 0.0).then(|| {
        (
            camera.width / 2.0 + camera.focal * point.x / point.z,
            camera.height / 2.0 - camera.focal * point.y / point.z,
        )
    })
}

/// The point at depth z = 1 that a pixel shows.
pub fn ray(camera: &Camera, u: f64, v: f64) -> Vector {
    Vector::new(
        (u - camera.width / 2.0) / camera.focal,
        (camera.height / 2.0 - v) / camera.focal,
        1.0,
    )
}

/// The point that a laser measures at a range in millimetres and an angle in radians.
pub fn laser_point(range: f64, angle: f64) -> Point {
    Point::new(range * angle.sin(), 0.0, range * angle.cos())
}

/// The angles of a sweep: from +angle/2 to −angle/2.
pub fn laser_angles(laser: &Laser) -> impl Iterator<Item = f64> + use<> {
    let (angle, count) = (laser.angle, laser.measures);
    let step = angle / f64::from(count.saturating_sub(1).max(1));
    (0..count).map(move |number| angle / 2.0 - f64::from(number) * step)
}
