//! Measurements of a chain.

use rc_deploy_network::planned_chain::PlannedChain;
use rc_management::chains::{ChainStatus, HopStatus, Times};
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
    /// The last messages: how long each took, and its parts in each component.
    pub(super) last: VecDeque<(i64, Box<[[i64; 3]]>)>,
}

/// Counts at one component.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HopCounts {
    pub(super) lost: u64,
    pub(super) replaced: u64,
    pub(super) ended: u64,
    pub(super) swapped: u64,
    pub(super) restarts: u64,
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

    /// Adds a message that took `total`.
    pub(super) fn complete(&mut self, total: i64, parts: &[[i64; 3]]) {
        self.complete += 1;
        self.worst = self.worst.max(total);
        for (counts, part) in self.hops.iter_mut().zip(parts) {
            let all = [part.iter().sum(), part[0], part[1], part[2]];
            for (worst, time) in counts.worst.iter_mut().zip(all) {
                *worst = time.max(*worst);
            }
        }
        if self.last.len() == LAST {
            self.last.pop_front();
        }
        self.last.push_back((total, parts.into()));
    }

    /// The times that `of` takes of the last messages.
    fn times(&self, worst: i64, of: impl Fn(&(i64, Box<[[i64; 3]]>)) -> i64) -> Option<Times> {
        let mut all: Vec<i64> = self.last.iter().map(of).collect();
        let last = all.len().checked_sub(1)?;
        let mut at = |part: f64| {
            let (_, value, _) = all.select_nth_unstable((last as f64 * part).round() as usize);
            milliseconds(*value)
        };
        Some(Times {
            p50_ms: at(0.5),
            p99_ms: at(0.99),
            worst_ms: milliseconds(worst),
        })
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
            let part = |which: usize| {
                self.times(counts.worst[which + 1], move |(_, parts)| parts[at][which])
            };
            HopStatus {
                component: hop.input.component.clone(),
                receives: format!("{}.{}", hop.input.slot, hop.input.operation),
                times: self.times(counts.worst[0], move |(_, parts)| parts[at].iter().sum()),
                way: part(0),
                period: part(1),
                work: part(2),
                worst_case_ms: hop.worst.map(|worst| in_ms(worst.into_iter().sum())),
                lost: counts.lost,
                replaced: counts.replaced,
                ended: counts.ended,
                swapped: counts.swapped,
                restarts: counts.restarts,
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
            times: self.times(self.worst, |(total, _)| *total),
            oldest_ms: (self.oldest > 0).then(|| milliseconds(self.oldest)),
            uncertainty_ms: milliseconds(self.uncertainty.try_into().unwrap_or(i64::MAX)),
            hops: hops.collect(),
            conditions,
        }
    }
}

/// With a precision of a microsecond.
fn milliseconds(nanoseconds: i64) -> f64 {
    (nanoseconds as f64 / 1e3).round() / 1e3
}
