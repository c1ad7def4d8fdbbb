//! The algorithm of appendix D of SCXML 1.0 as it is written there: over the model, with sets of
//! states, and without any thought of speed. Functions have the names of the standard.

use rc_smdsl::StateMachine;
use rc_smdsl::model::{Action, Condition, State, StateId, StateKind, Transition};
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::time::Duration;

/// The machine itself, as a state.
const ROOT: usize = usize::MAX;

pub(crate) struct Reference<'a> {
    machine: &'a StateMachine,
    indices: HashMap<StateId, usize>,
    parents: Vec<usize>,
    /// The place of each state in document order.
    places: Vec<usize>,
    configuration: BTreeSet<usize>,
    history_value: BTreeMap<usize, BTreeSet<usize>>,
    internal: VecDeque<String>,
    pub(crate) external: VecDeque<String>,
    delayed: Vec<(Duration, String, Option<String>)>,
    pub(crate) running: bool,
    pub(crate) trace: Vec<String>,
    pub(crate) now: Duration,
    guard: fn(&str, usize) -> bool,
    pub(crate) step: usize,
    pub(crate) endless: bool,
}

/// One transition: of the model, or that to the initial states of a state.
#[derive(Clone, Copy)]
enum Way<'a> {
    Of(&'a Transition),
    Initial,
}

impl<'a> Reference<'a> {
    pub(crate) fn new(machine: &'a StateMachine, guard: fn(&str, usize) -> bool) -> Self {
        let indices: HashMap<StateId, usize> = machine.ids().zip(0..).collect();
        let parents = machine
            .states
            .iter()
            .map(|s| s.parent.map_or(ROOT, |id| indices[&id]));
        let parents = parents.collect();
        let mut it = Self {
            machine,
            indices,
            parents,
            places: vec![0; machine.states.len()],
            configuration: BTreeSet::new(),
            history_value: BTreeMap::new(),
            internal: VecDeque::new(),
            external: VecDeque::new(),
            delayed: Vec::new(),
            running: false,
            trace: Vec::new(),
            now: Duration::ZERO,
            guard,
            step: 0,
            endless: false,
        };
        let mut order = Vec::new();
        it.walk(&machine.top.states, &mut order);
        for (place, state) in order.into_iter().enumerate() {
            it.places[state] = place;
        }
        it
    }

    fn walk(&self, states: &[StateId], order: &mut Vec<usize>) {
        for id in states {
            order.push(self.index(*id));
            if let Some(region) = &self.machine.state(*id).region {
                self.walk(&region.states, order);
            }
        }
    }

    fn index(&self, id: StateId) -> usize {
        self.indices[&id]
    }

