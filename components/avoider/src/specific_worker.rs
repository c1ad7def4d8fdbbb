//! The behaviour of the robot in the states of `avoider.scxml`: one scan and one motion in every
//! period of `driving`.

use crate::policy::{Measure, Motion, Settings, Side, cruise, is_clear, is_clear_again};
use avoider_generated::machine::MachineEvent;
use avoider_generated::network_time::Time;
use avoider_generated::{Context, StateMachine, Worker, WorkerError};
use std::time::Duration;

/// Below this percentage, the robot stops and charges; from the other one on, it drives again.
const LOW: f32 = 20.0;
const FULL: f32 = 80.0;
/// How often the battery is read.
const BATTERY_PERIOD: Duration = Duration::from_secs(1);

/// Data that the states share.
#[derive(Default)]
pub struct SpecificWorker {
    /// The scan of this period.
    scan: Vec<Measure>,
    /// The side to which it turns.
    side: Option<Side>,
    /// When it looked at the battery.
    looked: Option<Time>,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }
}

impl StateMachine for SpecificWorker {
    /// The robot drives from the start on.
    fn entry_motion(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        ctx.machine.fire(MachineEvent::Go);
        Ok(())
    }

    fn during_idle(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        stand(ctx)
    }

    fn during_charging(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        stand(ctx)
    }

    /// Runs before the function of the state inside.
    fn during_driving(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if ctx.params.lockstep {
            // Two interfaces are two queues: a server that is late may serve the scan before the
            // motion that was sent earlier. One answers in the order in which it was asked, so that
            // an answer of the base says it is done.
            ctx.differential_robot.get_base_state()?;
        }
        let data = ctx.laser.get_laser_data()?;
        let measures = data.iter().map(|data| Measure {
            angle: data.angle,
            distance: data.dist,
        });
        self.scan = measures.collect();
        Ok(())
    }

    fn exit_driving(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        ctx.differential_robot.stop_base()?;
        Ok(())
    }

    fn during_cruising(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let settings = settings(ctx);
        if is_clear(&self.scan, &settings) {
            return drive(ctx, cruise(&self.scan, &settings));
        }
        ctx.machine.fire(MachineEvent::Obstacle);
        self.turn(ctx)
    }

    fn during_turning(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let settings = settings(ctx);
        if !is_clear_again(&self.scan, &settings) {
            return self.turn(ctx);
        }
        ctx.machine.fire(MachineEvent::Clear);
        drive(ctx, cruise(&self.scan, &settings))
    }

    fn exit_turning(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        self.side = None;
        Ok(())
    }

    fn during_blocked(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if is_clear_again(&self.scan, &settings(ctx)) {
            ctx.machine.fire(MachineEvent::Clear);
        }
        drive(ctx, Motion::default())
    }

    fn during_battery(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let now = ctx.now();
        let is_early = |looked: Time| now >= looked && now - looked < BATTERY_PERIOD;
        if self.looked.is_some_and(is_early) || !ctx.battery_status.is_connected() {
            return Ok(());
        }
        self.looked = Some(now);
        let battery = ctx.battery_status.get_battery_state()?;
        if battery.percentage < LOW {
            ctx.machine.fire(MachineEvent::BatteryLow);
        } else if battery.percentage >= FULL {
            ctx.machine.fire(MachineEvent::BatteryFull);
        }
        Ok(())
    }
}

impl SpecificWorker {
    /// Turns on the spot, always to the same side.
    fn turn(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if self.scan.is_empty() {
            return drive(ctx, Motion::default());
        }
        let side = *self.side.get_or_insert_with(|| Side::freer(&self.scan));
        drive(ctx, side.turn(&settings(ctx)))
    }
}

/// In lockstep, the time of the simulator passes with each motion.
fn stand(ctx: &mut Context) -> Result<(), WorkerError> {
    if ctx.params.lockstep {
        drive(ctx, Motion::default())?;
    }
    Ok(())
}

fn drive(ctx: &mut Context, motion: Motion) -> Result<(), WorkerError> {
    let base = &mut ctx.differential_robot;
    base.set_speed_base(motion.advance, motion.turn)?;
    Ok(())
}

fn settings(ctx: &Context) -> Settings {
    Settings {
        safe_distance: ctx.params.safe_distance,
        speed: ctx.params.speed,
        turn_speed: ctx.params.turn_speed,
    }
}
