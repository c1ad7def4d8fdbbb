//! The noise of a sensor.

use crate::random::Random;
use innermodel::kinds::Signal;

/// The errors of one frame of a sensor.
#[derive(Clone, Debug)]
pub struct SensorNoise<'s> {
    signal: &'s Signal,
    random: Random,
    /// Lost values and noise are independent of each other.
    losses: Random,
    /// The error that all values share.
    bias: f64,
}

impl<'s> SensorNoise<'s> {
    /// The errors of a frame. `bias` is how far the sensor has drifted.
    pub fn new(signal: &'s Signal, random: Random, bias: f64) -> Self {
        Self {
            signal,
            losses: random.branch(),
            random,
            bias,
        }
    }

    /// Whether the sensor measures without errors.
    pub fn is_exact(&self) -> bool {
        let Signal {
            noise,
            quantum,
            dropout,
            ..
        } = *self.signal;
        noise == 0.0 && quantum == 0.0 && dropout == 0.0 && self.bias == 0.0
    }

    /// The measurement of a value: bias and normal noise are added, then it is rounded. `None`:
    /// the value is lost. Each value takes the same count of random numbers.
    pub fn measure(&mut self, value: f64) -> Option<f64> {
        let measured = self.inexact(value);
        (!self.is_lost()).then_some(measured)
    }

    /// The measured value, never lost.
    pub(crate) fn inexact(&mut self, value: f64) -> f64 {
        let Signal { noise, quantum, .. } = *self.signal;
        let mut measured = value + self.bias;
        if noise > 0.0 {
            measured += noise * self.random.normal();
        }
        if quantum > 0.0 {
            measured = (measured / quantum).round() * quantum;
        }
        measured
    }

    /// Whether the next value, or a whole frame, is lost.
    pub(crate) fn is_lost(&mut self) -> bool {
        let dropout = self.signal.dropout;
        dropout > 0.0 && self.losses.unit() <= dropout
    }

    /// The numbers by chance that follow.
    pub fn random(&mut self) -> &mut Random {
        &mut self.random
    }
}
