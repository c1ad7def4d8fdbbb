//! Asks components like itself, and goes on while they answer.

use asker_generated::tracing::info;
use asker_generated::{
    Call, CallId, Context, Far, FarOtherDone, FarSlot, GetBatteryStateError, Near, OtherDone,
    TBattery, Worker, WorkerError,
};

type Asking = Call<TBattery, GetBatteryStateError>;

#[derive(Default)]
pub struct SpecificWorker {
    near: Option<Asking>,
    far: Option<Asking>,
    /// How many calls of each slot have brought a reply.
    near_replies: i32,
    far_replies: i32,
}

impl SpecificWorker {
    fn report(&self, ctx: &Context) {
        let rounds = ctx.params.rounds;
        if self.near_replies == rounds && self.far_replies == rounds {
            let ms = ctx.now().as_nanos() / 1_000_000;
            info!("both others have answered {rounds} times by {ms} ms");
        }
    }
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let rounds = ctx.params.rounds;
        if let Some(result) = self.far.as_ref().and_then(|call| ctx.far_other.take(call)) {
            self.far = None;
            self.far_replies += i32::from(result.is_ok());
            self.report(ctx);
        }
        if self.near.is_none() && self.near_replies < rounds && ctx.other.is_connected() {
            self.near = Some(ctx.other.start_get_battery_state()?);
        }
        if self.far.is_none() && self.far_replies < rounds && ctx.far_other.is_connected() {
            self.far = Some(ctx.far_other.start_get_battery_state()?);
        }
        Ok(())
    }
}

impl OtherDone for SpecificWorker {
    fn get_battery_state_done(
        &mut self,
        ctx: &mut Context,
        call: CallId,
        result: Result<TBattery, GetBatteryStateError>,
    ) {
        if self.near.take_if(|near| near.id() == call).is_some() {
            self.near_replies += i32::from(result.is_ok());
            self.report(ctx);
        }
    }
}

/// Its results wait for `compute`.
impl FarOtherDone for SpecificWorker {}

fn battery(ctx: &Context) -> TBattery {
    TBattery {
        percentage: ctx.params.level,
        ..TBattery::default()
    }
}

impl Near<Context> for SpecificWorker {
    fn get_battery_state(&mut self, ctx: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        Ok(battery(ctx))
    }
}

impl Far<Context, FarSlot> for SpecificWorker {
    fn get_battery_state(&mut self, ctx: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        Ok(battery(ctx))
    }
}
