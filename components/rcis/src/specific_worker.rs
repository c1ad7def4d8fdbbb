//! Lets the world of a scene step, and publishes where its bases are.

use crate::predictions::Unfinished;
use crate::scene;
use crate::worlds::Worlds;
use innermodel_physics::Physics;
use innermodel_simulation::World;
use rcis_generated::innermodel_viewer::Actions;
use rcis_generated::network_time::Order;
use rcis_generated::tracing::{info, warn};
use rcis_generated::{Context, ParamChange, Worker, WorkerError};
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The shortest and the longest period.
const SHORTEST: Duration = Duration::from_micros(100);
const LONGEST: Duration = Duration::from_secs(60);
/// How long one `compute()` makes steps where nothing sets the pace.
const BURST: Duration = Duration::from_millis(5);
/// How many different warnings are logged once.
const MOST_LOGGED: usize = 1000;

/// The simulator.
pub struct SpecificWorker {
    pub(crate) world: World,
    pub(crate) worlds: Worlds,
    /// The file of the scene, in whose folder clients find meshes.
    pub(crate) scene: PathBuf,
    /// Robots whose bumpers are disabled.
    pub(crate) disabled: HashSet<String>,
    /// Yaws that inertial sensors had when they were reset.
    pub(crate) yaws: std::collections::HashMap<String, f64>,
    /// Steps that were asked for and are not made yet.
    pub(crate) pending: u64,
    pub(crate) paused: bool,
    /// The prediction that was asked for last, if it is not over.
    pub(crate) predicting: Option<Unfinished>,
    /// Whether `InnerModelManager` puts no bodies into each other.
    pub(crate) refuses_collisions: bool,
    /// What the user of the window wants.
    pub(crate) actions: Actions,
    /// The number of the period in which the last pose was published, in simulated time.
    published: Option<u128>,
    /// Warnings that were logged.
    logged: HashSet<String>,
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
            world,
            worlds: Worlds::default(),
            scene: std::path::absolute(scene).unwrap_or_else(|_| scene.clone()),
            disabled: HashSet::new(),
            yaws: std::collections::HashMap::new(),
            pending: 0,
            paused: ctx.params.paused,
            predicting: None,
            refuses_collisions: ctx.params.refuse_collisions,
            actions: ctx.viewer.actions(),
            published: None,
            logged: HashSet::new(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.obey_window();
        // While a follower is missing, the runtime goes on waiting.
        if !ctx.time.missing().is_empty() {
            return Ok(());
        }
        let started = Instant::now();
        // A period cannot be shorter than the shortest one: then it has several steps.
        let mut rest = steps_of_period(ctx);
        while self.pending > 0 || !self.paused {
            self.pending = self.pending.saturating_sub(1);
            self.step(ctx)?;
            rest = rest.saturating_sub(1);
            let waits = ctx.time.is_active() && ctx.params.wait;
            if waits || started.elapsed() > BURST {
                break;
            }
            if rest == 0 && self.pending == 0 {
                break;
            }
        }
        self.report();
        Ok(())
    }

    fn params_changed(
        &mut self,
        ctx: &mut Context,
        changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        if changes.iter().any(|change| change.path == "paused") {
            self.paused = ctx.params.paused;
        }
        self.refuses_collisions = ctx.params.refuse_collisions;
        pace(ctx);
        Ok(())
    }
}

/// Sets how fast time passes, and for whom it waits.
fn pace(ctx: &mut Context) {
    let params = &ctx.params;
    let (step, rate, wait, limit) = (params.step, params.rate, params.wait, params.limit);
    let period = if rate > 0.0 {
        let period = Duration::try_from_secs_f64(step.as_secs_f64() / rate);
        period.unwrap_or(LONGEST).clamp(SHORTEST, LONGEST)
    } else {
        SHORTEST
    };
    ctx.time.set_paced(rate > 0.0);
    ctx.time.set_order(Order::InTurn);
    if wait {
        ctx.time.wait_for_all(limit);
    } else {
        ctx.time.wait_for_nobody();
    }
    ctx.set_period(period);
}

/// How many steps of a world that nobody waits for belong to one period.
fn steps_of_period(ctx: &Context) -> u64 {
    let (step, rate) = (ctx.params.step.as_secs_f64(), ctx.params.rate);
    if rate == 0.0 {
        return if ctx.time.is_active() { 1 } else { u64::MAX };
    }
    let steps = SHORTEST.as_secs_f64() * rate / step;
    // From 0 to 10,000.
    (steps.round() as u64).max(1)
}

impl SpecificWorker {
    /// Logs what the worlds could not do.
    fn report(&mut self) {
        let clones = self.worlds.clones.values_mut();
        let mut problems: Vec<String> = clones.flat_map(World::problems).collect();
        problems.extend(self.world.problems());
        for problem in problems {
            self.warn_once(problem);
        }
    }

    /// Makes one step, which the network hears of if it takes its time from here.
    pub(crate) fn step(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.world.step()?;
        if ctx.time.is_active() {
            ctx.time.advance(self.world.step_time())?;
        }
        let now = self.world.time();
        // The number of the period, so that a step which is longer or shorter adds nothing.
        let period = ctx.params.pose_period.as_nanos().max(1);
        let number = now.as_nanos() / period;
        if self.published != Some(number) {
            self.published = Some(number);
            for at in 0..ctx.pose_topics.len() {
                let name = ctx.pose_topics.members()[at].name().to_owned();
                if let Ok(pose) = self.full_pose(&name) {
                    ctx.pose_topics[at].new_full_pose(&pose)?;
                }
            }
        }
        Ok(())
    }

    /// Logs a warning, the first time it comes.
    pub(crate) fn warn_once(&mut self, text: String) {
        if self.logged.len() < MOST_LOGGED && !self.logged.contains(&text) {
            warn!("{text}");
            self.logged.insert(text);
        }
    }

    /// A result for an interface that has no exception for it: the default, and a warning.
    pub(crate) fn or_default<T: Default>(
        &mut self,
        result: Result<T, innermodel_simulation::Error>,
    ) -> T {
        result.unwrap_or_else(|error| {
            self.warn_once(error.to_string());
            T::default()
        })
    }
}
