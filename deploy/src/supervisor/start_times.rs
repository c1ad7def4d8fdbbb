//! When each unit began, was ready and worked in the first start of the network.

use crate::supervisor::start_order::StartOrder;
use crate::supervisor::unit::Unit;
use rc_deploy_client::start_report::{self, Phase, PhaseKey, PhaseKind, StartReport};
use rc_management::event::time_text;
use rc_management::lifecycle::LifecycleState;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

/// The times of one unit.
#[derive(Clone, Copy, Debug, Default)]
struct UnitTimes {
    /// When its process started.
    started: Option<Instant>,
    /// When it was ready; a managed one, configured.
    ready: Option<Instant>,
    /// When a managed one was asked to be active.
    asked: Option<Instant>,
    /// When those that depend on it could work.
    works: Option<Instant>,
}

/// The times of the first start.
#[derive(Debug)]
pub(super) struct StartTimes {
    began: Instant,
    time: SystemTime,
    directory: PathBuf,
    units: Vec<UnitTimes>,
}

impl StartTimes {
    /// Begins the start of so many units. The report is written to the folder of the logs.
    pub(super) fn new(units: usize, directory: &Path) -> Self {
        // Nobody takes the last start for this one. A file that stays is replaced.
        let _ = std::fs::remove_file(start_report::file(directory));
        Self {
            began: Instant::now(),
            time: SystemTime::now(),
            directory: directory.to_owned(),
            units: vec![UnitTimes::default(); units],
        }
    }

    /// Notes what has happened since the last turn of the loop.
    pub(super) fn look(&mut self, units: &[Unit]) {
        let now = Instant::now();
        for (times, unit) in self.units.iter_mut().zip(units) {
            times.started = times.started.or_else(|| unit.started());
            if unit.is_ready() {
                times.ready.get_or_insert(now);
            }
            if times.ready.is_some() && unit.lets_others_work() {
                times.works.get_or_insert(now);
            }
        }
    }

    /// Notes that a managed unit is sent a goal.
    pub(super) fn asked(&mut self, i: usize, goal: LifecycleState) {
        if goal == LifecycleState::Active {
            self.units[i].asked.get_or_insert_with(Instant::now);
        }
    }

    /// The phases of all units that have begun.
    fn phases(&self, units: &[Unit], order: &StartOrder) -> Vec<Phase> {
        let key = |i: usize, phase| PhaseKey {
            component: units[i].name().to_owned(),
            phase,
        };
        // The last phase of a unit, and its end.
        let last = |i: usize| {
            let kind = match self.units[i].asked {
                Some(_) => PhaseKind::Activate,
                None => PhaseKind::Start,
            };
            (i, kind, self.units[i].works)
        };
        let first = |i: usize| (i, PhaseKind::Start, self.units[i].ready);
        let phase = |own, began: Instant, ended: Option<Instant>, before: Vec<_>| {
            let until = ended.unwrap_or_else(Instant::now);
            let all = before.into_iter();
            let ends =
                all.filter_map(|(i, kind, end): (usize, _, Option<Instant>)| Some((end?, i, kind)));
            let waited_for = ends
                .filter(|(end, ..)| *end <= until)
                .max_by_key(|(end, ..)| *end);
            // Threads of a process begin together, and one waits in it for another one.
            let began = waited_for.map_or(began, |(end, ..)| began.max(end));
            Phase {
                key: own,
                began_ms: self.ms(began),
                ended_ms: ended.map(|ended| self.ms(ended)),
                waited_for: waited_for.map(|(_, i, kind)| key(i, kind)),
            }
        };
        let mut phases = Vec::new();
        for (i, times) in self.units.iter().enumerate() {
            let Some(started) = times.started else {
                continue;
            };
            let outside = order.mates(i).iter().flat_map(|&mate| {
                let needs = order.needs_outside(mate);
                needs.map(move |j| (mate, j))
            });
            let outside = outside.map(|(mate, j)| {
                if units[mate].is_managed() {
                    first(j)
                } else {
                    last(j)
                }
            });
            let before = outside.chain(order.needs_inside(i).map(first)).collect();
            phases.push(phase(
                key(i, PhaseKind::Start),
                started,
                times.ready,
                before,
            ));
            if let Some(asked) = times.asked {
                let needs = order.needs(i).iter().map(|&j| last(j));
                let configured = order.configured_first().chain([i]).map(first);
                // What ended after the request was not waited for.
                let before = needs.chain(configured);
                let before = before.filter(|(_, _, end)| end.is_some_and(|end| end <= asked));
                let before = before.collect();
                phases.push(phase(
                    key(i, PhaseKind::Activate),
                    asked,
                    times.works,
                    before,
                ));
            }
        }
        phases
    }

    /// Writes how the network has started, or how far it came. A folder that cannot be written is a
    /// condition of its own.
    pub(super) fn save(&self, network: &str, units: &[Unit], order: &StartOrder) {
        let is_up = units.iter().all(Unit::lets_others_work);
        let report = StartReport {
            network: network.to_owned(),
            began: time_text(self.time),
            up_ms: is_up.then(|| self.ms(Instant::now())),
            phases: self.phases(units, order),
        };
        let _ = start_report::write(&self.directory, &report);
    }

    /// Milliseconds since the start began, to microseconds.
    fn ms(&self, at: Instant) -> f64 {
        (at.saturating_duration_since(self.began).as_secs_f64() * 1e6).round() / 1e3
    }
}
