//! Pictures of a world, and what cameras make of them.

use crate::error::Error;
use crate::problems::Problems;
use crate::random::Random;
use crate::sensor_noise::SensorNoise;
use innermodel::{Kind, NodeRef, Snapshot, Vector};
use innermodel_render::{Extent, Image, Scene, TooLarge, View};
use rc_diagnostics::foreign;

/// The most pixels of a picture: as many as those of 2560 × 1600.
const MOST_PIXELS: u64 = 4_096_000;
/// The direction to the light of all cameras, in the root: from above, to the left and behind.
const LIGHT: [f64; 3] = [-0.4, 1.0, -0.3];

/// Draws a world under its light. It keeps meshes and shapes between pictures.
#[derive(Clone, Debug)]
pub(crate) struct Pictures(Scene);

impl Pictures {
    pub(crate) fn new() -> Self {
        let mut scene = Scene::new();
        scene.set_light(Some(Vector::from(LIGHT)));
        Self(scene)
    }

    /// The picture of a camera of a tree, without its errors.
    pub(crate) fn by_camera(
        &mut self,
        (tree, here): (&Snapshot, NodeRef<'_>),
        problems: &mut Problems,
    ) -> Result<(View, Image), Error> {
        let id = here.id();
        let view = innermodel_render::camera(tree, here.node_id())?;
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
        let image = self.draw(tree, &view, problems).map_err(|_| too_many())?;
        Ok((view, image))
    }

    /// A tree as a view sees it, from anywhere.
    pub(crate) fn by_view(
        &mut self,
        tree: &Snapshot,
        view: &View,
        problems: &mut Problems,
    ) -> Result<Image, Error> {
        let pixels = view.camera.width * view.camera.height;
        let most = MOST_PIXELS;
        let wrong = || Error::Pixels { pixels, most };
        if !(1.0..=most as f64).contains(&pixels) {
            return Err(wrong());
        }
        self.draw(tree, view, problems).map_err(|_| wrong())
    }

    /// The boxes around the bodies of a tree.
    pub(crate) fn extents(&mut self, tree: &Snapshot) -> Vec<Extent> {
        self.0.extents(tree)
    }

    fn draw(
        &mut self,
        tree: &Snapshot,
        view: &View,
        problems: &mut Problems,
    ) -> Result<Image, TooLarge> {
        let drawn = self.0.draw(tree, view);
        for problem in self.0.problems() {
            problems.add(format!(
                "`{}` is not in the pictures as it should be: {}",
                foreign::clean(&problem.id),
                foreign::clean(&problem.error.to_string())
            ));
        }
        drawn
    }
}

/// Adds the errors of a camera to its picture.
pub(crate) fn add_errors(image: &mut Image, kind: &Kind, random: Random, bias: f64) {
    match kind {
        Kind::Camera(camera) => {
            let mut errors = SensorNoise::new(&camera.signal, random, bias);
            if !errors.is_exact() {
                for part in image.colours.as_flattened_mut() {
                    let measured = errors.measure(f64::from(*part));
                    *part = measured.map_or(0, |value| value.round() as u8);
                }
            }
        }
        Kind::Rgbd(rgbd) => {
            let mut errors = SensorNoise::new(&rgbd.signal, random, bias);
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::InnerModel;

    #[test]
    fn a_picture_of_too_many_pixels_is_refused_before_it_is_drawn() {
        let scene = r#"<innerModel><camera id="eye" width="4000" height="4000" focal="500"/>
            <transform id="other"/></innerModel>"#;
        let tree = InnerModel::parse(scene).expect("a scene").snapshot();
        let (mut pictures, mut problems) = (Pictures::new(), Problems::default());
        let mut picture = |id: &str| {
            let here = tree.node(id).expect("a node");
            let drawn = pictures.by_camera((&tree, here), &mut problems);
            drawn.map(drop).expect_err("no picture")
        };
        assert!(matches!(
            picture("eye"),
            Error::TooManyValues {
                most: MOST_PIXELS,
                ..
            }
        ));
        assert!(picture("other").to_string().contains("camera"));
    }
}
