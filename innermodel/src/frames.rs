//! Between the frame of `InnerModel` and those of ROS and of `RoboComp`'s points.
//!
//! | | x | y | z | hand | length |
//! |---|---|---|---|---|---|
//! | `InnerModel` | right | up | front | left | millimetre |
//! | points of `RoboComp` | right | front | up | right | millimetre |
//! | ROS (REP 103) | front | left | up | right | metre |
//! | ROS, optical | right | down | front | right | metre |

use crate::transform::Transform;
use crate::{Point, Vector};
use nalgebra::{Isometry3, Matrix3};
use rc_quantity::{Axes, rotation};
use std::sync::LazyLock;

/// Millimetres in a metre.
const METRE: f64 = 1000.0;

fn matrix(rows: &rotation::Matrix) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

/// Takes a direction of `InnerModel` to ROS.
fn to_body() -> Matrix3<f64> {
    static MATRIX: LazyLock<Matrix3<f64>> =
        LazyLock::new(|| matrix(&Axes::INNER_MODEL.matrix_to(Axes::ROS)));
    *MATRIX
}

/// Takes a direction of `InnerModel` to an optical frame of ROS.
fn to_optical() -> Matrix3<f64> {
    static MATRIX: LazyLock<Matrix3<f64>> =
        LazyLock::new(|| matrix(&Axes::INNER_MODEL.matrix_to(Axes::ROS_OPTICAL)));
    *MATRIX
}

/// Takes a direction of `InnerModel` to the axes of points of `RoboComp`.
fn to_robocomp() -> Matrix3<f64> {
    static MATRIX: LazyLock<Matrix3<f64>> =
        LazyLock::new(|| matrix(&Axes::INNER_MODEL.matrix_to(Axes::ROBOCOMP)));
    *MATRIX
}

/// Takes an axial vector of `InnerModel`, as an angular velocity, to ROS.
fn axial_to_body() -> Matrix3<f64> {
    static MATRIX: LazyLock<Matrix3<f64>> =
        LazyLock::new(|| matrix(&Axes::INNER_MODEL.axial_matrix_to(Axes::ROS)));
    *MATRIX
}

/// The point as interfaces of `RoboComp` have it, in millimetres.
pub fn point_to_robocomp(point: &Point) -> Point {
    Point::from(to_robocomp() * point.coords)
}

/// The point in ROS, in metres.
pub fn point_to_ros(point: &Point) -> Point {
    Point::from(to_body() * point.coords / METRE)
}

/// The point in `InnerModel`, in millimetres.
pub fn point_from_ros(point: &Point) -> Point {
    Point::from(to_body().transpose() * point.coords * METRE)
}

/// The direction in ROS.
pub fn vector_to_ros(vector: &Vector) -> Vector {
    to_body() * vector
}

/// The direction in `InnerModel`.
pub fn vector_from_ros(vector: &Vector) -> Vector {
    to_body().transpose() * vector
}

/// The angular velocity in ROS. A rotation changes its sense where the hand changes.
pub fn rotation_vector_to_ros(vector: &Vector) -> Vector {
    axial_to_body() * vector
}

/// The angular velocity in `InnerModel`.
pub fn rotation_vector_from_ros(vector: &Vector) -> Vector {
    axial_to_body().transpose() * vector
}

/// The transform between two frames of ROS that have the same origins as those of `transform`.
pub fn to_ros(transform: &Transform) -> Isometry3<f64> {
    changed(transform, &to_body(), METRE.recip()).isometry()
}

/// The transform between two frames of `InnerModel`.
pub fn from_ros(isometry: &Isometry3<f64>) -> Transform {
    changed(
        &Transform::from_isometry(isometry),
        &to_body().transpose(),
        METRE,
    )
}

/// The pose of a camera: from its optical frame in ROS to the body frame in ROS that has the same
/// origin as the outer frame of `transform`.
pub fn camera_to_ros(transform: &Transform) -> Isometry3<f64> {
    Transform {
        rotation: to_body() * transform.rotation * to_optical().transpose(),
        translation: to_body() * transform.translation / METRE,
    }
    .isometry()
}

/// The point of an optical frame, in metres.
pub fn point_to_optical(point: &Point) -> Point {
    Point::from(to_optical() * point.coords / METRE)
}

fn changed(transform: &Transform, to: &Matrix3<f64>, scale: f64) -> Transform {
    Transform {
        rotation: to * transform.rotation * to.transpose(),
        translation: to * transform.translation * scale,
    }
}
