//! Loads the tree, and keeps it, the world and the scenes of simulators equal.

use crate::front;
use crate::simulators::Simulators;
use crate::world::World;
use inner_model_generated::tracing::{info, warn};
use inner_model_generated::{Context, ParamChange, Worker, WorkerError, WorldHandlers};
use std::sync::Arc;
use std::time::Duration;

/// Longest wait for the tree of other instances.
const JOINING: Duration = Duration::from_secs(4);

/// The tree.
pub struct SpecificWorker {
    pub(crate) world: World,
    simulators: Simulators,
}

/// The time of the component's clock, since its zero.
pub(crate) fn now(ctx: &Context) -> Duration {
    Duration::from_nanos(ctx.now().as_nanos())
}

impl Worker<Context> for SpecificWorker {
    /// The tree of the file is the initial content of the world. Components with the same file start the
    /// same world.
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let fatal = |error: &dyn std::fmt::Display| WorkerError::Fatal(error.to_string());
        let loaded = World::load(&ctx.params);
        let (mut world, warnings) = loaded.map_err(|error| fatal(&error))?;
        for warning in warnings.lines() {
            warn!("{warning}");
        }
        let tree = world.tree();
        if !ctx.params.file.as_os_str().is_empty() {
            let schema = Arc::clone(ctx.g.snapshot().schema());
            let start = front::start(&tree, &schema).map_err(|error| fatal(&error))?;
            ctx.g.start_with(&start).map_err(|error| fatal(&error))?;
            world.front.started(&start);
        } else {
            // Requests that come as soon as it is ready find the tree.
            ctx.g.wait_for_others(JOINING);
        }
        let simulators = Simulators::open(ctx)?;
        let mut worker = Self { world, simulators };
        worker.meet(ctx);
        let count = worker.world.tree().len();
        info!("{}: {count} nodes", ctx.params.file.display());
        Ok(worker)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        for problem in self.world.problems() {
            warn!("{problem}");
        }
        self.meet(ctx);
        // The scene of a simulator loses what the world does not have, or does not have yet.
        if ctx.g.has_joined() {
            let tree = self.world.tree();
            self.simulators.tell(ctx, now(ctx), &tree);
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

impl SpecificWorker {
    /// Gives the world what has changed in the tree, and the tree what has changed in the world.
    fn meet(&mut self, ctx: &mut Context) {
        let time = now(ctx);
        let World {
            model,
            front,
            place,
            folders,
            ..
        } = &mut self.world;
        let told = front.tell(model, time, |write| {
            let (made, _) = ctx.g.change_with(|edit| Ok(write(edit)?))?;
            Ok::<_, rc_world::Error>((made, ctx.g.snapshot().0.0.clone()))
        });
        if let Err(error) = told {
            warn!("the changes since the last period are undone: {error}");
        }
        let world = ctx.g.snapshot();
        for problem in front.follow(&world.0.0, model, time, (place, folders)) {
            warn!("the tree does not have all of the world: {problem}");
        }
        model.forget_points();
    }
}

/// What others change is in the tree after the next period, however often they do.
impl WorldHandlers for SpecificWorker {}
