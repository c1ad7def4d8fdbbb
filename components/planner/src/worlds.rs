//! The simulated world and its clones, as the planner asks for them.

use crate::motions::Motion;
use planner_generated::interfaces::simulation::SimulationErrorOrCall;
use planner_generated::types::rc_simulation::Reason;
use planner_generated::{Context, WorkerError};
use std::time::Duration;

/// The clone on which motions are tried.
pub(crate) const TRIAL: &str = "planner_trial";
/// The clone in which the next plan begins: the world as it will be then.
pub(crate) const START: &str = "planner_start";
/// The clone that does what the robot should do.
pub(crate) const EXPECTED: &str = "planner_expected";
/// The world that all sensors see.
pub(crate) const REAL: &str = "";
/// How many requests one trial takes at most. The simulator serves others between them.
const MOST_REQUESTS: u32 = 10_000;

/// Replaces a clone by a world as it is now.
pub(crate) fn clone(ctx: &mut Context, of: &str, name: &str) -> Result<(), WorkerError> {
    remove(ctx, name)?;
    ctx.simulation.clone(of, name)?;
    Ok(())
}

/// Removes a clone, which may be one that an earlier process of this component left.
pub(crate) fn remove(ctx: &mut Context, name: &str) -> Result<(), WorkerError> {
    if ctx.simulation.get_clones()?.iter().any(|it| it == name) {
        ctx.simulation.remove_clone(name)?;
    }
    Ok(())
}

pub(crate) fn drive(ctx: &mut Context, world: &str, motion: Motion) -> Result<(), WorkerError> {
    let Motion { advance, turn } = motion;
    ctx.simulation
        .drive(world, &ctx.params.base, 0.0, advance, turn)?;
    Ok(())
}

/// Makes the steps of a time in a clone.
pub(crate) fn run(ctx: &mut Context, clone: &str, time: Duration) -> Result<(), WorkerError> {
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
pub(crate) fn predict(
    ctx: &mut Context,
    world: &str,
    motion: Motion,
) -> Result<Option<[f64; 2]>, WorkerError> {
    let Motion { advance, turn } = motion;
    let (base, time) = (&ctx.params.base, ctx.params.part.as_secs_f64());
    for _ in 0..MOST_REQUESTS {
        let found = ctx
            .simulation
            .predict(world, base, 0.0, advance, turn, time);
        let found = match found {
            Err(SimulationErrorOrCall::SimulationError(error)) if error.reason == Reason::Busy => {
                continue;
            }
            found => found?,
        };
        let free = found.collision.is_none();
        return Ok(free.then_some([found.pose.x, found.pose.z]));
    }
    Err(WorkerError::Failed(
        "a prediction does not end; the computer is too slow for this scene".to_owned(),
    ))
}

/// The place of the robot on the floor, in mm of the root.
pub(crate) fn place(ctx: &mut Context, world: &str) -> Result<[f64; 2], WorkerError> {
    let pose = ctx.simulation.get_pose(world, &ctx.params.base, "root")?;
    Ok([pose.x, pose.z])
}

pub(crate) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// How many steps of `step` nanoseconds a time has.
pub(crate) fn steps(time: Duration, step: i64) -> i64 {
    let count = time.as_nanos() / u128::from(step.unsigned_abs()).max(1);
    i64::try_from(count).unwrap_or(i64::MAX)
}
