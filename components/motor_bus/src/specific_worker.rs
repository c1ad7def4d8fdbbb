//! Serves the motors of the bus.

use crate::motor::{Goal, Motor};
use motor_bus_generated::parameters::MotorsParams;
use motor_bus_generated::{
    BusParams, Context, GetAllMotorStateError, GetMotorParamsError, GetMotorStateError,
    GetMotorStateMapError, HardwareFailedException, JointMotor, MotorGoalPosition,
    MotorGoalPositionList, MotorGoalVelocity, MotorGoalVelocityList, MotorList, MotorParams,
    MotorParamsList, MotorState, MotorStateMap, ParamChange, SetPositionError,
    SetSyncPositionError, SetSyncVelocityError, SetSyncZeroPosError, SetVelocityError,
    SetZeroPosError, UnknownMotorException, Worker, WorkerError,
};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The motors, in the order of the parameters; none before the bus is configured.
pub struct SpecificWorker {
    motors: Vec<Motor>,
    /// The moment of which the motors tell.
    now: Instant,
    /// The moment of the last reading, as the interface writes it.
    time_stamp: String,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            motors: Vec::new(),
            now: Instant::now(),
            time_stamp: time_stamp(),
        })
    }

    /// Finds the motors. A driver of a real bus opens its device here.
    fn configure(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.motors = ctx.params.motors.iter().map(Motor::new).collect();
        Ok(())
    }

    /// From now on time passes for the motors.
    fn activate(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        self.now = Instant::now();
        self.time_stamp = time_stamp();
        Ok(())
    }

    /// No motor moves on, or goes to an earlier goal when the bus is active again.
    fn deactivate(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        self.motors.iter_mut().for_each(Motor::hold);
        Ok(())
    }

    fn cleanup(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        self.motors.clear();
        Ok(())
    }

    /// Lets the time that has passed pass for the motors.
    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let now = Instant::now();
        let elapsed = now.duration_since(self.now);
        for (motor, limits) in self.motors.iter_mut().zip(&ctx.params.motors) {
            motor.advance(limits, elapsed);
        }
        self.now = now;
        self.time_stamp = time_stamp();
        Ok(())
    }

    /// Refuses limits that a motor would have to move for. If one motor refuses, none gets the new
    /// limits.
    fn params_changed(
        &mut self,
        ctx: &mut Context,
        _changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        for (motor, limits) in self.motors.iter().zip(&ctx.params.motors) {
            motor.stays_within(limits).map_err(WorkerError::Failed)?;
        }
        Ok(())
    }
}

/// Seconds since 1970-01-01 00:00 UTC.
fn time_stamp() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    format!("{:.3}", since.unwrap_or_default().as_secs_f64())
}

/// Which motor is called `name`.
fn find(ctx: &Context, name: &str) -> Result<usize, UnknownMotorException> {
    let motors = &ctx.params.motors;
    let index = motors.iter().position(|motor| motor.name == name);
    index.ok_or_else(|| {
        let names: Vec<&str> = motors.iter().map(|motor| motor.name.as_str()).collect();
        let what = format!("there is no motor `{name}`; there are {}", names.join(", "));
        UnknownMotorException { what }
    })
}

fn refused(what: String) -> HardwareFailedException {
    HardwareFailedException { what }
}

fn motor_params(limits: &MotorsParams) -> MotorParams {
    MotorParams {
        name: limits.name.clone(),
        bus_id: u8::try_from(limits.id).unwrap_or(u8::MAX),
        min_pos: limits.min,
        max_pos: limits.max,
        max_velocity: limits.max_speed,
        zero_pos: limits.zero,
        steps_range: limits.steps as f32,
        max_degrees: (limits.max - limits.min).to_degrees(),
        inverted_sign: limits.inverted,
    }
}

impl SpecificWorker {
    /// A simulated motor takes no power and has no temperature.
    fn state(&self, ctx: &Context, index: usize) -> MotorState {
        let motor = &self.motors[index];
        let (p, v) = motor.steps(&ctx.params.motors[index]);
        MotorState {
            pos: motor.position,
            vel: motor.velocity,
            time_stamp: self.time_stamp.clone(),
            p,
            v,
            is_moving: motor.is_moving(),
            ..MotorState::default()
        }
    }

    /// All goals, or none of them.
    fn set(&mut self, goals: &[(usize, Goal)]) {
        for (index, goal) in goals {
            self.motors[*index].goal = *goal;
        }
    }
}

