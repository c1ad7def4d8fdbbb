//! Which states a microstep enters, and their entry.

use super::{Host, Interpreter};
use crate::chart::{Kind, NONE};
use crate::session::Session;
use crate::set::Set;

impl Interpreter {
    pub(super) fn enter_states<H: Host>(&mut self, host: &mut H) {
        let chart = self.chart;
        self.compute_entry_set();
        let mut next = self.entry.next(0);
        while let Some(state) = next {
            next = self.entry.next(state + 1);
            host.session().active.insert(state);
            let it = chart.state(state);
            self.run_blocks(it.entry, host);
            if host.enter(state).is_err() {
                self.raise(chart.execution_error);
            }
            if self.default_entry.contains(state) {
                self.run(chart.transition(it.initial).actions, host);
            }
            let history = self.default_history[usize::from(state)];
            if history != NONE {
                self.run(chart.transition(history).actions, host);
            }
            if it.kind == Kind::Final {
                self.entered_final(state, host.session());
            }
        }
    }

    fn entered_final(&mut self, state: u16, session: &mut Session) {
        let chart = self.chart;
        let parent = chart.state(state).parent;
        if parent == 0 {
            self.running = false;
            session.end = state;
            return;
        }
        self.raise(chart.state(parent).done);
        let outer = chart.state(parent).parent;
        if outer != NONE
            && chart.state(outer).kind == Kind::Parallel
            && self.is_in_final_state(outer, &session.active)
        {
            self.raise(chart.state(outer).done);
        }
    }

    fn is_in_final_state(&self, state: u16, active: &Set) -> bool {
        let chart = self.chart;
        let mut children = chart.children(state);
        match chart.state(state).kind {
            Kind::Compound => {
                children.any(|s| chart.state(s).kind == Kind::Final && active.contains(s))
            }
            Kind::Parallel => children.all(|s| self.is_in_final_state(s, active)),
            _ => false,
        }
    }

    fn compute_entry_set(&mut self) {
        self.entry.clear();
        self.default_entry.clear();
        self.default_history.fill(NONE);
        let chart = self.chart;
        for at in 0..self.filtered.len() {
            let transition = self.filtered[at].0;
            let targets = chart.list(chart.transition(transition).targets);
            if targets.is_empty() {
                continue;
            }
            for target in targets {
                self.add_descendants(*target);
            }
            // The exit may have changed what a history state remembers. The machine itself has no
            // transitions; its initial one is inside of it.
            let source = chart.transition(transition).source;
            let ancestor = if source == 0 {
                0
            } else {
                self.domain(transition)
            };
            for target in targets {
                self.add_ancestors_of_effective(*target, ancestor);
            }
        }
    }

    /// `addDescendantStatesToEnter`.
    fn add_descendants(&mut self, state: u16) {
        let chart = self.chart;
        let it = chart.state(state);
        if it.kind.is_history() {
            let slot = usize::from(it.history);
            if let Some(memory) = self.history[slot].take() {
                for inner in memory.iter() {
                    self.add_descendants(inner);
                }
                for inner in memory.iter() {
                    self.add_ancestors(inner, it.parent);
                }
                self.history[slot] = Some(memory);
            } else {
                self.default_history[usize::from(it.parent)] = it.initial;
                self.add_initial(it.initial, it.parent);
            }
            return;
        }
        self.entry.insert(state);
        match it.kind {
            Kind::Compound => {
                self.default_entry.insert(state);
                self.add_initial(it.initial, state);
            }
            Kind::Parallel => self.add_regions(state),
            _ => {}
        }
    }

    fn add_initial(&mut self, transition: u16, ancestor: u16) {
        let chart = self.chart;
        let targets = chart.list(chart.transition(transition).targets);
        for target in targets {
            self.add_descendants(*target);
        }
        for target in targets {
            self.add_ancestors(*target, ancestor);
        }
    }

    /// Enters the regions of a parallel state in which no state is entered yet.
    fn add_regions(&mut self, parallel: u16) {
        let chart = self.chart;
        for child in chart.children(parallel) {
            let end = chart.state(child).end;
            let inside = self.entry.next(child + 1).is_some_and(|s| s < end);
            if !inside {
                self.add_descendants(child);
            }
        }
    }

    /// `addAncestorStatesToEnter`.
    fn add_ancestors(&mut self, state: u16, ancestor: u16) {
        let chart = self.chart;
        for outer in chart.ancestors(state, ancestor) {
            if outer == 0 {
                break;
            }
            self.entry.insert(outer);
            if chart.state(outer).kind == Kind::Parallel {
                self.add_regions(outer);
            }
        }
    }

    /// `addAncestorStatesToEnter` of each of `getEffectiveTargetStates`.
    fn add_ancestors_of_effective(&mut self, target: u16, ancestor: u16) {
        let chart = self.chart;
        let it = chart.state(target);
        if !it.kind.is_history() {
            self.add_ancestors(target, ancestor);
            return;
        }
        let slot = usize::from(it.history);
        if let Some(memory) = self.history[slot].take() {
            for inner in memory.iter() {
                self.add_ancestors(inner, ancestor);
            }
            self.history[slot] = Some(memory);
        } else {
            for target in chart.list(chart.transition(it.initial).targets) {
                self.add_ancestors_of_effective(*target, ancestor);
            }
        }
    }
}
