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

/// A prediction that is not over: a clone of the world that drives.
#[derive(Debug)]
pub struct Predicting {
    imagined: World,
    /// Id of the base.
    id: String,
    /// Steps that were made, and all.
    made: u64,
    steps: u64,
    collision: Option<Collision>,
}

impl World {
    /// Where a base would be if it drove at a speed for a time, rounded up to whole steps. All
    /// others go on as they do. The world does not change: a clone of it is driven.
    pub fn predict(&self, id: &str, speed: Speed, time: Duration) -> Result<Prediction, Error> {
        let mut predicting = self.begin_prediction(id, speed, time)?;
        while !predicting.is_over() {
            predicting.step()?;
        }
        predicting.result()
    }

    /// [`World::predict`] for callers that make its steps one by one.
    pub fn begin_prediction(
        &self,
        id: &str,
        speed: Speed,
        time: Duration,
    ) -> Result<Predicting, Error> {
        let steps = time.as_nanos().div_ceil(self.step.as_nanos());
        let steps = u64::try_from(steps).unwrap_or(u64::MAX);
        if steps > Self::MOST_STEPS {
            return Err(Error::TooManySteps(steps));
        }
        let mut imagined = self.clone();
        // A world without sensors costs less.
        imagined.sensors.clear();
        imagined.drive(id, speed)?;
        Ok(Predicting {
            imagined,
            id: id.to_owned(),
            made: 0,
            steps,
            collision: None,
        })
    }
}

impl Predicting {
    /// Whether no step is left.
    pub fn is_over(&self) -> bool {
        self.made >= self.steps
    }

    /// Makes a step.
    pub fn step(&mut self) -> Result<(), Error> {
        let Self { imagined, id, .. } = self;
        imagined.step()?;
        self.made += 1;
        let stopped_by = imagined.base(id)?.stopped_by;
        if let (None, Some((body, obstacle))) = (&self.collision, stopped_by) {
            let steps = u32::try_from(self.made).unwrap_or(u32::MAX);
            self.collision = Some(Collision {
                after: imagined.step.saturating_mul(steps),
                body: imagined.id_of(body).unwrap_or_default(),
                obstacle: imagined.id_of(obstacle).unwrap_or_default(),
            });
        }
        Ok(())
    }

    /// Where the base is after the steps that were made.
    pub fn result(self) -> Result<Prediction, Error> {
        Ok(Prediction {
            pose: self.imagined.tree().pose("root", &self.id)?,
            place: self.imagined.place(&self.id)?,
            collision: self.collision,
        })
    }
}
