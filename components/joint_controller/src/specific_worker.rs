//! Moves one joint, and reports how far it went.

use crate::motion::{Limits, Sine, Tour};
use joint_controller_generated::tracing::info;
use joint_controller_generated::{
    Context, MotorGoalPosition, ParamChange, SetPositionError, Worker, WorkerError,
};
use std::time::{Duration, Instant};

/// How often the bus is asked for the limits of the motor: they are parameters there, and may
/// change.
const LIMITS_PAUSE: Duration = Duration::from_secs(1);

/// Limits of the motor, and progress of the motion.
pub struct SpecificWorker {
    /// The limits from the bus; `None` before its first answer.
    limits: Option<Limits>,
    /// The time of that answer.
    limits_reported: Instant,
    sine: Sine,
    tour: Tour,
    now: Instant,
    /// Where the joint was when it was last seen to move, in rad, and whether it moved towards
    /// larger angles.
    seen: Option<(f32, bool)>,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            limits: None,
            limits_reported: Instant::now(),
            sine: Sine::default(),
            tour: Tour::default(),
            now: Instant::now(),
            seen: None,
        })
    }

    /// Sends the joint on; what fails is tried again in the next period.
    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let now = Instant::now();
        let elapsed = now.duration_since(self.now);
        self.now = now;
        let limits = self.limits(ctx)?;
        let state = ctx.joint_motor.get_motor_state(&ctx.params.motor)?;
        self.tell_turns(state.pos, state.vel);

        let params = &ctx.params;
        let target = if params.motion == "sine" {
            let sine = &params.sine;
            Some(
                self.sine
                    .advance(limits, sine.amplitude, sine.frequency, elapsed),
            )
        } else {
            self.next_way_point(limits, state.pos, &params.way_points, params.tolerance)
        };
        let Some(position) = target else {
            return Ok(());
        };
        let goal = MotorGoalPosition {
            name: params.motor.clone(),
            position,
            max_speed: limits.max_speed * params.speed,
        };
        let sent = ctx.joint_motor.set_position(&goal);
        if let Err(SetPositionError::HardwareFailedException(_)) = &sent {
            // The limits of the motor may have changed already.
            self.limits = None;
        }
        Ok(sent?)
    }

    /// Refuses what the joint cannot do. Values of the configuration at the start, or before the
    /// bus has reported the limits, are clamped instead.
    fn params_changed(
        &mut self,
        _ctx: &mut Context,
        changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        let Some(limits) = self.limits else {
            return Ok(());
        };
        let mut faults = Vec::new();
        for change in changes {
            let new = std::slice::from_ref(&change.new);
            let values = change.new.as_array().unwrap_or(new).iter();
            let values = values.filter_map(|value| value.as_float());
            faults.extend(values.filter_map(|value| limits.fault(&change.path, value as f32)));
        }
        if faults.is_empty() {
            return Ok(());
        }
        Err(WorkerError::Failed(faults.join("; ")))
    }
}

impl SpecificWorker {
    /// The limits of the motor, at most [`LIMITS_PAUSE`] old.
    fn limits(&mut self, ctx: &mut Context) -> Result<Limits, WorkerError> {
        if let Some(limits) = self.limits
            && self.now.duration_since(self.limits_reported) < LIMITS_PAUSE
        {
            return Ok(limits);
        }
        let motor = ctx.joint_motor.get_motor_params(&ctx.params.motor)?;
        let limits = Limits {
            min: motor.min_pos,
            max: motor.max_pos,
            max_speed: motor.max_velocity,
        };
        if self.limits != Some(limits) {
            info!(
                "`{}` turns from {} to {} rad, at most at {} rad/s",
                motor.name, limits.min, limits.max, limits.max_speed
            );
        }
        self.limits = Some(limits);
        self.limits_reported = self.now;
        Ok(limits)
    }

    fn next_way_point(
        &mut self,
        limits: Limits,
        position: f32,
        way_points: &[f32],
        tolerance: f32,
    ) -> Option<f32> {
        let target = self.tour.target(limits, way_points)?;
        if (position - target).abs() <= tolerance {
            info!("reached {target} rad");
            self.tour.reached();
        }
        self.tour.target(limits, way_points)
    }

    fn tell_turns(&mut self, position: f32, velocity: f32) {
        if velocity == 0.0 {
            return;
        }
        let rises = velocity > 0.0;
        if let Some((farthest, rose)) = self.seen
            && rose != rises
        {
            info!("turns at {farthest:.2} rad");
        }
        self.seen = Some((position, rises));
    }
}
