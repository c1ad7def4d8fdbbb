//! Moves the joints of the arm to where their motors stand.

use arm_monitor_generated::tracing::warn;
use arm_monitor_generated::{Context, Worker, WorkerError, innermodel};

/// All it knows is in the tree.
pub struct SpecificWorker;

impl Worker for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let tree = ctx.tree.snapshot();
        for pair in &ctx.params.joints {
            if let Err(error) = tree.node(&pair.joint) {
                warn!("the motor `{}`: {error}", pair.motor);
            }
        }
        Ok(Self)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let states = ctx.joint_motor.get_all_motor_state()?;
        let now = innermodel::Time::from_nanos(ctx.now().as_nanos());
        ctx.tree.change(now, |edit| {
            for pair in &ctx.params.joints {
                if let Some(state) = states.get(&pair.motor) {
                    edit.set_joint(&pair.joint, f64::from(state.pos))?;
                }
            }
            Ok::<(), innermodel::Error>(())
        })?;
        Ok(())
    }
}
