//! Plans on clones of the simulated world, and follows the best plan.

use crate::motions::Motion;
use crate::search::Search;
use crate::worlds::{
    EXPECTED, REAL, START, TRIAL, clone, distance, drive, place, remove, run, steps,
};
use planner_generated::tracing::{info, warn};
use planner_generated::{Context, Worker, WorkerError};
use std::time::{Duration, Instant};

/// The part of its first motion after which a plan is replaced by the next one.
const FOLLOWED: f64 = 0.4;

/// State of the planner since it started.
#[derive(Default)]
pub struct SpecificWorker {
    /// The search for the next plan.
    search: Option<Search>,
    /// Steps that the world will have made when the next plan begins.
    until: i64,
    plans: u32,
    surprises: u32,
    /// Simulated time that all trials took together, and how long the computer needed for it.
    imagined: Duration,
    needed: Duration,
    is_done: bool,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if self.is_done {
            return Ok(());
        }
        if distance(place(ctx, REAL)?, goal(ctx)) <= ctx.params.tolerance {
            drive(ctx, REAL, Motion::default())?;
            remove_clones(ctx)?;
            self.is_done = true;
            let (imagined, needed) = (self.imagined.as_secs_f64(), self.needed.as_secs_f64());
            info!(
                "at the goal: {} plans, {} surprises, imagined {imagined:.1} s in {needed:.1} s",
                self.plans, self.surprises
            );
            return Ok(());
        }
        let Some(search) = self.search.take() else {
            return self.follow(ctx, None);
        };
        if is_elsewhere(ctx)? {
            self.surprises += 1;
            info!("the robot is not where it was expected: a new plan");
            return self.follow(ctx, None);
        }
        let search = self.search.insert(search);
        let started = Instant::now();
        for _ in 0..ctx.params.trials {
            if !search.step(ctx)? {
                break;
            }
            self.imagined += ctx.params.part;
        }
        self.needed += started.elapsed();
        if ctx.simulation.get_clock(REAL)?.steps < self.until {
            return Ok(());
        }
        let best = search.best();
        if best.is_none() {
            warn!("each motion ends at an obstacle; the robot waits");
        }
        self.plans += 1;
        self.follow(ctx, best)
    }

    fn finalize(&mut self, ctx: &mut Context) {
        let stopped = drive(ctx, REAL, Motion::default());
        if let Err(error) = stopped.and_then(|()| remove_clones(ctx)) {
            warn!("the robot is not stopped, or a clone is left: {error}");
        }
    }
}

impl SpecificWorker {
    /// Starts a motion, in the world and in a clone that shows the expected result. While the robot
    /// follows it, the search for the next plan starts at the place where the robot will be then. Without a
    /// motion, the robot stands meanwhile.
    fn follow(&mut self, ctx: &mut Context, motion: Option<Motion>) -> Result<(), WorkerError> {
        drive(ctx, REAL, motion.unwrap_or_default())?;
        clone(ctx, REAL, EXPECTED)?;
        let before = (ctx.simulation.get_clock(REAL)?, digest(ctx)?);
        clone(ctx, REAL, START)?;
        let length = ctx.params.part.mul_f64(FOLLOWED);
        run(ctx, START, length)?;
        let mut search = Search::new(ctx, goal(ctx))?;
        search.step(ctx)?;
        self.imagined += length + ctx.params.part;
        let after = (ctx.simulation.get_clock(REAL)?, digest(ctx)?);
        // In a network whose time waits for the planner, no step can be in between.
        if before.0.steps == after.0.steps && before.1 != after.1 {
            return Err(WorkerError::Fatal(
                "a trial on a clone changed the world".to_owned(),
            ));
        }
        self.until = before.0.steps + steps(length, before.0.step);
        self.search = Some(search);
        Ok(())
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

fn remove_clones(ctx: &mut Context) -> Result<(), WorkerError> {
    [EXPECTED, START, TRIAL]
        .into_iter()
        .try_for_each(|name| remove(ctx, name))
}

fn digest(ctx: &mut Context) -> Result<i64, WorkerError> {
    Ok(ctx.simulation.get_digest(REAL)?)
}

fn goal(ctx: &Context) -> [f64; 2] {
    [ctx.params.x, ctx.params.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use planner_generated::testing::{SimulationCall, TestContext};
    use planner_generated::{Clock, Pose};

    /// Nanoseconds of a step, and steps of a period.
    const STEP: i64 = 10_000_000;
    const STEPS: i64 = 5;

    #[test]
    fn a_period_tries_a_bounded_number_of_motions() -> Result<(), WorkerError> {
        let mut test = TestContext::configured()?;
        test.params.turns = 33;
        test.params.trials = 3;
        test.answer_defaults();
        let time = std::rc::Rc::new(std::cell::Cell::new(0));
        let now = time.clone();
        test.simulation.on_get_clock(move |_| {
            Ok(Clock {
                steps: now.get(),
                step: STEP,
                ..Clock::default()
            })
        });
        test.simulation.on_get_pose(|_, _, _| Ok(Pose::default()));
        let mut worker = SpecificWorker::initialize(&mut test)?;
        let (mut most, mut driven) = (0, 0);
        for _ in 0..50 {
            worker.compute(&mut test)?;
            time.set(time.get() + STEPS);
            let calls = test.simulation.take_calls();
            let count = |is: fn(&SimulationCall) -> bool| calls.iter().filter(|c| is(c)).count();
            most = most.max(count(|c| matches!(c, SimulationCall::Predict { .. })));
            driven += count(|call| {
                matches!(call, SimulationCall::Drive { world, advance, .. }
                    if world.is_empty() && *advance > 0.0)
            });
        }
        assert_eq!(most, 3);
        // 600 ms of each plan are followed; a period has 50 ms. The first plan is driven after them.
        assert_eq!((worker.plans, driven), (4, 4));
        Ok(())
    }
}
