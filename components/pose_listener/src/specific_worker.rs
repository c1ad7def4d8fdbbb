//! Logs once a second where the robot is.

use pose_listener_generated::tracing::info;
use pose_listener_generated::{Context, FullPoseEuler, Ros, Worker, WorkerError};

pub struct SpecificWorker {
    count: u64,
    last: FullPoseEuler,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        let (count, last) = (0, FullPoseEuler::default());
        Ok(Self { count, last })
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        let FullPoseEuler { x, y, .. } = self.last;
        info!("heard in ROS 2: x={x:.0} y={y:.0} poses={}", self.count);
        Ok(())
    }
}

impl Ros<Context> for SpecificWorker {
    fn new_full_pose(&mut self, _ctx: &mut Context, pose: FullPoseEuler) {
        self.count += 1;
        self.last = pose;
    }
}
