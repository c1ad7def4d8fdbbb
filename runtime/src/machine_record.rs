//! The part of the status about a state machine: its active states and its last transitions.

use rc_machine::{Chart, Session};
use rc_management::component::{MachineStatus, TransitionStatus};
use std::collections::VecDeque;
use std::time::Duration;

/// The number of transitions that the status keeps.
const KEPT: usize = 8;

/// The part of the status about a machine, as numbers of its chart.
#[derive(Debug)]
pub(crate) struct MachineRecord {
    chart: &'static Chart,
    /// The events that may be fired from outside.
    external: &'static [u16],
    states: Vec<u16>,
    taken: VecDeque<TakenTransition>,
}

/// A transition that was taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TakenTransition {
    pub(crate) transition: u16,
    pub(crate) event: u16,
    pub(crate) took: Duration,
    /// Since the start of the component.
    pub(crate) at: Duration,
}

impl MachineRecord {
    pub(crate) fn new(chart: &'static Chart, external: &'static [u16]) -> Self {
        Self {
            chart,
            external,
            states: Vec::with_capacity(chart.states.len()),
            taken: VecDeque::with_capacity(KEPT),
        }
    }

    /// Notes the active states, and a transition that was taken.
    pub(crate) fn update(&mut self, session: &Session, taken: Option<TakenTransition>) {
        // The component's own state shows the end.
        let chart = self.chart;
        let states = || {
            session
                .active()
                .filter(|state| chart.state(*state).kind.is_atomic())
        };
        if taken.is_none() && states().eq(self.states.iter().copied()) {
            return;
        }
        self.states.clear();
        self.states.extend(states());
        if let Some(taken) = taken {
            if self.taken.len() == KEPT {
                self.taken.pop_front();
            }
            self.taken.push_back(taken);
        }
    }

    /// The events that may be fired from outside.
    pub(crate) fn external_events(&self) -> impl Iterator<Item = &'static str> + use<> {
        let events = &self.chart.events;
        self.external.iter().map(|at| &*events[usize::from(*at)])
    }

    /// The number of an event that may be fired from outside.
    pub(crate) fn external(&self, event: &str) -> Option<u16> {
        let mut all = self.external.iter().copied();
        all.find(|at| self.chart.events[usize::from(*at)] == event)
    }

    /// Whether the worker can fire the event.
    pub(crate) fn has_event(&self, event: &str) -> bool {
        let mut fireable = self.chart.events[..usize::from(self.chart.fireable)].iter();
        fireable.any(|known| known == event)
    }

    pub(crate) fn status(&self) -> MachineStatus {
        let path = |state: &u16| self.chart.state(*state).path.to_string();
        MachineStatus {
            states: self.states.iter().map(path).collect(),
            external: self.external_events().map(str::to_owned).collect(),
            transitions: self
                .taken
                .iter()
                .map(|taken| {
                    let transition = self.chart.transition(taken.transition);
                    let event = self.chart.events.get(usize::from(taken.event));
                    let targets = self.chart.list(transition.targets).iter();
                    TransitionStatus {
                        from: path(&transition.source),
                        to: targets.map(path).collect(),
                        event: event.map(ToString::to_string),
                        took_us: taken.took.as_micros() as u64,
                        at_s: taken.at.as_secs_f64(),
                    }
                })
                .collect(),
        }
    }
}
