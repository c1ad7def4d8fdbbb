//! Publishes the time of the network.

use clock_generated::network_time::{Order, Time};
use clock_generated::{Context, ParamChange, Worker, WorkerError};
use std::time::Duration;

/// The shortest period of a component.
const SHORTEST: Duration = Duration::from_micros(100);
/// The period while nothing sets the pace.
const IDLE: Duration = Duration::from_millis(10);

/// Advances time by a step in each `compute()`.
pub struct SpecificWorker;

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        if !ctx.time.is_active() {
            return Err(WorkerError::Fatal(
                "the network has another clock; write `time simulated by NAME;` in its .ddsl"
                    .to_owned(),
            ));
        }
        pace(ctx);
        Ok(Self)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        // While a follower is missing, the runtime goes on waiting.
        if !ctx.params.paused && !is_over(ctx) && ctx.time.missing().is_empty() {
            ctx.time.advance(ctx.params.step)?;
        }
        Ok(())
    }

    fn params_changed(
        &mut self,
        ctx: &mut Context,
        _changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        pace(ctx);
        Ok(())
    }
}

/// Whether the last tick of the run is over.
fn is_over(ctx: &Context) -> bool {
    let end = ctx.params.end;
    !end.is_zero() && ctx.now() - Time::ZERO >= end
}

/// Sets how fast time passes, and for whom it waits.
fn pace(ctx: &mut Context) {
    let params = &ctx.params;
    let period = if params.rate > 0.0 {
        params.step.div_f64(params.rate).max(SHORTEST)
    } else {
        IDLE
    };
    let order = if params.at_once {
        Order::AtOnce
    } else {
        Order::InTurn
    };
    ctx.time.set_paced(params.rate > 0.0);
    ctx.time.set_order(order);
    if params.wait {
        ctx.time.wait_for_all(params.limit);
    } else {
        ctx.time.wait_for_nobody();
    }
    ctx.set_period(period);
}
