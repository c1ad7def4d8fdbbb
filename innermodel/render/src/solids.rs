//! Balls, cylinders and cones on the raster: where a ray meets them is known in closed form.

use crate::colours::shade;
use crate::triangles::{Canvas, pixels};
use innermodel::kinds::Shape;
use innermodel::{Transform, Vector};

/// Draws a body.
pub(crate) fn draw(canvas: &mut Canvas<'_>, shape: Shape, to_camera: &Transform) {
    let reach = match shape {
        Shape::Sphere { radius } => radius.abs(),
        Shape::Cylinder { radius, length } | Shape::Cone { radius, length } => {
            radius.hypot(length / 2.0)
        }
    };
    let (projection, light) = (canvas.projection, canvas.light.as_ref());
    let image = &mut *canvas.image;
    let centre = to_camera.translation;
    if centre.z + reach < projection.near {
        return;
    }
    let (mut columns, mut rows) = (0..image.width, 0..image.height);
    if centre.z - reach > projection.near {
        // The box around the ball that contains the body.
        let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: u32| {
            let side = |axis: u32| {
                if corner >> axis & 1 == 0 {
                    -reach
                } else {
                    reach
                }
            };
            projection.pixel(&(centre + Vector::new(side(0), side(1), side(2))))
        });
        columns = pixels(corners.map(|p| p.0), image.width);
        rows = pixels(corners.map(|p| p.1), image.height);
    }
    let back = to_camera.inverse();
    for row in rows {
        for column in columns.clone() {
            let way = projection.ray(column as f64 + 0.5, row as f64 + 0.5);
            let found = meet(shape, back.translation, back.vector(&way), projection.near);
            if let Some((depth, normal)) = found {
                let (at, colour) = (row * image.width + column, canvas.colour);
                image.set(at, depth, canvas.node, || {
                    shade(colour, &to_camera.vector(&normal), &way, light)
                });
            }
        }
    }
}

/// The first point of a ray on a surface, as a multiple of its direction, and the normal there.
/// Only multiples of at least `least` count.
fn meet(shape: Shape, start: Vector, way: Vector, least: f64) -> Option<(f64, Vector)> {
    let mut best: Option<(f64, Vector)> = None;
    let mut take = |t: f64, normal: Vector| {
        if t >= least && best.is_none_or(|(before, _)| t < before) {
            best = Some((t, normal));
        }
    };
    let at = |t: f64| start + way * t;
    match shape {
        Shape::Sphere { radius } => {
            let (b, c) = (start.dot(&way), start.norm_squared() - radius * radius);
            roots(way.norm_squared(), b, c, &mut |t| take(t, at(t)));
        }
        Shape::Cylinder { radius, length } => {
            let half = length / 2.0;
            let flat = |a: Vector, b: Vector| a.x * b.x + a.z * b.z;
            let c = flat(start, start) - radius * radius;
            roots(flat(way, way), flat(start, way), c, &mut |t| {
                let p = at(t);
                if p.y.abs() <= half {
                    take(t, Vector::new(p.x, 0.0, p.z));
                }
            });
            for end in [-half, half] {
                let t = (end - start.y) / way.y;
                if t.is_finite() && flat(at(t), at(t)) <= radius * radius {
                    take(t, Vector::new(0.0, end, 0.0));
                }
            }
        }
        Shape::Cone { radius, length } => {
            // x² + z² = (slope·(tip − y))²
            let (half, slope) = (length / 2.0, radius / length);
            let down = half - start.y;
            let flat = |a: Vector, b: Vector| a.x * b.x + a.z * b.z;
            let square = flat(way, way) - slope * slope * way.y * way.y;
            let linear = flat(start, way) + slope * slope * down * way.y;
            let constant = flat(start, start) - slope * slope * down * down;
            roots(square, linear, constant, &mut |t| {
                let p = at(t);
                if p.y.abs() <= half {
                    take(t, Vector::new(p.x, slope * slope * (half - p.y), p.z));
                }
            });
            let end = (-half - start.y) / way.y;
            if end.is_finite() && flat(at(end), at(end)) <= radius * radius {
                take(end, -Vector::y());
            }
        }
    }
    best
}

/// The solutions of a·t² + 2·b·t + c = 0.
fn roots(a: f64, b: f64, c: f64, take: &mut dyn FnMut(f64)) {
    if a.abs() < 1e-15 {
        if b != 0.0 {
            take(-c / (2.0 * b));
        }
        return;
    }
    let square = b * b - a * c;
    if square >= 0.0 {
        // The larger one first: the other one of their product loses no digits.
        let q = -(b + square.sqrt().copysign(b));
        take(q / a);
        if q != 0.0 {
            take(c / q);
        }
    }
}
