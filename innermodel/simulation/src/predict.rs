//! Prediction of motions.

use crate::error::Error;
use crate::pose2d::{Pose2D, Speed};
use crate::world::World;
use innermodel::Pose;
use std::time::Duration;

/// The first contact of a base that moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// How long after the start.
    pub after: Duration,
    /// The body of the robot.
    pub body: String,
    /// Body that it would touch.
    pub obstacle: String,
}

/// Where a base would be.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// In the root.
    pub pose: Pose,
    /// On the floor.
    pub place: Pose2D,
    /// Contact that would stop the base first.
    pub collision: Option<Collision>,
}

impl World {
    /// Where a base would be if it drove at a speed for a time, rounded up to whole steps. All
    /// others go on as they do. The world does not change: a clone of it is driven.
    pub fn predict(&self, id: &str, speed: Speed, time: Duration) -> Result<Prediction, Error> {
        self.predict_while(id, speed, time, || true)
    }

    /// [`World::predict`] for callers with a limit: before each step, `goes_on` decides.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if it said no.
    pub fn predict_while(
        &self,
        id: &str,
        speed: Speed,
        time: Duration,
        mut goes_on: impl FnMut() -> bool,
    ) -> Result<Prediction, Error> {
        let steps = time.as_nanos().div_ceil(self.step.as_nanos());
        let steps = u64::try_from(steps).unwrap_or(u64::MAX);
        if steps > Self::MOST_STEPS {
            return Err(Error::TooManySteps(steps));
        }
        let mut imagined = self.clone();
        // What no sensor measures costs nothing.
        imagined.sensors.clear();
        imagined.drive(id, speed)?;
        let mut collision = None;
        for step in 1..=steps {
            if !goes_on() {
                return Err(Error::Interrupted);
            }
            imagined.step()?;
            let stopped_by = imagined.base(id)?.stopped_by;
            if let (None, Some((body, obstacle))) = (&collision, stopped_by) {
                let steps = u32::try_from(step).unwrap_or(u32::MAX);
                collision = Some(Collision {
                    after: self.step.saturating_mul(steps),
                    body: imagined.id_of(body).unwrap_or_default(),
                    obstacle: imagined.id_of(obstacle).unwrap_or_default(),
                });
            }
        }
        Ok(Prediction {
            pose: imagined.tree().pose("root", id)?,
            place: imagined.place(id)?,
            collision,
        })
    }
}
