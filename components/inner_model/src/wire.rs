//! Between the tree and the types of the interfaces.

use inner_model_generated::{Attribute, ColouredPoint, Direction, Node, Point, Pose};
use innermodel::{NodeRef, Vector};

pub(crate) fn point_in(point: &Point) -> innermodel::Point {
    innermodel::Point::new(point.x, point.y, point.z)
}

pub(crate) fn point_out(point: &innermodel::Point) -> Point {
    Point {
        x: point.x,
        y: point.y,
        z: point.z,
    }
}

pub(crate) fn direction_in(direction: &Direction) -> Vector {
    Vector::new(direction.x, direction.y, direction.z)
}

pub(crate) fn direction_out(vector: &Vector) -> Direction {
    Direction {
        x: vector.x,
        y: vector.y,
        z: vector.z,
    }
}

pub(crate) fn pose_in(pose: &Pose) -> innermodel::Pose {
    innermodel::Pose::new(pose.x, pose.y, pose.z, pose.rx, pose.ry, pose.rz)
}

pub(crate) fn pose_out(pose: &innermodel::Pose) -> Pose {
    let ([x, y, z], [rx, ry, rz]) = (pose.translation, pose.rotation);
    Pose {
        x,
        y,
        z,
        rx,
        ry,
        rz,
    }
}

pub(crate) fn coloured_in(point: &ColouredPoint) -> innermodel::ColouredPoint {
    innermodel::ColouredPoint {
        position: [point.x, point.y, point.z],
        colour: [point.red, point.green, point.blue],
    }
}

pub(crate) fn coloured_out(point: &innermodel::ColouredPoint) -> ColouredPoint {
    let ([x, y, z], [red, green, blue]) = (point.position, point.colour);
    ColouredPoint {
        x,
        y,
        z,
        red,
        green,
        blue,
    }
}

/// A node without its children. The root has no element.
pub(crate) fn node_out(node: &NodeRef<'_>) -> Node {
    let parent = node.parent();
    let attributes = node.attributes();
    Node {
        id: node.id().to_owned(),
        parent: parent.map_or_else(String::new, |parent| parent.id().to_owned()),
        element: parent.map_or_else(String::new, |_| node.element()),
        position: node.position().unwrap_or_default(),
        attributes: attributes
            .map(|(name, form, value)| Attribute {
                name: name.to_owned(),
                type_: form.to_owned(),
                value: value.to_owned(),
            })
            .collect(),
    }
}
