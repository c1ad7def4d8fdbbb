//! Predictions that several requests make, so that each of them takes a bounded time.

use crate::SpecificWorker;
use crate::refusal::Refusal;
use innermodel_simulation::{Predicting, Prediction, Speed};
use rcis_generated::types::rc_simulation::Reason;
use std::time::{Duration, Instant};

/// The motion that a request asks about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Motion {
    /// Name of the world.
    pub(crate) world: String,
    /// Id of the base.
    pub(crate) base: String,
    pub(crate) speed: Speed,
    pub(crate) time: Duration,
}

/// A prediction that waits for the next request.
#[derive(Debug)]
pub(crate) struct Unfinished {
    motion: Motion,
    /// The world in which it began.
    digest: u64,
    predicting: Predicting,
}

impl SpecificWorker {
    /// Predicts a motion, for at most `work`. The same motion in an unchanged world goes on.
    pub(crate) fn prediction(
        &mut self,
        work: Duration,
        motion: Motion,
    ) -> Result<Prediction, Refusal> {
        let until = Instant::now() + work;
        let unfinished = self.predicting.take();
        let world = self.named(&motion.world)?;
        let unfinished = unfinished.filter(|it| it.motion == motion);
        let unfinished = unfinished.filter(|it| it.digest == world.digest());
        let (mut predicting, digest) = match unfinished {
            Some(it) => (it.predicting, Some(it.digest)),
            None => {
                let begun = world.begin_prediction(&motion.base, motion.speed, motion.time)?;
                (begun, None)
            }
        };
        while !predicting.is_over() {
            predicting.step()?;
            if Instant::now() >= until {
                break;
            }
        }
        if predicting.is_over() {
            return Ok(predicting.result()?);
        }
        let digest = digest.unwrap_or_else(|| world.digest());
        self.predicting = Some(Unfinished {
            motion,
            digest,
            predicting,
        });
        let text = "the prediction is not over: ask again, before the world changes";
        Err(Refusal::Other(Reason::Busy, text.to_owned()))
    }
}
