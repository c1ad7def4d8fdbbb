//! The motion of an inertial sensor between two frames.

use crate::GRAVITY;
use crate::frames::ImuSample;
use innermodel::{Transform, Vector};
use nalgebra::{Rotation3, UnitQuaternion};
use std::time::Duration;

/// The way of an inertial sensor in the root.
#[derive(Clone, Debug)]
pub(crate) struct ImuIntegrator {
    last: Transform,
    /// In the last step, in mm/s. `None` after a jump.
    speed: Option<Vector>,
    /// Since the last frame: changes of the speed in m/s, turns in rad, and steps.
    faster: Vector,
    turned: Vector,
    steps: u32,
}

impl ImuIntegrator {
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

    /// The measurement of a sensor without errors where it is. The next frame begins here.
    pub(crate) fn frame(&mut self, seconds: f64) -> ImuSample {
        let passed = f64::from(self.steps.max(1)) * seconds;
        let (faster, turned) = (self.faster, self.turned);
        *self = Self::new(self.last, self.speed);
        let to_sensor = self.last.rotation.transpose();
        ImuSample {
            number: 0,
            time: Duration::ZERO,
            acceleration: faster / passed + to_sensor * Vector::new(0.0, GRAVITY, 0.0),
            turning: turned / passed,
            north: to_sensor * Vector::z(),
            orientation: self.last.pose().rotation,
        }
    }
}
