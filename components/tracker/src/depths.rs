//! The points that a depth image shows, above the floor.

use crate::Point;
use tracker_generated::TDepth;

/// Where the camera is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mount {
    /// Above the floor, in mm.
    pub(crate) height: f64,
    /// By how much it looks down, in rad.
    pub(crate) pitch: f64,
}

impl Mount {
    /// A point of the camera as seen from the floor below it: the second number is its height.
    pub(crate) fn above_floor(&self, [x, y, z]: Point) -> Point {
        let (sin, cos) = self.pitch.sin_cos();
        [x, self.height + y * cos - z * sin, y * sin + z * cos]
    }

    /// The reverse of [`Mount::above_floor`].
    pub(crate) fn before_camera(&self, [x, height, ahead]: Point) -> Point {
        let (sin, cos) = self.pitch.sin_cos();
        let up = height - self.height;
        [x, up * cos + ahead * sin, ahead * cos - up * sin]
    }
}

/// A depth image.
#[derive(Debug)]
pub(crate) struct Depths<'d> {
    width: usize,
    height: usize,
    focal: [f64; 2],
    /// In mm of one unit of the depths.
    factor: f64,
    depths: &'d [[u8; 4]],
}

impl<'d> Depths<'d> {
    /// Checks the sizes of an image. The error says what is wrong.
    pub(crate) fn new(image: &'d TDepth) -> Result<Self, String> {
        if image.compressed {
            return Err("the camera sends compressed depths, which cannot be read".to_owned());
        }
        let [width, height] = [image.width, image.height].map(|side| usize::try_from(side).ok());
        let (depths, rest) = image.depth.as_chunks();
        let pixels = width.zip(height).and_then(|(w, h)| w.checked_mul(h));
        let (Some(width), Some(height)) = (width, height) else {
            return Err(format!("{} × {} is not a size", image.width, image.height));
        };
        if pixels != Some(depths.len()) || !rest.is_empty() {
            let bytes = image.depth.len();
            return Err(format!("{bytes} bytes are not {width} × {height} depths"));
        }
        if image.focalx <= 0 || image.focaly <= 0 {
            let (x, y) = (image.focalx, image.focaly);
            return Err(format!("{x} and {y} px are not focal lengths"));
        }
        Ok(Self {
            width,
            height,
            focal: [image.focalx, image.focaly].map(f64::from),
            factor: f64::from(image.depth_factor) * 1000.0,
            depths,
        })
    }

    /// The points of the pixels that were measured, in the frame of the camera.
    pub(crate) fn points(&self) -> impl Iterator<Item = Point> + '_ {
        let middle = self.middle();
        let rows = self.depths.chunks(self.width.max(1)).zip(0_u32..);
        rows.flat_map(move |(row, v)| {
            row.iter().zip(0_u32..).filter_map(move |(depth, u)| {
                let z = f64::from(f32::from_le_bytes(*depth)) * self.factor;
                let is_measured = z.is_finite() && z > 0.0;
                is_measured.then(|| {
                    [
                        (f64::from(u) + 0.5 - middle[0]) * z / self.focal[0],
                        (middle[1] - f64::from(v) - 0.5) * z / self.focal[1],
                        z,
                    ]
                })
            })
        })
    }

    /// The column and the row of the pixel that shows a point of the camera's frame.
    pub(crate) fn pixel(&self, [x, y, z]: Point) -> [i32; 2] {
        let middle = self.middle();
        [
            (middle[0] + self.focal[0] * x / z).floor() as i32,
            (middle[1] - self.focal[1] * y / z).floor() as i32,
        ]
    }

    fn middle(&self) -> [f64; 2] {
        [self.width as f64 / 2.0, self.height as f64 / 2.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of 4 × 2 pixels, all of which are 2 m away but the first one, which saw nothing.
    fn image() -> TDepth {
        let depths = std::iter::once(0.0_f32).chain([2000.0; 7]);
        TDepth {
            width: 4,
            height: 2,
            focalx: 2,
            focaly: 2,
            depth_factor: 0.001,
            depth: depths.flat_map(f32::to_le_bytes).collect(),
            ..TDepth::default()
        }
    }

    #[test]
    fn pixels_are_points_and_points_are_pixels() {
        let image = image();
        let depths = Depths::new(&image).expect("an image");
        let points: Vec<Point> = depths.points().collect();
        assert_eq!(points.len(), 7);
        for (point, expected) in [(points[0], [-500.0, 500.0]), (points[6], [1500.0, -500.0])] {
            for axis in 0..2 {
                assert!((point[axis] - expected[axis]).abs() < 0.1, "{point:?}");
            }
            assert!((point[2] - 2000.0).abs() < 0.1, "{point:?}");
        }
        assert_eq!(depths.pixel(points[0]), [1, 0]);
        assert_eq!(depths.pixel(points[6]), [3, 1]);
    }

    #[test]
    fn a_camera_that_looks_down_sees_the_floor_ahead() {
        let mount = Mount {
            height: 1500.0,
            pitch: std::f64::consts::FRAC_PI_6,
        };
        // The axis of the camera meets the floor at twice its height.
        let [x, height, ahead] = mount.above_floor([0.0, 0.0, 3000.0]);
        assert!(x == 0.0 && height.abs() < 1e-9, "{height}");
        assert!((ahead - 2598.0).abs() < 0.1, "{ahead}");
        let point = [100.0, -250.0, 2000.0];
        let back = mount.before_camera(mount.above_floor(point));
        for axis in 0..3 {
            assert!((back[axis] - point[axis]).abs() < 1e-9, "{back:?}");
        }
    }

    #[test]
    fn images_that_are_not_what_they_say_are_refused() {
        let refused = |change: fn(&mut TDepth)| {
            let mut image = image();
            change(&mut image);
            Depths::new(&image).map(drop).expect_err("a wrong image")
        };
        let compressed = refused(|image| image.compressed = true);
        assert!(compressed.contains("compressed"), "{compressed}");
        let short = refused(|image| image.depth.truncate(31));
        assert_eq!(short, "31 bytes are not 4 × 2 depths");
        let large = refused(|image| image.width = i32::MAX);
        assert!(large.contains("32 bytes"), "{large}");
        let negative = refused(|image| image.height = -2);
        assert_eq!(negative, "4 × -2 is not a size");
        let blind = refused(|image| image.focalx = 0);
        assert_eq!(blind, "0 and 2 px are not focal lengths");
    }

    #[test]
    fn numbers_that_are_none_are_no_points() {
        let mut image = image();
        for (at, number) in [f32::NAN, f32::INFINITY, -1.0].into_iter().enumerate() {
            image.depth[4 * at..4 * at + 4].copy_from_slice(&number.to_le_bytes());
        }
        assert_eq!(Depths::new(&image).expect("an image").points().count(), 5);
    }
}