    fn state(&self, index: usize) -> &'a State {
        &self.machine.states[index]
    }

    fn name(&self, index: usize) -> &'a str {
        &self.state(index).name.text
    }

    fn place(&self, index: usize) -> usize {
        self.places[index]
    }

    fn in_document_order(&self, states: impl IntoIterator<Item = usize>) -> Vec<usize> {
        let mut states: Vec<usize> = states.into_iter().collect();
        states.sort_by_key(|state| self.place(*state));
        states
    }

    pub(crate) fn active(&self) -> Vec<&'a str> {
        let states = self.in_document_order(self.configuration.iter().copied());
        states.into_iter().map(|state| self.name(state)).collect()
    }

    fn parent(&self, state: usize) -> usize {
        self.parents[state]
    }

    fn proper_ancestors(&self, state: usize, until: Option<usize>) -> Vec<usize> {
        let mut all = Vec::new();
        let mut at = state;
        while at != ROOT {
            at = self.parent(at);
            if Some(at) == until {
                break;
            }
            all.push(at);
        }
        all
    }

    fn is_descendant(&self, inner: usize, outer: usize) -> bool {
        inner != ROOT && self.proper_ancestors(inner, None).contains(&outer)
    }

    fn is_history(&self, state: usize) -> bool {
        matches!(self.state(state).kind, StateKind::History { .. })
    }

    fn children(&self, state: usize) -> Vec<usize> {
        let region = self.state(state).region.as_ref();
        let states = region.map_or(&[][..], |region| &region.states);
        let all = states.iter().map(|id| self.index(*id));
        all.filter(|child| !self.is_history(*child)).collect()
    }

    fn is_parallel(&self, state: usize) -> bool {
        state != ROOT
            && self
                .state(state)
                .region
                .as_ref()
                .is_some_and(|r| r.parallel)
    }

    fn is_compound(&self, state: usize) -> bool {
        state == ROOT || !self.is_parallel(state) && !self.children(state).is_empty()
    }

    fn is_final(&self, state: usize) -> bool {
        self.state(state).kind == StateKind::End
    }

    fn is_atomic(&self, state: usize) -> bool {
        self.children(state).is_empty()
    }

    fn initial(&self, state: usize) -> Vec<usize> {
        let region = match state {
            ROOT => Some(&self.machine.top),
            state => self.state(state).region.as_ref(),
        };
        let targets = region.map_or(&[][..], |region| &region.initial);
        targets.iter().map(|id| self.index(*id)).collect()
    }

    /// The default transition of a history state.
    fn default(&self, history: usize) -> &'a Transition {
        let mut all = self.machine.transitions.iter();
        all.find(|t| self.index(t.source) == history)
            .expect("it is there")
    }

    fn targets(&self, transition: &Transition) -> Vec<usize> {
        transition
            .targets
            .iter()
            .map(|id| self.index(*id))
            .collect()
    }

    pub(crate) fn start(&mut self) {
        self.running = true;
        self.enter_states(&[Way::Initial]);
        self.macrostep();
    }

    /// Handles the next external event, as `mainEventLoop`. Says whether there was one.
    pub(crate) fn step(&mut self) -> bool {
        if !self.running {
            return false;
        }
        self.step += 1;
        self.delayed.sort_by_key(|(due, ..)| *due);
        if self.external.is_empty()
            && let Some((due, ..)) = self.delayed.first()
        {
            self.now = self.now.max(*due);
        }
        while self
            .delayed
            .first()
            .is_some_and(|(due, ..)| *due <= self.now)
        {
            let (_, event, _) = self.delayed.remove(0);
            self.external.push_back(event);
        }
        let Some(event) = self.external.pop_front() else {
            return false;
        };
        let enabled = self.select_transitions(Some(&event));
        if !enabled.is_empty() {
            self.microstep(&enabled);
        }
        self.macrostep();
        true
    }

    fn macrostep(&mut self) {
        let mut steps = 0;
        while self.running {
            let mut enabled = self.select_transitions(None);
            if enabled.is_empty() {
                let Some(event) = self.internal.pop_front() else {
                    return;
                };
                enabled = self.select_transitions(Some(&event));
            }
            if !enabled.is_empty() {
                steps += 1;
                if steps > rc_machine::MAX_MICROSTEPS {
                    self.endless = true;
                    return;
                }
                self.microstep(&enabled);
            }
        }
        self.exit_interpreter();
    }

    fn exit_interpreter(&mut self) {
        let mut states = self.in_document_order(self.configuration.iter().copied());
        states.reverse();
        for state in states {
            self.exit(state);
        }
    }

    fn exit(&mut self, state: usize) {
        for block in &self.state(state).on_exit {
            self.execute(block);
        }
        self.trace.push(format!("-{}", self.name(state)));
        self.configuration.remove(&state);
    }

    fn select_transitions(&self, event: Option<&str>) -> Vec<&'a Transition> {
        let mut enabled: Vec<&Transition> = Vec::new();
        let atomic = self
            .configuration
            .iter()
            .copied()
            .filter(|s| self.is_atomic(*s));
        for state in self.in_document_order(atomic) {
            let mut with_ancestors = vec![state];
            with_ancestors.extend(self.proper_ancestors(state, Some(ROOT)));
            'next: for s in with_ancestors {
                for t in &self.machine.transitions {
                    if self.index(t.source) == s && self.is_enabled(t, event) {
                        if !enabled.iter().any(|other| std::ptr::eq(*other, t)) {
                            enabled.push(t);
                        }
                        break 'next;
                    }
                }
            }
        }
        self.remove_conflicting(enabled)
    }

    fn is_enabled(&self, t: &Transition, event: Option<&str>) -> bool {
        let matches = match event {
            None => t.events.is_empty(),
            Some(event) => t.events.iter().any(|descriptor| {
                let words: Vec<&str> = descriptor.text.split('.').collect();
                let words = match words.as_slice() {
                    [start @ .., "*" | ""] => start,
                    all => all,
                };
                let of_event: Vec<&str> = event.split('.').collect();
                of_event.starts_with(words)
            }),
        };
        matches
            && match &t.cond {
                None => true,
                Some(Condition::In(id, _)) => self.configuration.contains(&self.index(*id)),
                Some(Condition::Guard(name)) => (self.guard)(&name.text, self.step),
            }
    }

    fn remove_conflicting(&self, enabled: Vec<&'a Transition>) -> Vec<&'a Transition> {
        let mut filtered: Vec<&Transition> = Vec::new();
        for t1 in enabled {
            let mut preempted = false;
            let mut removed: Vec<&Transition> = Vec::new();
            for t2 in &filtered {
                let (one, two) = (self.compute_exit_set(&[t1]), self.compute_exit_set(&[t2]));
                if !one.is_disjoint(&two) {
                    if self.is_descendant(self.index(t1.source), self.index(t2.source)) {
                        removed.push(t2);
                    } else {
                        preempted = true;
                        break;
                    }
                }
            }
            if !preempted {
                filtered.retain(|t| !removed.iter().any(|other| std::ptr::eq(*other, *t)));
                filtered.push(t1);
            }
        }
        filtered
    }

    fn compute_exit_set(&self, transitions: &[&Transition]) -> BTreeSet<usize> {
        let mut states = BTreeSet::new();
        for t in transitions.iter().filter(|t| !t.targets.is_empty()) {
            let domain = self.transition_domain(t);
            let active = self.configuration.iter().copied();
            states.extend(active.filter(|s| self.is_descendant(*s, domain)));
        }
        states
    }

    fn effective_targets(&self, of: Vec<usize>) -> BTreeSet<usize> {
        let mut targets = BTreeSet::new();
        for s in of {
            if !self.is_history(s) {
                targets.insert(s);
            } else if let Some(value) = self.history_value.get(&s) {
                targets.extend(value);
            } else {
                targets.extend(self.effective_targets(self.targets(self.default(s))));
            }
        }
        targets
    }

    fn transition_domain(&self, t: &Transition) -> usize {
        let source = self.index(t.source);
        let targets = self.effective_targets(self.targets(t));
        let inside = |outer: usize| targets.iter().all(|s| self.is_descendant(*s, outer));
        if t.internal && self.is_compound(source) && inside(source) {
            return source;
        }
        let ancestors = self.proper_ancestors(source, None);
        let mut compound = ancestors.into_iter().filter(|s| self.is_compound(*s));
        compound.find(|s| inside(*s)).expect("it is there")
    }

    fn microstep(&mut self, enabled: &[&'a Transition]) {
        let mut exits = self.in_document_order(self.compute_exit_set(enabled));
        exits.reverse();
        for s in &exits {
            let region = self.state(*s).region.as_ref();
            for id in region.map_or(&[][..], |region| &region.states) {
                let h = self.index(*id);
                let active = self.configuration.iter().copied();
                let value: BTreeSet<usize> = match self.state(h).kind {
                    StateKind::History { deep: true } => active
                        .filter(|a| self.is_atomic(*a) && self.is_descendant(*a, *s))
                        .collect(),
                    StateKind::History { deep: false } => {
                        active.filter(|a| self.parent(*a) == *s).collect()
                    }
                    _ => continue,
                };
                self.history_value.insert(h, value);
            }
        }
        for s in exits {
            self.exit(s);
        }
        for t in enabled {
            self.execute(&t.actions);
        }
        let ways: Vec<Way<'_>> = enabled.iter().map(|t| Way::Of(t)).collect();
        self.enter_states(&ways);
    }

    fn enter_states(&mut self, ways: &[Way<'a>]) {
        let mut entry = Entry::default();
        for way in ways {
            let (targets, ancestor) = match way {
                Way::Initial => (self.initial(ROOT), ROOT),
                Way::Of(t) if t.targets.is_empty() => continue,
                Way::Of(t) => (self.targets(t), self.transition_domain(t)),
            };
            for s in &targets {
                self.add_descendants(*s, &mut entry);
            }
            for s in self.effective_targets(targets) {
                self.add_ancestors(s, ancestor, &mut entry);
            }
        }
        for s in self.in_document_order(entry.states.iter().copied()) {
            self.configuration.insert(s);
            for block in &self.state(s).on_entry {
                self.execute(block);
            }
            self.trace.push(format!("+{}", self.name(s)));
            if entry.default.contains(&s)
                && let Some(region) = &self.state(s).region
            {
                self.execute(&region.actions);
            }
            if let Some(history) = entry.history_content.get(&s) {
                let actions = &self.default(*history).actions;
                self.execute(actions);
            }
            if self.is_final(s) {
                let parent = self.parent(s);
                if parent == ROOT {
                    self.running = false;
                } else {
                    self.internal
                        .push_back(format!("done.state.{}", self.name(parent)));
                    let outer = self.parent(parent);
                    let all_final =
                        |p: usize| self.children(p).iter().all(|c| self.is_in_final(*c));
                    if self.is_parallel(outer) && all_final(outer) {
                        self.internal
                            .push_back(format!("done.state.{}", self.name(outer)));
                    }
                }
            }
        }
    }

    fn is_in_final(&self, s: usize) -> bool {
        let children = self.children(s);
        if self.is_parallel(s) {
            children.iter().all(|c| self.is_in_final(*c))
        } else {
            let mut children = children.iter();
            children.any(|c| self.is_final(*c) && self.configuration.contains(c))
        }
    }

    fn add_descendants(&self, state: usize, entry: &mut Entry) {
        if self.is_history(state) {
            let parent = self.parent(state);
            let targets: Vec<usize> = if let Some(value) = self.history_value.get(&state) {
                value.iter().copied().collect()
            } else {
                entry.history_content.insert(parent, state);
                self.targets(self.default(state))
            };
            for s in &targets {
                self.add_descendants(*s, entry);
            }
            for s in &targets {
                self.add_ancestors(*s, parent, entry);
            }
            return;
        }
        entry.states.insert(state);
        if self.is_parallel(state) {
            self.add_children(state, entry);
        } else if self.is_compound(state) {
            entry.default.insert(state);
            for s in self.initial(state) {
                self.add_descendants(s, entry);
            }
            for s in self.initial(state) {
                self.add_ancestors(s, state, entry);
            }
        }
    }

    fn add_children(&self, parallel: usize, entry: &mut Entry) {
        for child in self.children(parallel) {
            if !entry.states.iter().any(|s| self.is_descendant(*s, child)) {
                self.add_descendants(child, entry);
            }
        }
    }

    fn add_ancestors(&self, state: usize, ancestor: usize, entry: &mut Entry) {
        for outer in self.proper_ancestors(state, Some(ancestor)) {
            if outer == ROOT {
                break;
            }
            entry.states.insert(outer);
            if self.is_parallel(outer) {
                self.add_children(outer, entry);
            }
        }
    }

    fn execute(&mut self, block: &[Action]) {
        for action in block {
            match action {
                Action::Raise(event) => self.internal.push_back(event.text.clone()),
                // The queues have a bound: an event beyond it cannot be dispatched.
                Action::Send { delay, .. }
                    if delay.is_zero() && self.external.len() == rc_machine::MAX_EVENTS
                        || !delay.is_zero() && self.delayed.len() == rc_machine::MAX_DELAYED =>
                {
                    self.internal.push_back("error.communication".to_owned());
                    return;
                }
                Action::Send { event, delay, .. } if delay.is_zero() => {
                    self.external.push_back(event.text.clone());
                }
                Action::Send { event, delay, id } => {
                    let id = id.as_ref().map(|id| id.text.clone());
                    self.delayed
                        .push((self.now + *delay, event.text.clone(), id));
                }
                Action::Cancel(id) => {
                    self.delayed
                        .retain(|(_, _, other)| other.as_ref() != Some(&id.text));
                }
                Action::Call(name) if name.text == "fail" => {
                    self.internal.push_back("error.execution".to_owned());
                    return;
                }
                Action::Call(name) => self.trace.push(name.text.clone()),
                Action::Log { .. } => {}
            }
        }
    }
}

/// The states that a microstep enters.
#[derive(Default)]
struct Entry {
    states: BTreeSet<usize>,
    default: BTreeSet<usize>,
    /// For each parent: the history state whose default was taken.
    history_content: BTreeMap<usize, usize>,
}
