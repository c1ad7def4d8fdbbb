//! Moves the joints of the arm to the positions of their motors.

use arm_monitor_generated::{Context, Worker, WorkerError, innermodel};

/// All it knows is in the tree.
pub struct SpecificWorker;

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let tree = ctx.tree.snapshot();
        for pair in &ctx.params.joints {
            let wrong = |what: String| {
                WorkerError::Fatal(format!("the joint of the motor `{}`: {what}", pair.motor))
            };
            let node = tree.node(&pair.joint);
            let node = node.map_err(|error| wrong(error.to_string()))?;
            if node.position().is_none() {
                return Err(wrong(format!("`{}` is not a joint", pair.joint)));
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
