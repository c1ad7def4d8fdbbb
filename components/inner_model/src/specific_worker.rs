//! Loads the tree, publishes what changes, and follows another instance.

use crate::world::World;
use inner_model_generated::tracing::{info, warn};
use inner_model_generated::{Changes, Context, Leader, ParamChange, Worker, WorkerError};
use rc_diagnostics::foreign::clean;
use std::time::Duration;

/// After so long without a change, the whole tree is published, so that the newest sample has it.
const PAUSE: Duration = Duration::from_millis(500);

/// The tree, and when it was last published.
pub struct SpecificWorker {
    pub(crate) world: World,
    published: Duration,
}

/// The time of the component's clock, since its zero.
pub(crate) fn now(ctx: &Context) -> Duration {
    Duration::from_nanos(ctx.now().as_nanos())
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        // Two components of one network have different names; of two runs of one component, the
        // later one has the greater time.
        let writer = format!("{}@{:020}", ctx.name(), ctx.now().as_nanos());
        let loaded = World::load(&writer, &ctx.params);
        let (world, warnings) = loaded.map_err(|error| WorkerError::Fatal(error.to_string()))?;
        for warning in warnings.lines() {
            warn!("{warning}");
        }
        let nodes = world.tree().len();
        info!("{}: {nodes} nodes", ctx.params.file.display());
        Ok(Self {
            world,
            published: now(ctx),
        })
    }

    /// Publishes what changed since the last period.
    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        for problem in self.world.problems() {
            warn!("{problem}");
        }
        let time = now(ctx);
        let replica = &mut self.world.replica;
        let pauses = replica.lacks_whole() && time.saturating_sub(self.published) >= PAUSE;
        if replica.is_unsent() || pauses {
            let sample = replica.sample(&self.world.model.snapshot(), pauses);
            ctx.inner_model_pub.changed(&sample)?;
            replica.sent(&sample);
            self.published = time;
        }
        Ok(())
    }

    fn params_changed(
        &mut self,
        ctx: &mut Context,
        _changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        self.world.set(&ctx.params);
        Ok(())
    }
}

impl Leader<Context> for SpecificWorker {
    /// Takes what changed in another instance.
    fn changed(&mut self, ctx: &mut Context, changes: Changes) {
        let World {
            model,
            replica,
            place,
            folders,
            ..
        } = &mut self.world;
        for problem in replica.apply(model, now(ctx), &changes, place, folders) {
            warn!(
                "a change of `{}` cannot be taken: {problem}",
                clean(&changes.writer)
            );
        }
        self.world.model.forget_points();
    }
}
