//! From where a picture of a tree is taken.

use crate::navigator::{Navigator, scene};
use innermodel::kinds::Camera;
use innermodel::{Point, Snapshot};
use innermodel_render::{Extent, View, camera, look_at};
use rc_diagnostics::foreign::clean;
use thiserror::Error;

/// From where a picture of a tree is taken.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Viewpoint {
    /// From where the whole tree is seen.
    #[default]
    Whole,
    /// The id of a `camera` or `rgbd`.
    Camera(String),
    /// A point of the root, and the one in the middle of the picture: without one, that of the
    /// scene.
    Point(Point, Option<Point>),
}

/// Error of a viewpoint that a tree does not have.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ViewpointError {
    /// No node has the id.
    #[error(transparent)]
    Tree(#[from] innermodel::Error),
    /// The node is not a camera.
    #[error("`{id}` is not a camera; {known}")]
    NoCamera {
        /// The node.
        id: String,
        /// Which cameras there are, in words.
        known: String,
    },
    /// The camera has no pixels or no focal length.
    #[error("`{0}` has no pictures: its width, its height and its focal length must be set")]
    NoPicture(String),
}

impl Viewpoint {
    /// The size of a picture that no camera takes, in pixels.
    pub const SIZE: (usize, usize) = (960, 640);

    /// The view on a picture of a size in pixels; without one, it is that of the camera or
    /// [`Viewpoint::SIZE`]. `extents` are the boxes of the bodies of the tree.
    pub fn view(
        &self,
        tree: &Snapshot,
        extents: &[Extent],
        size: Option<(usize, usize)>,
    ) -> Result<View, ViewpointError> {
        let (width, height) = size.unwrap_or(Self::SIZE);
        let around = || Navigator::around(tree, extents, (width, height)).view(width, height);
        match self {
            Self::Whole => Ok(around()),
            Self::Camera(id) => node_view(tree, id, size),
            Self::Point(eye, target) => {
                let target = target.unwrap_or_else(|| scene(extents).0);
                Ok(look_at(*eye, target, around().camera))
            }
        }
    }
}

fn node_view(
    tree: &Snapshot,
    id: &str,
    size: Option<(usize, usize)>,
) -> Result<View, ViewpointError> {
    let Some(mut view) = camera(tree, id)? else {
        let cameras = tree.nodes();
        let cameras = cameras.filter(|node| matches!(node.kind().tag(), "camera" | "rgbd"));
        let cameras: Vec<String> = cameras.map(|node| clean(node.id())).collect();
        let known = if cameras.is_empty() {
            "there is none".to_owned()
        } else {
            format!("there are {}", cameras.join(", "))
        };
        let id = clean(id);
        return Err(ViewpointError::NoCamera { id, known });
    };
    let own = &view.camera;
    if !(own.width >= 1.0 && own.height >= 1.0 && own.focal > 0.0) {
        return Err(ViewpointError::NoPicture(clean(id)));
    }
    if let Some((width, height)) = size {
        // The picture shows the same part of the world, with other pixels.
        let (width, height) = (width as f64, height as f64);
        view.camera = Camera {
            width,
            height,
            focal: own.focal * width / own.width,
        };
    }
    Ok(view)
}
