//! Balls, cylinders and cones on the raster: where a ray meets them is known in closed form.

use crate::triangles::{Canvas, pixels};
use innermodel::kinds::Shape;
use innermodel::shapes::meet;
use innermodel::{Transform, Vector};

/// Draws a body.
pub(crate) fn draw(canvas: &mut Canvas<'_, '_>, shape: Shape, to_camera: &Transform) {
    let reach = match shape {
        Shape::Sphere { radius } => radius.abs(),
        Shape::Cylinder { radius, length } | Shape::Cone { radius, length } => {
            radius.hypot(length / 2.0)
        }
    };
    let projection = canvas.projection;
    let (width, height) = (canvas.image().width, canvas.image().height);
    let centre = to_camera.translation;
    // A sum of finite numbers may be infinite.
    if centre.z + reach < projection.near || !centre.iter().all(|n| n.is_finite()) {
        return;
    }
    let (mut columns, mut rows) = (0..width, 0..height);
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
        columns = pixels(corners.map(|p| p.0), width);
        rows = pixels(corners.map(|p| p.1), height);
    }
    let back = to_camera.inverse();
    for row in rows {
        for column in columns.clone() {
            let way = projection.ray(column as f64 + 0.5, row as f64 + 0.5);
            let found = meet(
                shape,
                &back.translation,
                &back.vector(&way),
                projection.near,
            );
            if let Some((depth, normal)) = found {
                let normal = to_camera.vector(&normal);
                canvas.pixel(row * width + column, depth, &way, &normal);
            }
        }
    }
}
