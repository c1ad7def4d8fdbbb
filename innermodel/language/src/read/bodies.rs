//! The elements of bodies.

use crate::attributes::Attributes;
use crate::elements;
use crate::model::{Axes, Kind, Plane, Shape, Solid};
use crate::units::Units;

/// One number: a plate of that width and height, and of a hundredth of it in depth. Two: width and
/// height, and a hundredth of the lesser one in depth. Three: width, height and depth.
pub(super) fn plane(from: &mut Attributes<'_, '_>) -> Plane {
    let size = match from.lengths_of_list("size").as_deref() {
        Some([width, height, depth]) => [*width, *height, *depth],
        Some([width, height]) => [*width, *height, width.min(*height) / 100.0],
        Some([width]) => [*width, *width, width / 100.0],
        _ => [2500.0, 2500.0, 25.0],
    };
    let normal = from.numbers(["nx", "ny", "nz"]);
    Plane {
        texture: from.text("texture"),
        picture: None,
        size,
        repeat: from.integer("repeat", 1000),
        normal: if normal.iter().all(|n| n.abs() < 0.001) {
            [normal[0], normal[1], -1.0]
        } else {
            normal
        },
        point: from.lengths(["px", "py", "pz"]),
        collide: from.flag("collide"),
    }
}

/// One number for all three, two for x and y (z as x), or three.
pub(super) fn scale(from: &mut Attributes<'_, '_>, units: Units) -> [f64; 3] {
    match from.lengths_of_list("scale").as_deref() {
        Some([x, y, z]) => [*x, *y, *z],
        Some([x, y]) => [*x, *y, *x],
        Some([all]) => [*all; 3],
        _ => [units.length(1.0); 3],
    }
}

pub(super) fn axes(from: &mut Attributes<'_, '_>) -> Kind {
    // RoboComp takes a negative length for a missing one.
    let or = |value: f64, default: f64| if value < 0.0 { default } else { value };
    let length = or(from.length("length", -1.0), 200.0);
    let width = or(from.length("width", -1.0), 15.0);
    let own = |value: f64, default: f64| if value > 0.0 { value } else { default };
    Kind::Axes(Axes {
        lengths: elements::LENGTHS.map(|names| own(from.length(names[0], -1.0), length)),
        widths: elements::WIDTHS.map(|names| own(from.length(names[0], -1.0), width)),
    })
}

pub(super) fn solid(tag: &str, from: &mut Attributes<'_, '_>) -> Kind {
    let radius = from.positive_length("radius");
    let shape = match tag {
        "sphere" => Shape::Sphere { radius },
        "cylinder" => Shape::Cylinder {
            radius,
            length: from.positive_length("length"),
        },
        _ => Shape::Cone {
            radius,
            length: from.positive_length("length"),
        },
    };
    Kind::Solid(Solid {
        shape,
        texture: from.text("texture"),
        collide: from.flag("collide"),
    })
}
