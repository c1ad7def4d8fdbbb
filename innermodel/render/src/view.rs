//! From where a picture is taken.

use innermodel::kinds::Camera;
use innermodel::{Error, Key, Kind, Matrix, Point, Snapshot, Transform, Vector};

/// Distance from the camera below which nothing is seen, in millimetres.
const NEAR: f64 = 1.0;

/// From where and how a picture is taken.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Takes coordinates in the frame of the camera to those in the root.
    pub place: Transform,
    /// Width, height and focal length of the image, in pixels.
    pub camera: Camera,
}

/// The view of a node of the kind `camera` or `rgbd`. There is none for another node.
pub fn camera(tree: &Snapshot, key: impl Key) -> Result<Option<View>, Error> {
    let node = tree.node(key)?;
    let camera = match node.kind() {
        Kind::Camera(colour) => &colour.camera,
        Kind::Rgbd(rgbd) => &rgbd.camera,
        _ => return Ok(None),
    };
    Ok(Some(View {
        place: node.to_root(),
        camera: camera.clone(),
    }))
}

/// The view from one point to another one, with y of the root upwards.
pub fn look_at(from: Point, to: Point, camera: Camera) -> View {
    let front = (to - from).try_normalize(1e-12).unwrap_or_else(Vector::z);
    let right = Vector::y().cross(&front).try_normalize(1e-9);
    let right = right.unwrap_or_else(Vector::x);
    let above = front.cross(&right);
    View {
        place: Transform {
            rotation: Matrix::from_columns(&[right, above, front]),
            translation: from.coords,
        },
        camera,
    }
}

impl View {
    /// The pixel of a point of the root. There is none for a point that is not in front.
    pub fn pixel(&self, point: &Point) -> Option<(f64, f64)> {
        innermodel::sensors::project(&self.camera, &self.place.inverse().point(point))
    }
}

/// From the frame of a camera to its pixels.
pub(crate) struct Projection {
    pub(crate) camera: Camera,
    pub(crate) near: f64,
}

impl Projection {
    pub(crate) fn new(camera: &Camera) -> Self {
        Self {
            camera: camera.clone(),
            near: NEAR,
        }
    }

    /// The pixel of a point in front of the camera.
    pub(crate) fn pixel(&self, p: &Vector) -> (f64, f64) {
        let f = self.camera.focal / p.z;
        (
            self.camera.width / 2.0 + f * p.x,
            self.camera.height / 2.0 - f * p.y,
        )
    }

    /// The direction of a pixel, with z = 1.
    pub(crate) fn ray(&self, u: f64, v: f64) -> Vector {
        innermodel::sensors::ray(&self.camera, u, v)
    }
}
