//! Inertial sensors.

use crate::GRAVITY;
use crate::error::Error;
use crate::schedule::Measured;
use crate::signal::Errors;
use crate::world::World;
use innermodel::kinds::Imu;
use innermodel::{Kind, Transform, Vector};
use nalgebra::{Rotation3, UnitQuaternion};
use std::time::Duration;

/// What an inertial sensor measures.
///
/// Acceleration and turning are means over the time from the frame before to this one. So their
/// sums are the speed and the angle, whatever `rate` is. A mean belongs to the middle of that time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
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

/// The way of an inertial sensor in the root.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    last: Transform,
    /// In the last step, in mm/s. `None` after a jump.
    speed: Option<Vector>,
    /// Since the last frame: changes of the speed in m/s, turns in rad, and steps.
    faster: Vector,
    turned: Vector,
    steps: u32,
}

impl Track {
    /// The way of a sensor at a place.
    pub(crate) fn new(here: Transform, speed: Option<Vector>) -> Self {
        Self {
            last: here,
            speed,
            faster: Vector::zeros(),
            turned: Vector::zeros(),
            steps: 0,
        }
    }

    /// Goes on elsewhere, with an unknown speed.
    pub(crate) fn jump_to(&mut self, there: &Transform) {
        (self.last, self.speed) = (*there, None);
    }

    /// Goes on after a step of `seconds`.
    pub(crate) fn move_to(&mut self, here: &Transform, seconds: f64) {
        let speed = (here.translation - self.last.translation) / seconds;
        let faster = speed - self.speed.unwrap_or(speed);
        let back = self.last.rotation.transpose();
        self.faster += back * faster / 1000.0;
        // A quaternion has the small angles, for which the trace of a matrix has too few digits.
        let turn = Rotation3::from_matrix_unchecked(back * here.rotation);
        self.turned += UnitQuaternion::from_rotation_matrix(&turn).scaled_axis();
        (self.last, self.speed) = (*here, Some(speed));
        self.steps += 1;
    }

    /// What a sensor without errors measures where it is. The next frame begins here.
    pub(crate) fn frame(&mut self, seconds: f64) -> Inertia {
        let passed = f64::from(self.steps.max(1)) * seconds;
        let (faster, turned) = (self.faster, self.turned);
        *self = Self::new(self.last, self.speed);
        let to_sensor = self.last.rotation.transpose();
        Inertia {
            number: 0,
            time: Duration::ZERO,
            acceleration: faster / passed + to_sensor * Vector::new(0.0, GRAVITY, 0.0),
            turning: turned / passed,
            north: to_sensor * Vector::z(),
            orientation: self.last.pose().rotation,
        }
    }
}

impl World {
    /// The last frame of an `imu`.
    pub fn inertia(&mut self, id: &str) -> Result<Inertia, Error> {
        let (node, frame) = match self.frame(id)? {
            (_, _, Some(Measured::Inertia(inertia))) => return Ok(inertia),
            (node, frame, _) => (node, frame),
        };
        let here = frame.tree.node(node)?;
        let Kind::Imu(imu) = here.kind() else {
            return Err(Error::other_kind(id, here.kind(), "imu"));
        };
        let at_rest = || Track::new(here.to_root(), None).frame(1.0);
        let mut inertia = frame.inertia.unwrap_or_else(at_rest);
        inertia.number = frame.number;
        inertia.time = frame.time;
        let mut errors = Errors::new(&imu.signal, self.random(id, frame.number), 0.0);
        with_errors(&mut inertia, imu, &mut errors, frame.bias);
        self.keep(node, Measured::Inertia(inertia));
        Ok(inertia)
    }
}

fn with_errors(inertia: &mut Inertia, imu: &Imu, errors: &mut Errors<'_>, bias: [f64; 3]) {
    if errors.is_lost() {
        // A lost frame reads 0.
        inertia.acceleration = Vector::zeros();
        inertia.turning = Vector::zeros();
        return;
    }
    for (value, bias) in inertia.acceleration.iter_mut().zip(bias) {
        *value = errors.inexact(*value + bias);
    }
    if imu.gyro_noise > 0.0 {
        for value in inertia.turning.iter_mut() {
            *value += imu.gyro_noise * errors.random().normal();
        }
    }
}