impl JointMotor<Context> for SpecificWorker {
    fn set_position(
        &mut self,
        ctx: &mut Context,
        goal: MotorGoalPosition,
    ) -> Result<(), SetPositionError> {
        let index = find(ctx, &goal.name)?;
        let limits = &ctx.params.motors[index];
        let goal = Goal::position(limits, goal.position, goal.max_speed).map_err(refused)?;
        self.set(&[(index, goal)]);
        Ok(())
    }

    fn set_velocity(
        &mut self,
        ctx: &mut Context,
        goal: MotorGoalVelocity,
    ) -> Result<(), SetVelocityError> {
        let index = find(ctx, &goal.name)?;
        let limits = &ctx.params.motors[index];
        let goal = Goal::velocity(limits, goal.velocity, goal.max_acc).map_err(refused)?;
        self.set(&[(index, goal)]);
        Ok(())
    }

    fn set_zero_pos(&mut self, ctx: &mut Context, name: String) -> Result<(), SetZeroPosError> {
        let index = find(ctx, &name)?;
        self.set(&[(index, Goal::zero(&ctx.params.motors[index]))]);
        Ok(())
    }

    fn set_sync_position(
        &mut self,
        ctx: &mut Context,
        list_goals: MotorGoalPositionList,
    ) -> Result<(), SetSyncPositionError> {
        let mut goals = Vec::with_capacity(list_goals.len());
        for goal in &list_goals {
            let index = find(ctx, &goal.name)?;
            let limits = &ctx.params.motors[index];
            let goal = Goal::position(limits, goal.position, goal.max_speed).map_err(refused)?;
            goals.push((index, goal));
        }
        self.set(&goals);
        Ok(())
    }

    fn set_sync_velocity(
        &mut self,
        ctx: &mut Context,
        list_goals: MotorGoalVelocityList,
    ) -> Result<(), SetSyncVelocityError> {
        let mut goals = Vec::with_capacity(list_goals.len());
        for goal in &list_goals {
            let index = find(ctx, &goal.name)?;
            let limits = &ctx.params.motors[index];
            let goal = Goal::velocity(limits, goal.velocity, goal.max_acc).map_err(refused)?;
            goals.push((index, goal));
        }
        self.set(&goals);
        Ok(())
    }

    fn set_sync_zero_pos(&mut self, ctx: &mut Context) -> Result<(), SetSyncZeroPosError> {
        let goals = ctx.params.motors.iter().map(Goal::zero).enumerate();
        self.set(&goals.collect::<Vec<_>>());
        Ok(())
    }

    fn get_motor_params(
        &mut self,
        ctx: &mut Context,
        motor: String,
    ) -> Result<MotorParams, GetMotorParamsError> {
        let index = find(ctx, &motor)?;
        Ok(motor_params(&ctx.params.motors[index]))
    }

    fn get_motor_state(
        &mut self,
        ctx: &mut Context,
        motor: String,
    ) -> Result<MotorState, GetMotorStateError> {
        let index = find(ctx, &motor)?;
        Ok(self.state(ctx, index))
    }

    fn get_motor_state_map(
        &mut self,
        ctx: &mut Context,
        m_list: MotorList,
    ) -> Result<MotorStateMap, GetMotorStateMapError> {
        let mut states = MotorStateMap::new();
        for name in m_list {
            let index = find(ctx, &name)?;
            states.insert(name, self.state(ctx, index));
        }
        Ok(states)
    }

    fn get_all_motor_state(
        &mut self,
        ctx: &mut Context,
    ) -> Result<MotorStateMap, GetAllMotorStateError> {
        let motors = ctx.params.motors.iter().enumerate();
        let state =
            |(index, limits): (usize, &MotorsParams)| (limits.name.clone(), self.state(ctx, index));
        Ok(motors.map(state).collect())
    }

    fn get_all_motor_params(&mut self, ctx: &mut Context) -> MotorParamsList {
        ctx.params.motors.iter().map(motor_params).collect()
    }

    fn get_bus_params(&mut self, ctx: &mut Context) -> BusParams {
        BusParams {
            handler: "simulator".to_owned(),
            device: ctx.params.device.clone(),
            num_motors: self.motors.len() as i32,
            baud_rate: ctx.params.baud_rate,
            basic_period: ctx.period().as_millis() as i32,
        }
    }
}
