//! Inertial sensors.

use crate::frames::ImuSample;
use crate::imu_integrator::ImuIntegrator;
use crate::random::Random;
use crate::schedule::Frame;
use crate::sensor_noise::SensorNoise;
use innermodel::kinds::Imu;
use innermodel::{NodeRef, Vector};

/// The sample of an inertial sensor in a frame.
pub(crate) fn sample(here: NodeRef<'_>, imu: &Imu, frame: &Frame, random: Random) -> ImuSample {
    let at_rest = || ImuIntegrator::new(here.to_root(), None).frame(1.0);
    let mut inertia = frame.inertia.unwrap_or_else(at_rest);
    inertia.number = frame.number;
    inertia.time = frame.time;
    let mut errors = SensorNoise::new(&imu.signal, random, 0.0);
    with_errors(&mut inertia, imu, &mut errors, frame.bias);
    inertia
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
