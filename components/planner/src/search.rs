//! The search for the next motion. It tries one motion at a time, so that a period takes a bounded
//! time however many motions there are.

use crate::motions::{Motion, arcs, on_the_spot};
use crate::worlds::{START, TRIAL, clone, distance, drive, place, predict, run};
use planner_generated::{Context, WorkerError};
use std::collections::VecDeque;

/// How many first parts are tried with all second parts: those that end nearest to the goal.
const MOST_FIRST: usize = 5;

/// Finds the motion that comes nearest to the goal in two parts, the first of them without a
/// contact. It begins in the clone [`START`].
pub(crate) struct Search {
    goal: [f64; 2],
    /// In mm/s.
    advance: f64,
    turns: u32,
    /// First parts that are not tried yet.
    open: VecDeque<Motion>,
    /// First parts without a contact, with the distance of their ends from the goal.
    free: Vec<(f64, Motion)>,
    /// Whether `free` is complete, and has the first parts that wait for their second ones. The
    /// nearest one is the last.
    is_sorted: bool,
    /// The first part that the clone [`TRIAL`] has done.
    tried: Option<Tried>,
    best: Option<(f64, Motion)>,
}

struct Tried {
    first: Motion,
    /// The least distance from the goal so far.
    nearest: f64,
    second: VecDeque<Motion>,
}

impl Search {
    /// A search among motions that do not drive beyond the goal.
    pub(crate) fn new(ctx: &mut Context, goal: [f64; 2]) -> Result<Self, WorkerError> {
        let far = distance(place(ctx, START)?, goal);
        let advance = ctx.params.speed.min(far / ctx.params.part.as_secs_f64());
        let turns = u32::try_from(ctx.params.turns).unwrap_or(1);
        Ok(Self {
            goal,
            advance,
            turns,
            open: arcs(advance, turns).chain(on_the_spot()).collect(),
            free: Vec::new(),
            is_sorted: false,
            tried: None,
            best: None,
        })
    }

    /// Tries one motion for one part. Returns whether there was one left.
    pub(crate) fn step(&mut self, ctx: &mut Context) -> Result<bool, WorkerError> {
        if let Some(first) = self.open.pop_front() {
            if let Some(end) = predict(ctx, START, first)? {
                self.free.push((distance(end, self.goal), first));
            }
            return Ok(true);
        }
        if !self.is_sorted {
            self.is_sorted = true;
            self.free.sort_by(|a, b| a.0.total_cmp(&b.0));
            self.best = self.free.first().copied();
            self.free.truncate(MOST_FIRST);
            self.free.reverse();
        }
        if let Some(tried) = &mut self.tried {
            if let Some(second) = tried.second.pop_front() {
                if let Some(end) = predict(ctx, TRIAL, second)? {
                    tried.nearest = tried.nearest.min(distance(end, self.goal));
                }
                return Ok(true);
            }
            // The first one replaces the end of a single part, which says less.
            if self.best.is_none_or(|(least, _)| tried.nearest < least) {
                self.best = Some((tried.nearest, tried.first));
            }
            self.tried = None;
        }
        let Some((_, first)) = self.free.pop() else {
            return Ok(false);
        };
        clone(ctx, START, TRIAL)?;
        drive(ctx, TRIAL, first)?;
        run(ctx, TRIAL, ctx.params.part)?;
        self.tried = Some(Tried {
            first,
            nearest: distance(place(ctx, TRIAL)?, self.goal),
            second: arcs(self.advance, self.turns).collect(),
        });
        Ok(true)
    }

    /// The best motion that was found so far.
    pub(crate) fn best(&self) -> Option<Motion> {
        let nearest = || self.free.iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let best = self.best.as_ref().or_else(nearest);
        best.map(|(_, motion)| *motion)
    }
}
