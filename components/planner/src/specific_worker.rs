//! Plans on clones of the simulated world, and follows the best plan.

use crate::motions::{Motion, arcs, on_the_spot};
use planner_generated::tracing::{info, warn};
use planner_generated::{Context, Worker, WorkerError};
use std::time::{Duration, Instant};

/// The clone on which motions are tried.
const TRIAL: &str = "planner_trial";
/// The clone that does what the robot should do.
const EXPECTED: &str = "planner_expected";
/// The world that all sensors see.
const REAL: &str = "";
/// The part of its first motion after which a plan is replaced by the next one.
const FOLLOWED: f64 = 0.4;
/// How often one trial may be stepped further; each request works for at most 5 s.
const MOST_REQUESTS: u32 = 10;

/// State of the planner since it started.
#[derive(Default)]
pub struct SpecificWorker {
    /// Steps that the world will have made when the current plan is over.
    until: Option<i64>,
    plans: u32,
    surprises: u32,
    /// Simulated time that all trials took together, and how long the computer needed for it.
    imagined: Duration,
    needed: Duration,
    is_done: bool,
}

impl Worker for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if self.is_done {
            return Ok(());
        }
        if distance(place(ctx, REAL)?, goal(ctx)) <= ctx.params.tolerance {
            drive(ctx, REAL, Motion::default())?;
            remove(ctx, EXPECTED)?;
            self.is_done = true;
            let (imagined, needed) = (self.imagined.as_secs_f64(), self.needed.as_secs_f64());
            info!(
                "at the goal: {} plans, {} surprises, imagined {imagined:.1} s in {needed:.1} s",
                self.plans, self.surprises
            );
            return Ok(());
        }
        if let Some(until) = self.until {
            let surprised = is_elsewhere(ctx)?;
            if surprised {
                self.surprises += 1;
                info!("the robot is not where it was expected: a new plan");
            } else if ctx.simulation.get_clock(REAL)?.steps < until {
                return Ok(());
            }
        }
        self.follow(ctx)
    }

    fn finalize(&mut self, ctx: &mut Context) {
        let stopped = drive(ctx, REAL, Motion::default());
        if let Err(error) = stopped.and_then(|()| remove(ctx, EXPECTED)) {
            warn!("the robot is not stopped, or a clone is left: {error}");
        }
    }
}

impl SpecificWorker {
    /// Makes a plan and starts it, in the world and in a clone that says what is expected.
    fn follow(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.plans += 1;
        let before = (ctx.simulation.get_clock(REAL)?, digest(ctx)?);
        let started = Instant::now();
        let best = self.best(ctx)?;
        self.needed += started.elapsed();
        let after = (ctx.simulation.get_clock(REAL)?, digest(ctx)?);
        // In a network whose time waits for the planner, no step can be in between.
        if before.0.steps == after.0.steps && before.1 != after.1 {
            return Err(WorkerError::Fatal(
                "a trial on a clone changed the world".to_owned(),
            ));
        }
        if best.is_none() {
            warn!("each motion ends at an obstacle; the robot waits");
        }
        drive(ctx, REAL, best.unwrap_or_default())?;
        clone(ctx, EXPECTED)?;
        let clock = ctx.simulation.get_clock(EXPECTED)?;
        let length = ctx.params.part.mul_f64(FOLLOWED);
        self.until = Some(clock.steps + steps(length, clock.step));
        Ok(())
    }

    /// The first part of the motion that comes nearest to the goal in two parts, without a contact.
    /// Clones do the first parts; each of them predicts how it may go on.
    fn best(&mut self, ctx: &mut Context) -> Result<Option<Motion>, WorkerError> {
        let (part, goal) = (ctx.params.part, goal(ctx));
        let turns = u32::try_from(ctx.params.turns).unwrap_or(1);
        // So slow that it does not drive beyond the goal.
        let far = distance(place(ctx, REAL)?, goal);
        let advance = ctx.params.speed.min(far / part.as_secs_f64());
        let mut best: Option<(f64, Motion)> = None;
        for first in arcs(advance, turns).chain(on_the_spot()) {
            if predict(ctx, REAL, first)?.is_none() {
                continue;
            }
            self.imagined += part;
            clone(ctx, TRIAL)?;
            drive(ctx, TRIAL, first)?;
            run(ctx, TRIAL, part)?;
            let mut nearest = distance(place(ctx, TRIAL)?, goal);
            for second in arcs(advance, turns) {
                self.imagined += part;
                if let Some(end) = predict(ctx, TRIAL, second)? {
                    nearest = nearest.min(distance(end, goal));
                }
            }
            if best.is_none_or(|(least, _)| nearest < least) {
                best = Some((nearest, first));
            }
        }
        remove(ctx, TRIAL)?;
        Ok(best.map(|(_, motion)| motion))
    }
}

