//! When sensors measure, and when their values can be read.

use crate::frames::{Cloud, ImuSample, Picture, Scan, Touch};
use crate::imu_integrator::ImuIntegrator;
use crate::random::Random;
use innermodel::kinds::Signal;
use innermodel::{Snapshot, Transform};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// The most frames of a sensor that wait for their latency.
const MOST_WAITING: usize = 4096;

/// A moment at which a sensor measures. The values are computed when they are asked for.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// Counts the frames of the sensor from 0.
    pub(crate) number: u64,
    /// When it was measured.
    pub(crate) time: Duration,
    /// The world at that time.
    pub(crate) tree: Arc<Snapshot>,
    /// The drift at that time, in units of the sensor. Only an inertial sensor has three.
    pub(crate) bias: [f64; 3],
    /// Integrator of an inertial sensor, whose measurement depends on earlier places.
    pub(crate) inertia: Option<ImuSample>,
}

/// Values of a frame.
#[derive(Clone, Debug)]
pub(crate) enum Measured {
    Scan(Arc<Scan>),
    Cloud(Arc<Cloud>),
    Picture(Arc<Picture>),
    Touch(Touch),
    ImuSample(ImuSample),
}

/// How many frames are over at a time, after the first one. Rounding is no reason to wait.
fn due(rate: f64, time: Duration) -> u64 {
    (time.as_secs_f64() * rate + 1e-6).floor() as u64
}

/// One sensor.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    /// The number of the next frame by its rate.
    due: u64,
    /// How many frames there were.
    count: u64,
    bias: [f64; 3],
    shown: Frame,
    waiting: VecDeque<Frame>,
    /// The values of `shown`, once they were computed.
    pub(crate) measured: Option<Measured>,
    /// The way of an inertial sensor.
    track: Option<ImuIntegrator>,
    /// The rate and the latency that were already checked.
    told: Option<(f64, f64)>,
}

impl Sensor {
    /// A sensor whose first frame can be read at once.
    pub(crate) fn new(
        signal: &Signal,
        time: Duration,
        tree: Arc<Snapshot>,
        track: Option<ImuIntegrator>,
    ) -> Self {
        Self {
            due: due(signal.rate, time),
            count: 1,
            bias: [0.0; 3],
            shown: Frame {
                number: 0,
                time,
                tree,
                bias: [0.0; 3],
                inertia: None,
            },
            waiting: VecDeque::new(),
            measured: None,
            track,
            told: None,
        }
    }

    /// The frame that can be read.
    pub(crate) fn shown(&self) -> &Frame {
        &self.shown
    }

    /// Measures, if it is time to.
    pub(crate) fn step(
        &mut self,
        signal: &Signal,
        (seed, id): (u64, &str),
        time: Duration,
        step: Duration,
        tree: &Arc<Snapshot>,
    ) {
        let number = due(signal.rate, time);
        let is_each = signal.rate <= 0.0 || signal.rate * step.as_secs_f64() >= 1.0;
        let is_due = is_each || number > self.due;
        self.due = number;
        if is_due {
            if signal.drift > 0.0 {
                let since = self.waiting.back().unwrap_or(&self.shown).time;
                let passed = time.saturating_sub(since).max(step).as_secs_f64();
                let mut random = Random::new(seed, id, self.count ^ (1 << 63));
                let scale = signal.drift * passed.sqrt();
                self.bias = self.bias.map(|bias| bias + scale * random.normal());
            } else {
                self.bias = [0.0; 3];
            }
            let seconds = step.as_secs_f64();
            let inertia = self.track.as_mut().map(|track| track.frame(seconds));
            self.waiting.push_back(Frame {
                number: self.count,
                time,
                tree: Arc::clone(tree),
                bias: self.bias,
                inertia,
            });
            self.count += 1;
        }
        let latency = Duration::try_from_secs_f64(signal.latency).unwrap_or(Duration::MAX);
        // Rounding of a latency is no reason to wait for a step.
        let shown = time.saturating_sub(latency) + Duration::from_nanos(1);
        while self.waiting.len() > MOST_WAITING
            || self
                .waiting
                .front()
                .is_some_and(|frame| frame.time <= shown)
        {
            if let Some(frame) = self.waiting.pop_front() {
                self.shown = frame;
                self.measured = None;
            }
        }
    }

    /// Moves an inertial sensor by a step.
    pub(crate) fn move_to(&mut self, here: &Transform, step: Duration) {
        // The node was another sensor before.
        let track = self
            .track
            .get_or_insert_with(|| ImuIntegrator::new(*here, None));
        track.move_to(here, step.as_secs_f64());
    }

    /// Moves an inertial sensor elsewhere.
    pub(crate) fn jump_to(&mut self, there: &Transform) {
        if let Some(track) = &mut self.track {
            track.jump_to(there);
        }
    }

    /// Problems of a signal that cannot be as it says, each once.
    pub(crate) fn check(&mut self, signal: &Signal, step: Duration) -> Vec<String> {
        let numbers = (signal.rate, signal.latency);
        if self.told == Some(numbers) {
            return Vec::new();
        }
        self.told = Some(numbers);
        let seconds = step.as_secs_f64();
        let mut found = Vec::new();
        // Rounding makes no problem of the rate of the steps.
        if signal.rate * seconds > 1.0 + 1e-6 {
            let rate = signal.rate;
            found.push(format!(
                "a rate of {rate} is more than one frame in each step of {step:?}: it gets that"
            ));
        }
        let wait = if signal.rate > 0.0 {
            seconds.max(1.0 / signal.rate)
        } else {
            seconds
        };
        let most = wait * MOST_WAITING as f64;
        if signal.latency > most {
            let latency = signal.latency;
            found.push(format!(
                "a latency of {latency} s is more than {MOST_WAITING} frames: they come after \
                 {most} s"
            ));
        }
        found
    }

    /// The part of the state that decides about later values.
    pub(crate) fn digest(&self) -> (u64, u64, [u64; 3], usize) {
        (
            self.due,
            self.count,
            self.bias.map(f64::to_bits),
            self.waiting.len(),
        )
    }
}
