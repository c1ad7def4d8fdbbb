//! Measurements of a chain.

use rc_deploy_network::planned_chain::PlannedChain;
use rc_management::chains::{ChainStatus, HopStatus, Times, Trace};
use std::collections::VecDeque;
use std::time::Duration;

/// The messages of which medians and percentiles are made.
const LAST: usize = 4096;

/// Measurements of a chain. Times are nanoseconds.
#[derive(Debug)]
pub(super) struct Measured {
    pub(super) begun: u64,
    pub(super) complete: u64,
    pub(super) late: u64,
    pub(super) old: u64,
    /// The greatest age of the data in an effect.
    pub(super) oldest: i64,
    /// The longest way of a message.
    worst: i64,
    /// The greatest error of all times.
    pub(super) uncertainty: u64,
    pub(super) hops: Vec<HopCounts>,
    pub(super) last: VecDeque<Completed>,
}

/// A message that came to the end.
#[derive(Clone, Debug)]
pub(super) struct Completed {
    pub(super) began: i64,
    pub(super) total: i64,
    /// In each component: on the way, until `compute()`, work.
    pub(super) parts: Box<[[i64; 3]]>,
    pub(super) is_late: bool,
}

/// Counts at one component.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HopCounts {
    pub(super) lost: u64,
    pub(super) replaced: u64,
    pub(super) ended: u64,
    pub(super) swapped: u64,
    pub(super) restarts: u64,
    pub(super) restamped: u64,
    /// The longest sum, way, period and work.
    worst: [i64; 4],
}

impl Measured {
    pub(super) fn new(hops: usize) -> Self {
        Self {
            begun: 0,
            complete: 0,
            late: 0,
            old: 0,
            oldest: 0,
            worst: 0,
            uncertainty: 0,
            hops: vec![HopCounts::default(); hops],
            last: VecDeque::new(),
        }
    }

    /// Adds a message.
    pub(super) fn complete(&mut self, message: Completed) {
        self.complete += 1;
        self.worst = self.worst.max(message.total);
        for (counts, part) in self.hops.iter_mut().zip(&message.parts) {
            let all = [part.iter().sum(), part[0], part[1], part[2]];
            for (worst, time) in counts.worst.iter_mut().zip(all) {
                *worst = time.max(*worst);
            }
        }
        if self.last.len() == LAST {
            self.last.pop_front();
        }
        self.last.push_back(message);
    }

    /// The messages after the first `known` ones, no more than the newest `most`. `wall_clock`: how
    /// far it is ahead of the clock of these times.
    pub(super) fn traces(&self, known: u64, most: usize, wall_clock: i64) -> Vec<Trace> {
        // A supervisor that was started anew counts from zero.
        let new = self.complete.checked_sub(known).unwrap_or(self.complete);
        let new = usize::try_from(new).unwrap_or(usize::MAX);
        let skipped = self.last.len().saturating_sub(new.min(most));
        let traces = self.last.iter().skip(skipped).map(|message| Trace {
            began_us: u64::try_from((message.began + wall_clock) / 1000).unwrap_or_default(),
            hops: message.parts.iter().map(|p| p.map(milliseconds)).collect(),
            late: message.is_late,
        });
        traces.collect()
    }

    /// The times that `of` takes of the last messages.
    fn times(&self, worst: i64, of: impl Fn(&Completed) -> i64) -> Option<Times> {
        let times = self.last.iter().map(|message| milliseconds(of(message)));
        Times::of(times, milliseconds(worst))
    }

    /// Status of the chain of `plan`, for tools. `coverage`: the part of the messages that was
    /// followed.
    pub(super) fn status(
        &self,
        plan: &PlannedChain,
        conditions: Vec<String>,
        coverage: f64,
        missing: Vec<String>,
    ) -> ChainStatus {
        let in_ms = |time: Duration| time.as_secs_f64() * 1e3;
        let hops = plan.hops.iter().zip(&self.hops).enumerate();
        let hops = hops.map(|(at, (hop, counts))| {
            let part =
                |which: usize| self.times(counts.worst[which + 1], move |m| m.parts[at][which]);
            HopStatus {
                component: hop.input.component.clone(),
                receives: format!("{}.{}", hop.input.slot, hop.input.operation),
                times: self.times(counts.worst[0], move |m| m.parts[at].iter().sum()),
                way: part(0),
                period: part(1),
                work: part(2),
                worst_case_ms: hop.worst.map(|worst| in_ms(worst.into_iter().sum())),
                lost: counts.lost,
                replaced: counts.replaced,
                ended: counts.ended,
                swapped: counts.swapped,
                restarts: counts.restarts,
                restamped: counts.restamped,
            }
        });
        ChainStatus {
            name: plan.name.clone(),
            from: plan.from.clone(),
            to: plan.to.clone(),
            within_ms: plan.within.map(in_ms),
            age_ms: plan.age.map(in_ms),
            missing,
            begun: self.begun,
            complete: self.complete,
            late: self.late,
            old: self.old,
            coverage: (coverage * 1e4).round() / 1e4,
            times: self.times(self.worst, |message| message.total),
            oldest_ms: (self.oldest > 0).then(|| milliseconds(self.oldest)),
            uncertainty_ms: milliseconds(self.uncertainty.try_into().unwrap_or(i64::MAX)),
            hops: hops.collect(),
            conditions,
            traces: Vec::new(),
        }
    }
}

/// With a precision of a microsecond.
fn milliseconds(nanoseconds: i64) -> f64 {
    (nanoseconds as f64 / 1e3).round() / 1e3
}