/// Lets the expected world catch up with the real one. Returns whether the robots are apart.
fn is_elsewhere(ctx: &mut Context) -> Result<bool, WorkerError> {
    let real = ctx.simulation.get_clock(REAL)?;
    let expected = ctx.simulation.get_clock(EXPECTED)?;
    let is = place(ctx, REAL)?;
    let behind = (real.steps - expected.steps).max(0);
    let step = Duration::from_nanos(real.step.unsigned_abs());
    run(
        ctx,
        EXPECTED,
        step * u32::try_from(behind).unwrap_or(u32::MAX),
    )?;
    Ok(distance(is, place(ctx, EXPECTED)?) > ctx.params.bound)
}

/// Replaces a clone by the world as it is now.
fn clone(ctx: &mut Context, name: &str) -> Result<(), WorkerError> {
    remove(ctx, name)?;
    ctx.simulation.clone(REAL, name)?;
    Ok(())
}

/// Removes a clone, which may be one that an earlier process of this component left.
fn remove(ctx: &mut Context, name: &str) -> Result<(), WorkerError> {
    if ctx.simulation.get_clones()?.iter().any(|it| it == name) {
        ctx.simulation.remove_clone(name)?;
    }
    Ok(())
}

fn drive(ctx: &mut Context, world: &str, motion: Motion) -> Result<(), WorkerError> {
    let Motion { advance, turn } = motion;
    ctx.simulation
        .drive(world, &ctx.params.base, 0.0, advance, turn)?;
    Ok(())
}

/// Makes the steps of a time in a clone.
fn run(ctx: &mut Context, clone: &str, time: Duration) -> Result<(), WorkerError> {
    let mut count = steps(time, ctx.simulation.get_clock(clone)?.step);
    for _ in 0..MOST_REQUESTS {
        if count == 0 {
            return Ok(());
        }
        count = ctx.simulation.step(clone, count)?.pending;
    }
    Err(WorkerError::Failed(format!(
        "{count} steps of `{clone}` are left; the computer is too slow for this scene"
    )))
}

/// Where the robot is after a motion of one part, or nothing if something stops it.
fn predict(
    ctx: &mut Context,
    world: &str,
    motion: Motion,
) -> Result<Option<[f64; 2]>, WorkerError> {
    let Motion { advance, turn } = motion;
    let (base, time) = (&ctx.params.base, ctx.params.part.as_secs_f64());
    let found = ctx
        .simulation
        .predict(world, base, 0.0, advance, turn, time)?;
    let free = found.collision.is_none();
    Ok(free.then_some([found.pose.x, found.pose.z]))
}

/// The place of the robot on the floor, in mm of the root.
fn place(ctx: &mut Context, world: &str) -> Result<[f64; 2], WorkerError> {
    let pose = ctx.simulation.get_pose(world, &ctx.params.base, "root")?;
    Ok([pose.x, pose.z])
}

fn digest(ctx: &mut Context) -> Result<i64, WorkerError> {
    Ok(ctx.simulation.get_digest(REAL)?)
}

fn goal(ctx: &Context) -> [f64; 2] {
    [ctx.params.x, ctx.params.z]
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// How many steps of `step` nanoseconds a time has.
fn steps(time: Duration, step: i64) -> i64 {
    let count = time.as_nanos() / u128::from(step.unsigned_abs()).max(1);
    i64::try_from(count).unwrap_or(i64::MAX)
}
