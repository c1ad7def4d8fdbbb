//! One scan, one decision, one motion, in every period.

use crate::policy::{Measure, Policy, Settings};
use avoider_generated::tracing::warn;
use avoider_generated::{Context, Worker, WorkerError};

/// The policy with its state.
pub struct SpecificWorker {
    policy: Policy,
}

impl Worker for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            policy: Policy::default(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if ctx.params.lockstep {
            // Two interfaces are two queues: a server that is late may serve the scan before the
            // motion that was sent earlier. One answers in the order in which it was asked, so that
            // an answer of the base says it is done.
            ctx.differential_robot.get_base_state()?;
        }
        let data = ctx.laser.get_laser_data()?;
        let scan: Vec<Measure> = data
            .iter()
            .map(|data| Measure {
                angle: data.angle,
                distance: data.dist,
            })
            .collect();
        let settings = Settings {
            safe_distance: ctx.params.safe_distance,
            speed: ctx.params.speed,
            turn_speed: ctx.params.turn_speed,
        };
        let motion = self.policy.decide(&scan, &settings);
        ctx.differential_robot
            .set_speed_base(motion.advance, motion.turn)?;
        Ok(())
    }

    fn finalize(&mut self, ctx: &mut Context) {
        if let Err(error) = ctx.differential_robot.stop_base() {
            warn!("the base could not be stopped: {error}");
        }
    }
}
