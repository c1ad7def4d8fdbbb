//! The steps of the worlds: with the time that passes, or on request.

use crate::predictions::work_is_over;
use crate::refusal::Refusal;
use crate::requests::{clock, wrong};
use crate::robots::full_pose;
use innermodel_simulation::World;
use rcis_generated::network_time::Order;
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{Clock, Context, WorkerError};
use std::time::{Duration, Instant};

/// The shortest and the longest period.
const SHORTEST: Duration = Duration::from_micros(100);
const LONGEST: Duration = Duration::from_secs(60);
/// How long one `compute()` makes steps where nothing sets the pace.
const BURST: Duration = Duration::from_millis(5);
/// The most steps of one request.
const MOST_STEPS: i64 = 100_000;

/// Decides when the world of the scene makes steps.
#[derive(Debug)]
pub(crate) struct Steps {
    pub(crate) paused: bool,
    /// Steps that were asked for and are not made yet.
    pending: u64,
    poses: PosePeriods,
}

/// The periods in which poses are published, in simulated time.
#[derive(Debug, Default)]
struct PosePeriods {
    /// The number of the last one.
    published: Option<u128>,
}

impl PosePeriods {
    /// Whether another period has begun. By its number, a step that is longer or shorter adds
    /// nothing.
    fn begins(&mut self, now: Duration, period: Duration) -> bool {
        let number = now.as_nanos() / period.as_nanos().max(1);
        self.published.replace(number) != Some(number)
    }
}

impl Steps {
    pub(crate) fn new(paused: bool) -> Self {
        Self {
            paused,
            pending: 0,
            poses: PosePeriods::default(),
        }
    }

    pub(crate) fn pending(&self) -> u64 {
        self.pending
    }

    /// Makes the steps of one period.
    pub(crate) fn run(&mut self, ctx: &mut Context, world: &mut World) -> Result<(), WorkerError> {
        // While a follower is missing, the runtime goes on waiting.
        if !ctx.time.missing().is_empty() {
            return Ok(());
        }
        let started = Instant::now();
        // A period cannot be shorter than the shortest one: then it has several steps.
        let mut rest = steps_of_period(ctx);
        while self.pending > 0 || !self.paused {
            self.pending = self.pending.saturating_sub(1);
            self.step(ctx, world)?;
            rest = rest.saturating_sub(1);
            let waits = ctx.time.is_active() && ctx.params.wait;
            if waits || started.elapsed() > BURST {
                break;
            }
            if rest == 0 && self.pending == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Makes one step, which the network hears of if it takes its time from here.
    fn step(&mut self, ctx: &mut Context, world: &mut World) -> Result<(), WorkerError> {
        world.step()?;
        if ctx.time.is_active() {
            ctx.time.advance(world.step_time())?;
        }
        if self.poses.begins(world.time(), ctx.params.pose_period) {
            for at in 0..ctx.pose_topics.len() {
                let name = ctx.pose_topics.members()[at].name().to_owned();
                if let Ok(pose) = full_pose(world, &name) {
                    ctx.pose_topics[at].new_full_pose(&pose)?;
                }
            }
        }
        Ok(())
    }

    /// Makes the steps of a request. Those that followers of the time hold up stay pending.
    pub(crate) fn on_request(
        &mut self,
        ctx: &mut Context,
        world: &mut World,
        count: i64,
    ) -> Result<Clock, Refusal> {
        let steps = checked(count)?;
        let until = Instant::now() + ctx.params.work;
        if self.pending > 0 {
            let mut text = format!("{} steps are not over", self.pending);
            let missing = ctx.time.missing();
            if !missing.is_empty() {
                text += &format!(": `{}` has not done the last one", missing.join("`, `"));
            }
            return Err(Refusal::Other(Reason::Busy, text));
        }
        self.pending = steps;
        let waits = ctx.time.is_active() && ctx.params.wait;
        while !waits && self.pending > 0 {
            let made = self.step(ctx, world);
            made.map_err(|error| wrong(error.to_string()))?;
            self.pending -= 1;
            if work_is_over(until) {
                break;
            }
        }
        Ok(clock(world, self.pending))
    }
}

/// Makes the steps of a request in a clone, for at most `work`.
pub(crate) fn in_clone(world: &mut World, count: i64, work: Duration) -> Result<Clock, Refusal> {
    let last = world.steps() + checked(count)?;
    let until = Instant::now() + work;
    while world.steps() < last {
        world.step()?;
        if work_is_over(until) {
            break;
        }
    }
    Ok(clock(world, last - world.steps()))
}

fn checked(count: i64) -> Result<u64, Refusal> {
    if (0..=MOST_STEPS).contains(&count) {
        return Ok(count.unsigned_abs());
    }
    Err(wrong(format!(
        "expected 0 to {MOST_STEPS} steps, found {count}"
    )))
}

/// Sets how fast time passes, and for whom it waits.
pub(crate) fn pace(ctx: &mut Context) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_come_once_in_each_period_however_long_the_steps_are() {
        let ms = Duration::from_millis;
        let count = |step: u64| {
            let mut poses = PosePeriods::default();
            let steps = (1..=1000 / step).map(|number| ms(number * step));
            steps.filter(|now| poses.begins(*now, ms(50))).count()
        };
        // The last moment begins a period.
        assert_eq!((count(1), count(10), count(50)), (21, 21, 20));
        assert_eq!(count(100), 10, "a step has one pose at most");
        let mut poses = PosePeriods::default();
        assert!(poses.begins(ms(1), Duration::ZERO));
    }

    #[test]
    fn a_request_has_a_bound() {
        for wrong in [-1, MOST_STEPS + 1, i64::MIN] {
            checked(wrong).expect_err("out of bounds");
        }
        assert_eq!(checked(MOST_STEPS).ok(), Some(100_000));
    }
}
