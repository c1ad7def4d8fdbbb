//! Pictures of cameras.

use crate::error::Error;
use crate::schedule::Measured;
use crate::signal::Errors;
use crate::world::World;
use innermodel::kinds::Camera;
use innermodel::{Kind, Point, Snapshot, sensors};
use innermodel_render::Image;
use std::sync::Arc;
use std::time::Duration;

/// One frame of a camera.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Counts the frames of the sensor from 0.
    pub number: u64,
    /// When it was taken.
    pub time: Duration,
    /// How the camera is built.
    pub camera: Camera,
    /// Colours, depths and nodes of the pixels. A depth that was lost is infinite.
    pub image: Image,
    /// The tree that it shows.
    pub tree: Arc<Snapshot>,
}

impl Picture {
    /// The points that the pixels show, in the frame of the camera, row by row. `None` where
    /// nothing is seen.
    pub fn points(&self) -> impl Iterator<Item = Option<Point>> + '_ {
        let width = self.image.width.max(1);
        self.image
            .depths
            .iter()
            .enumerate()
            .map(move |(at, depth)| {
                let (u, v) = ((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
                let point = Point::from(sensors::ray(&self.camera, u, v) * *depth);
                depth.is_finite().then_some(point)
            })
    }
}

impl World {
    /// The last frame of a `camera` or an `rgbd`.
    pub fn picture(&mut self, id: &str) -> Result<Arc<Picture>, Error> {
        let (node, frame) = match self.frame(id)? {
            (_, _, Some(Measured::Picture(picture))) => return Ok(picture),
            (node, frame, _) => (node, frame),
        };
        let tree = Arc::clone(&frame.tree);
        let here = tree.node(node)?;
        let view = innermodel_render::camera(&tree, node)?;
        let view = view.ok_or_else(|| Error::other_kind(id, here.kind(), "camera"))?;
        let drawn = self.scene.draw(&tree, &view);
        let mut image = drawn.map_err(|_| Error::TooManyValues {
            id: rc_diagnostics::foreign::clean(id),
            values: (view.camera.width * view.camera.height) as u64,
            most: innermodel_render::MOST_PIXELS as u64,
        })?;
        for problem in self.scene.problems() {
            self.tell(format!(
                "`{}` is not in the pictures as it should be: {}",
                problem.id, problem.error
            ));
        }
        let random = self.random(id, frame.number);
        match here.kind() {
            Kind::Camera(camera) => {
                let mut errors = Errors::new(&camera.signal, random, frame.bias[0]);
                if !errors.is_exact() {
                    for part in image.colours.as_flattened_mut() {
                        let measured = errors.measure(f64::from(*part));
                        *part = measured.map_or(0, |value| value.round() as u8);
                    }
                }
            }
            Kind::Rgbd(rgbd) => {
                let mut errors = Errors::new(&rgbd.signal, random, frame.bias[0]);
                if !errors.is_exact() {
                    for depth in &mut image.depths {
                        // Where nothing is seen, infinity stays.
                        let measured = errors.measure(*depth);
                        *depth = measured
                            .filter(|depth| *depth > 0.0)
                            .unwrap_or(f64::INFINITY);
                    }
                }
            }
            _ => {}
        }
        let picture = Arc::new(Picture {
            number: frame.number,
            time: frame.time,
            camera: view.camera,
            image,
            tree: frame.tree,
        });
        self.keep(node, Measured::Picture(Arc::clone(&picture)));
        Ok(picture)
    }
}
