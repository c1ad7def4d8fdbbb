//! Forwards poses from shared memory to ROS 2.

use pose_relay_generated::{Context, FullPoseEuler, Robot, Worker, WorkerError};

pub struct SpecificWorker {}

impl Worker for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {})
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }
}

impl Robot for SpecificWorker {
    fn new_full_pose(&mut self, ctx: &mut Context, pose: FullPoseEuler) {
        if let Err(why) = ctx.ros.new_full_pose(&pose) {
            pose_relay_generated::tracing::warn!("a pose did not go out: {why}");
        }
    }
}
