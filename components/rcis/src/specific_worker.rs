//! The worker: it lets the world of a scene step, and its slots serve the devices.

use crate::follow::Following;
use crate::manager::Scene;
use crate::predictions::Predictions;
use crate::scene;
use crate::steps::{Steps, pace};
use crate::warnings::Warnings;
use crate::window;
use crate::worlds::Worlds;
use inner_model_manager::Manager;
use innermodel_physics::Physics;
use innermodel_simulation::World;
use rcis_generated::innermodel_viewer::Actions;
use rcis_generated::tracing::{info, warn};
use rcis_generated::{Context, ParamChange, Worker, WorkerError};
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

/// The simulator.
pub struct SpecificWorker {
    pub(crate) worlds: Worlds,
    pub(crate) following: Following,
    pub(crate) steps: Steps,
    pub(crate) predictions: Predictions,
    pub(crate) warnings: Warnings,
    /// The file of the scene, in whose folder clients find meshes.
    pub(crate) scene: PathBuf,
    /// Robots whose bumpers are disabled.
    pub(crate) disabled: HashSet<String>,
    /// Yaws that inertial sensors had when they were reset.
    pub(crate) yaws: HashMap<String, f64>,
    /// Whether `InnerModelManager` puts no bodies into each other.
    refuses_collisions: bool,
    /// The requests of the window's user.
    actions: Actions,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let params = &ctx.params;
        let (seed, step) = (params.seed.cast_unsigned(), params.step);
        let world = World::new(Arc::clone(&ctx.tree), step, seed);
        let mut world = world.map_err(|error| WorkerError::Fatal(error.to_string()))?;
        if params.physics {
            world.set_dynamics(Some(Box::new(Physics::new())));
        }
        for problem in world.problems() {
            warn!("{problem}");
        }
        scene::open(ctx, &world)?;
        info!(
            "{}: {} nodes, {} devices",
            ctx.params.inner_model.display(),
            world.tree().len(),
            world.devices().len()
        );
        pace(ctx);
        let scene = &ctx.params.inner_model;
        Ok(Self {
            worlds: Worlds::new(world),
            following: Following::default(),
            steps: Steps::new(ctx.params.paused),
            predictions: Predictions::default(),
            warnings: Warnings::default(),
            scene: std::path::absolute(scene).unwrap_or_else(|_| scene.clone()),
            disabled: HashSet::new(),
            yaws: HashMap::new(),
            refuses_collisions: ctx.params.refuse_collisions,
            actions: ctx.viewer.actions(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        window::obey(&self.actions, &mut self.worlds.main, &mut self.warnings);
        self.steps.run(ctx, &mut self.worlds.main)?;
        for problem in self.worlds.problems() {
            self.warnings.log(problem);
        }
        Ok(())
    }

    fn params_changed(
        &mut self,
        ctx: &mut Context,
        changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        if changes.iter().any(|change| change.path == "paused") {
            self.steps.paused = ctx.params.paused;
        }
        self.refuses_collisions = ctx.params.refuse_collisions;
        pace(ctx);
        Ok(())
    }
}

impl SpecificWorker {
    /// The handlers of the interface `InnerModelManager`.
    pub fn manager(&mut self) -> Manager<Scene<'_>> {
        Manager(Scene {
            world: &mut self.worlds.main,
            file: &self.scene,
            refuses_collisions: self.refuses_collisions,
        })
    }
}
