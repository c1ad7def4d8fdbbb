//! Measurements of sensors.

use innermodel::kinds::Camera;
use innermodel::{NodeId, Point, Snapshot, Vector, sensors};
use innermodel_render::Image;
use std::sync::Arc;
use std::time::Duration;

/// One measure of a laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// In radians from z, towards x, as `InnerModel` has it: positive to the right.
    pub angle: f64,
    /// In millimetres; the greatest range where nothing is met.
    pub distance: f64,
}

/// One frame of a laser or of an ultrasound sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// Counts the frames of the sensor from 0.
    pub number: u64,
    /// When it was measured.
    pub time: Duration,
    /// From right to left. An ultrasound sensor has one.
    pub ranges: Vec<Range>,
}

/// A point of a lidar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// In the frame of the sensor.
    pub point: Point,
    /// In radians from z, towards x.
    pub azimuth: f64,
    /// In radians from the plane of x and z, upwards.
    pub elevation: f64,
    /// In millimetres.
    pub distance: f64,
    /// The node that was met.
    pub node: NodeId,
    /// The ring, from 0 for the lowest one.
    pub ring: u32,
}

/// One frame of a lidar. Rays that meet nothing have no point.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// Counts the frames of the sensor from 0.
    pub number: u64,
    /// When it was measured.
    pub time: Duration,
    /// Ring by ring, from right to left.
    pub points: Vec<CloudPoint>,
}

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
    /// The points that the pixels show, in the frame of the camera, row by row. `None` if nothing
    /// is visible.
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

/// Measurement of a touch sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Counts the frames of the sensor from 0.
    pub number: u64,
    /// When it was measured.
    pub time: Duration,
    /// Body that a body below the sensor touches.
    pub node: Option<NodeId>,
}

/// Measurement of an inertial sensor.
///
/// Acceleration and turning are means over the time from the frame before to this one. So their
/// sums are the speed and the angle, whatever `rate` is. A mean belongs to the middle of that time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// Counts the frames of the sensor from 0.
    pub number: u64,
    /// When it was measured: the end of the time over which the means are.
    pub time: Duration,
    /// Specific force in m/s²: acceleration less that of free fall. At rest it is +9.81 upwards.
    /// The acceleration is that between steps, in the axes that the sensor had there, so it is half
    /// a step older than `turning`; free fall is in the axes of `orientation`.
    pub acceleration: Vector,
    /// The speed of turning in rad/s, about x, y and z in the sense of `InnerModel`'s matrices.
    pub turning: Vector,
    /// The direction of the root's z axis, of length 1, in place of a magnetic field, at `time`.
    pub north: Vector,
    /// Angles about x, y and z of the sensor in the root, at `time`.
    pub orientation: [f64; 3],
}
