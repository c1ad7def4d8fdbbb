//! Drives with a constant speed, repeats the poses that it hears, and serves a battery.

use steady_generated::tracing::info;
use steady_generated::{
    BatteryStatus, Context, FullPoseEstimationPub, FullPoseEuler, GetBatteryStateError,
    ParamChange, TBaseState, TBattery, Worker, WorkerError,
};

pub struct SpecificWorker {
    poses: u32,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let _ = ctx;
        Ok(Self { poses: 0 })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let speed = ctx.params.speed;
        ctx.differential_robot.set_speed_base(speed, 0.0)?;
        let state: TBaseState = ctx.differential_robot.get_base_state()?;
        info!("speed={} x={}", speed, state.x);
        Ok(())
    }

    fn params_changed(&mut self, ctx: &mut Context, _: &[ParamChange]) -> Result<(), WorkerError> {
        info!("parameter={}", ctx.params.speed);
        Ok(())
    }
}

impl BatteryStatus<Context> for SpecificWorker {
    fn get_battery_state(&mut self, ctx: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        let _ = ctx;
        Ok(TBattery {
            percentage: 77.0,
            ..TBattery::default()
        })
    }
}

impl FullPoseEstimationPub<Context> for SpecificWorker {
    fn new_full_pose(&mut self, ctx: &mut Context, pose: FullPoseEuler) {
        self.poses += 1;
        info!("poses={}", self.poses);
        let _ = ctx.seen.new_full_pose(&pose);
    }
}
