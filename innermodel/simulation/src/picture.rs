//! Pictures of cameras.

use crate::error::Error;
use crate::frames::Picture;
use crate::schedule::Measured;
use crate::sensor_noise::SensorNoise;
use crate::world::World;
use innermodel::{Kind, Snapshot};
use innermodel_render::{Extent, Image, TooLarge, View};
use rc_diagnostics::foreign;
use std::sync::Arc;

/// The most pixels of a picture: as many as those of 2560 × 1600.
const MOST_PIXELS: u64 = 4_096_000;

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
        let pixels = view.camera.width * view.camera.height;
        if pixels.is_nan() || pixels < 1.0 || view.camera.focal <= 0.0 {
            return Err(Error::NoPicture(foreign::clean(id)));
        }
        let too_many = || Error::TooManyValues {
            id: foreign::clean(id),
            values: pixels as u64,
            most: MOST_PIXELS,
        };
        // A picture takes 27 bytes a pixel; it is refused before they are taken.
        if pixels > MOST_PIXELS as f64 {
            return Err(too_many());
        }
        let mut image = self.drawn(&tree, &view).map_err(|_| too_many())?;
        let random = self.random(id, frame.number);
        match here.kind() {
            Kind::Camera(camera) => {
                let mut errors = SensorNoise::new(&camera.signal, random, frame.bias[0]);
                if !errors.is_exact() {
                    for part in image.colours.as_flattened_mut() {
                        let measured = errors.measure(f64::from(*part));
                        *part = measured.map_or(0, |value| value.round() as u8);
                    }
                }
            }
            Kind::Rgbd(rgbd) => {
                let mut errors = SensorNoise::new(&rgbd.signal, random, frame.bias[0]);
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

    /// The world as it is, from anywhere, without the errors of its cameras.
    pub fn draw(&mut self, view: &View) -> Result<Image, Error> {
        let pixels = view.camera.width * view.camera.height;
        let most = MOST_PIXELS;
        let wrong = || Error::Pixels { pixels, most };
        if !(1.0..=most as f64).contains(&pixels) {
            return Err(wrong());
        }
        self.drawn(&self.tree(), view).map_err(|_| wrong())
    }

    /// The boxes around the bodies of the world as it is.
    pub fn extents(&mut self) -> Vec<Extent> {
        let tree = self.tree();
        self.scene.extents(&tree)
    }

    fn drawn(&mut self, tree: &Snapshot, view: &View) -> Result<Image, TooLarge> {
        let drawn = self.scene.draw(tree, view);
        for problem in self.scene.problems() {
            self.report(format!(
                "`{}` is not in the pictures as it should be: {}",
                foreign::clean(&problem.id),
                foreign::clean(&problem.error.to_string())
            ));
        }
        drawn
    }
}
