//! Predictions that several requests make, so that each of them takes a bounded time.

use crate::refusal::Refusal;
use crate::worlds::Worlds;
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

/// The prediction that was asked for last, if it is not over.
#[derive(Debug, Default)]
pub(crate) struct Predictions(Option<Unfinished>);

impl Predictions {
    /// Predicts a motion, for at most `work`. Repeating the same motion in an unchanged world
    /// continues it.
    pub(crate) fn predict(
        &mut self,
        worlds: &mut Worlds,
        work: Duration,
        motion: Motion,
    ) -> Result<Prediction, Refusal> {
        let until = Instant::now() + work;
        let unfinished = self.0.take();
        let world = worlds.named(&motion.world)?;
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
            if work_is_over(until) {
                break;
            }
        }
        if predicting.is_over() {
            return Ok(predicting.result()?);
        }
        let digest = digest.unwrap_or_else(|| world.digest());
        self.0 = Some(Unfinished {
            motion,
            digest,
            predicting,
        });
        let text = "the prediction is not over: ask again, before the world changes";
        Err(Refusal::Other(Reason::Busy, text.to_owned()))
    }
}

/// Whether a request has taken its time. It has made at least one step before.
pub(crate) fn work_is_over(until: Instant) -> bool {
    Instant::now() >= until
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel_simulation::World;

    #[test]
    fn a_prediction_goes_on_until_the_world_changes() {
        let scene = r#"<innerModel><differentialrobot id="base"/></innerModel>"#;
        let tree = innermodel::InnerModel::parse(scene).expect("a scene");
        let step = Duration::from_millis(10);
        let mut worlds = Worlds::new(World::new(tree, step, 1).expect("a world"));
        let mut predictions = Predictions::default();
        let motion = || Motion {
            world: String::new(),
            base: "base".to_owned(),
            speed: Speed {
                advance: 100.0,
                ..Speed::default()
            },
            time: 4 * step,
        };
        // Without time, each request makes one step.
        let mut ask = |worlds: &mut Worlds| {
            let found = predictions.predict(worlds, Duration::ZERO, motion());
            match found {
                Ok(found) => Some(found.place.z),
                Err(Refusal::Other(Reason::Busy, _)) => None,
                Err(other) => panic!("{other:?}"),
            }
        };
        assert_eq!((0..3).filter_map(|_| ask(&mut worlds)).count(), 0);
        assert!((ask(&mut worlds).expect("the fourth step") - 4.0).abs() < 1e-6);
        assert_eq!(ask(&mut worlds), None, "it begins again");
        worlds.main.step().expect("a step");
        assert_eq!((0..3).filter_map(|_| ask(&mut worlds)).count(), 0);
        assert!(ask(&mut worlds).is_some());
    }
}
