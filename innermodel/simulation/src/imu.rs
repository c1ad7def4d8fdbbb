//! Inertial sensors.

use crate::error::Error;
use crate::frames::ImuSample;
use crate::imu_integrator::ImuIntegrator;
use crate::schedule::Measured;
use crate::sensor_noise::SensorNoise;
use crate::world::World;
use innermodel::kinds::Imu;
use innermodel::{Kind, Vector};

impl World {
    /// The last frame of an `imu`.
    pub fn imu(&mut self, id: &str) -> Result<ImuSample, Error> {
        let (node, frame) = match self.frame(id)? {
            (_, _, Some(Measured::ImuSample(inertia))) => return Ok(inertia),
            (node, frame, _) => (node, frame),
        };
        let here = frame.tree.node(node)?;
        let Kind::Imu(imu) = here.kind() else {
            return Err(Error::other_kind(id, here.kind(), "imu"));
        };
        let at_rest = || ImuIntegrator::new(here.to_root(), None).frame(1.0);
        let mut inertia = frame.inertia.unwrap_or_else(at_rest);
        inertia.number = frame.number;
        inertia.time = frame.time;
        let mut errors = SensorNoise::new(&imu.signal, self.random(id, frame.number), 0.0);
        with_errors(&mut inertia, imu, &mut errors, frame.bias);
        self.keep(node, Measured::ImuSample(inertia));
        Ok(inertia)
    }
}

fn with_errors(inertia: &mut ImuSample, imu: &Imu, errors: &mut SensorNoise<'_>, bias: [f64; 3]) {
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
