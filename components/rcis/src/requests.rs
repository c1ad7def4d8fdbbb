//! What requests of `Simulation` share: their values, and the worlds that they name.

use crate::SpecificWorker;
use crate::elements;
use crate::refusal::{Refusal, reply};
use crate::worlds::unknown;
use innermodel::language::Document;
use innermodel_simulation::{Speed, World};
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{Clock, Context, Pose, SimulationError};
use std::path::Path;
use std::time::Instant;

/// The most steps of one request.
pub(crate) const MOST_STEPS: i64 = 100_000;
pub(crate) fn wrong(what: impl Into<String>) -> Refusal {
    Refusal::Other(Reason::WrongValue, what.into())
}

pub(crate) fn pose_in(pose: &Pose) -> innermodel::Pose {
    innermodel::Pose::new(pose.x, pose.y, pose.z, pose.rx, pose.ry, pose.rz)
}

pub(crate) fn pose_out(pose: &innermodel::Pose) -> Pose {
    let ([x, y, z], [rx, ry, rz]) = (pose.translation, pose.rotation);
    Pose {
        x,
        y,
        z,
        rx,
        ry,
        rz,
    }
}

/// Reads a text with one outermost element.
pub(crate) fn one_element(scene: &Path, text: &str) -> Result<Document, Refusal> {
    let read = elements::read(scene, text);
    let document = read.map_err(|refused| {
        let reason = match refused {
            inner_model_manager::Refusal::Path(_) => Reason::WrongValue,
            _ => Reason::WrongText,
        };
        Refusal::Other(reason, refused.text())
    })?;
    let tops = document.nodes.iter().filter(|node| node.parent.is_none());
    let tops = tops.count();
    if tops != 1 {
        let text = format!("expected one element, found {tops}");
        return Err(Refusal::Other(Reason::WrongText, text));
    }
    Ok(document)
}

pub(crate) fn clock(world: &World, pending: u64) -> Clock {
    let count = |number: u128| i64::try_from(number).unwrap_or(i64::MAX);
    Clock {
        time: count(world.time().as_nanos()),
        steps: count(u128::from(world.steps())),
        step: count(world.step_time().as_nanos()),
        pending: count(u128::from(pending)),
    }
}

pub(crate) fn speed(side: f64, advance: f64, turn: f64) -> Speed {
    Speed {
        side,
        advance,
        turn,
    }
}

impl SpecificWorker {
    /// The world of a name.
    pub(crate) fn named(&mut self, name: &str) -> Result<&mut World, Refusal> {
        if name.is_empty() {
            return Ok(&mut self.world);
        }
        if !self.worlds.clones.contains_key(name) {
            return Err(unknown(&self.worlds.clones, name, "clone"));
        }
        let found = self.worlds.clones.get_mut(name);
        found.ok_or_else(|| wrong("the clone is gone"))
    }

    /// Asks or changes the world of a name.
    pub(crate) fn with<T, E: From<SimulationError>>(
        &mut self,
        name: &str,
        make: impl FnOnce(&mut World) -> Result<T, Refusal>,
    ) -> Result<T, E> {
        reply(self.named(name).and_then(make))
    }

    /// Makes steps of a world. Those that followers of the time hold up stay pending.
    pub(crate) fn make_steps(
        &mut self,
        ctx: &mut Context,
        name: &str,
        count: i64,
    ) -> Result<Clock, Refusal> {
        if !(0..=MOST_STEPS).contains(&count) {
            return Err(wrong(format!(
                "expected 0 to {MOST_STEPS} steps, found {count}"
            )));
        }
        let steps = count.unsigned_abs();
        let until = Instant::now() + ctx.params.work;
        if !name.is_empty() {
            let world = self.named(name)?;
            let last = world.steps() + steps;
            while world.steps() < last {
                world.step()?;
                if Instant::now() >= until {
                    break;
                }
            }
            return Ok(clock(world, last - world.steps()));
        }
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
            self.step(ctx).map_err(|error| wrong(error.to_string()))?;
            self.pending -= 1;
            if Instant::now() >= until {
                break;
            }
        }
        Ok(clock(&self.world, self.pending))
    }
}
