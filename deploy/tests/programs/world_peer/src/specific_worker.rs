//! Changes two elements at once, and asks another component what it reads of them.

use std::time::Duration;
use world_peer_generated::tracing::{error, info};
use world_peer_generated::world::View;
use world_peer_generated::{
    Context, DataenableSynchronizationin, Dataresponse, Datasayin, Reads, Worker, WorkerError,
    WorldHandlers,
};

/// How long a question waits for the change that it names.
const PATIENCE: Duration = Duration::from_secs(5);
/// How many questions a run of `compute` asks, so that the event loop turns meanwhile.
const AT_ONCE: i32 = 50;

pub struct SpecificWorker {
    /// How often it has asked.
    asked: i32,
    wrong: i32,
}

/// What one version has: both numbers are set by each change.
fn read(world: &View) -> Option<(f64, f64)> {
    let width = world.door("front").ok()?.width()?;
    let length = world.room("kitchen").ok()?.length()?;
    Some((width, length))
}

impl SpecificWorker {
    /// Makes a change, and asks the other one what it reads with its token.
    fn ask(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.asked += 1;
        let value = f64::from(self.asked);
        let is_new = ctx.g.snapshot().door("front").is_err();
        let token = ctx.g.change(|edit| {
            if is_new {
                edit.add_door("front")?;
                edit.add_room("kitchen")?;
            }
            edit.door("front")?.set_width(value)?;
            edit.room("kitchen")?.set_length(value)
        })?;
        let question = Datasayin {
            text: token.to_string(),
            overwrite: false,
        };
        let answer = ctx.other.say(&question)?;
        if !answer.result || answer.reason != format!("{value} {value}") {
            self.wrong += 1;
            error!("change {value} was read as `{}`", answer.reason);
        }
        Ok(())
    }
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self { asked: 0, wrong: 0 })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let rounds = ctx.params.rounds;
        if self.asked >= rounds || !ctx.other.is_connected() || !ctx.g.has_joined() {
            return Ok(());
        }
        for _ in 0..AT_ONCE.min(rounds - self.asked) {
            self.ask(ctx)?;
        }
        if self.asked == rounds {
            info!("{rounds} changes were read, {} of them wrongly", self.wrong);
        }
        Ok(())
    }
}

impl Reads<Context> for SpecificWorker {
    /// Waits for the change that a token names. The answer is whether it came, and what is read then.
    fn say(&mut self, ctx: &mut Context, request: Datasayin) -> Dataresponse {
        let token = request.text.parse();
        let came = token.is_ok_and(|token| ctx.g.wait_for(token, PATIENCE));
        let found = read(&ctx.g.snapshot());
        Dataresponse {
            result: came,
            reason: found.map_or_else(String::new, |(width, length)| format!("{width} {length}")),
        }
    }

    fn is_busy(&mut self, _ctx: &mut Context) -> Dataresponse {
        Dataresponse::default()
    }

    fn enable_synchronization(
        &mut self,
        _ctx: &mut Context,
        _request: DataenableSynchronizationin,
    ) {
    }
}

impl WorldHandlers for SpecificWorker {}
