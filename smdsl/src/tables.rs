//! Makes the tables of the interpreter from a machine without errors.

use crate::model::{self, Action, Condition, Region, StateId, StateKind, StateMachine};
use rc_machine::{Chart, Kind, NONE, Range, State, Transition, Trigger};
use rc_syntax::Name;
use std::borrow::Cow;
use std::collections::HashMap;

/// A machine is too large for the numbers of its tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLarge;

/// The events that the interpreter raises when an action fails.
const EXECUTION: &str = "error.execution";
const COMMUNICATION: &str = "error.communication";

/// Whether an event descriptor matches the name of an event: it is equal, or its words are the
/// first words of the name.
pub fn matches(descriptor: &str, event: &str) -> bool {
    let prefix = stem(descriptor);
    descriptor == "*"
        || event
            .strip_prefix(prefix)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Whether a descriptor matches every event that another one matches.
pub(crate) fn covers(descriptor: &str, other: &str) -> bool {
    other != "*" && matches(descriptor, stem(other)) || descriptor == "*"
}

/// A descriptor without the `.*` or `.` at its end, which have no effect.
pub(crate) fn stem(descriptor: &str) -> &str {
    let short = descriptor.strip_suffix(".*");
    short.or(descriptor.strip_suffix('.')).unwrap_or(descriptor)
}

/// Whether only the interpreter raises events of this name.
fn is_reserved(event: &str) -> bool {
    matches!(
        event,
        "error" | EXECUTION | COMMUNICATION | "error.platform" | "done" | "done.state"
    ) || event.starts_with("done.state.")
}

/// The tables of a machine.
///
/// # Errors
/// It has too many states, transitions or events.
pub fn of(machine: &StateMachine) -> Result<Chart, TooLarge> {
    let mut tables = Tables {
        machine,
        numbers: vec![NONE; machine.states.len()],
        order: Vec::new(),
        events: events(machine),
        event_numbers: HashMap::new(),
        lists: Vec::new(),
        blocks: Vec::new(),
        actions: Vec::new(),
        texts: Vec::new(),
        guards: Vec::new(),
        functions: Vec::new(),
        send_ids: Vec::new(),
        too_large: false,
    };
    tables.number(&machine.top.states);
    let fireable = tables.events.iter().take_while(|e| !is_reserved(e)).count();
    for (at, event) in tables.events.iter().enumerate() {
        tables.event_numbers.insert(event.clone(), at as u16);
    }
    tables.chart(fireable as u16)
}

/// The names of all events: first those that the worker can fire.
fn events(machine: &StateMachine) -> Vec<String> {
    let mut named: Vec<&str> = Vec::new();
    let descriptors = || machine.transitions.iter().flat_map(|t| &t.events);
    named.extend(
        descriptors()
            .map(|name| stem(&name.text))
            .zip(descriptors())
            .filter(|(_, name)| !name.text.contains('*'))
            .map(|(stem, _)| stem),
    );
    let states = || machine.states.iter();
    let regions = || {
        states()
            .filter_map(|s| s.region.as_ref())
            .chain([&machine.top])
    };
    let blocks = states().flat_map(|s| s.on_entry.iter().chain(&s.on_exit));
    let blocks = blocks.chain(regions().map(|r| &r.actions));
    for action in blocks
        .chain(machine.transitions.iter().map(|t| &t.actions))
        .flatten()
    {
        if let Action::Raise(event) | Action::Send { event, .. } = action {
            named.push(&event.text);
        }
    }
    let (mut events, mut reserved): (Vec<String>, Vec<String>) = named
        .into_iter()
        .map(str::to_owned)
        .partition(|name| !is_reserved(name));
    let mut own = vec![EXECUTION.to_owned(), COMMUNICATION.to_owned()];
    let outer = states().filter(|s| s.region.is_some());
    own.extend(outer.map(|s| format!("done.state.{}", s.name.text)));
    own.retain(|event| descriptors().any(|name| matches(&name.text, event)));
    reserved.extend(own);
    events.append(&mut reserved);
    let mut seen = std::collections::HashSet::new();
    events.retain(|event| seen.insert(event.clone()));
    events
}

struct Tables<'a> {
    machine: &'a StateMachine,
    /// The number of each state in the tables.
    numbers: Vec<u16>,
    /// The states in document order, without the machine itself.
    order: Vec<StateId>,
    events: Vec<String>,
    event_numbers: HashMap<String, u16>,
    lists: Vec<u16>,
    blocks: Vec<Range>,
    actions: Vec<rc_machine::Action>,
    texts: Vec<String>,
    guards: Vec<String>,
    functions: Vec<String>,
    send_ids: Vec<String>,
    too_large: bool,
}

impl Tables<'_> {
    /// Numbers states and their descendants in document order.
    fn number(&mut self, states: &[StateId]) {
        for id in states {
            self.order.push(*id);
            self.numbers[id.0] = self.fits(self.order.len());
            if let Some(region) = &self.machine.state(*id).region {
                self.number(&region.states);
            }
        }
    }

    fn fits(&mut self, number: usize) -> u16 {
        let fits = u16::try_from(number).ok().filter(|number| *number < NONE);
        self.too_large |= fits.is_none();
        fits.unwrap_or(0)
    }

    fn range(&mut self, start: usize, end: usize) -> Range {
        Range {
            start: self.fits(start),
            end: self.fits(end),
        }
    }

    fn list(&mut self, items: impl IntoIterator<Item = u16>) -> Range {
        let start = self.lists.len();
        self.lists.extend(items);
        self.range(start, self.lists.len())
    }

    fn id_of(&mut self, name: &str, names: fn(&mut Self) -> &mut Vec<String>) -> u16 {
        let names = names(self);
        let at = names.iter().position(|other| other == name);
        let at = at.unwrap_or_else(|| {
            names.push(name.to_owned());
            names.len() - 1
        });
        self.fits(at)
    }

    fn block(&mut self, actions: &[Action]) -> Range {
        let start = self.actions.len();
        for action in actions {
            let made = match action {
                Action::Raise(event) => rc_machine::Action::Raise(self.event(&event.text)),
                Action::Send { event, delay, id } => rc_machine::Action::Send {
                    event: self.event(&event.text),
                    delay: u64::try_from(delay.as_nanos()).unwrap_or(u64::MAX),
                    id: self.optional(id.as_ref(), |t| &mut t.send_ids),
                },
                Action::Cancel(id) => {
                    rc_machine::Action::Cancel(self.id_of(&id.text, |t| &mut t.send_ids))
                }
                Action::Call(name) => {
                    rc_machine::Action::Call(self.id_of(&name.text, |t| &mut t.functions))
                }
                Action::Log { label, expr } => {
                    let expr = expr.as_ref().map(|expr| {
                        let text = expr.text.trim();
                        let inside = |q: char| text.strip_prefix(q)?.strip_suffix(q);
                        let text = inside('\'').or_else(|| inside('"')).unwrap_or(text);
                        Name::new(text, expr.span)
                    });
                    rc_machine::Action::Log {
                        label: self.optional(label.as_ref(), |t| &mut t.texts),
                        text: self.optional(expr.as_ref(), |t| &mut t.texts),
                    }
                }
            };
            self.actions.push(made);
        }
        self.range(start, self.actions.len())
    }

    fn optional(&mut self, name: Option<&Name>, names: fn(&mut Self) -> &mut Vec<String>) -> u16 {
        name.map_or(NONE, |name| self.id_of(&name.text, names))
    }

    fn event(&self, name: &str) -> u16 {
        self.event_numbers.get(name).copied().unwrap_or(NONE)
    }

    /// The number of an event if a transition matches it.
    fn matched(&self, name: &str) -> u16 {
        let mut all = self.machine.transitions.iter().flat_map(|t| &t.events);
        if all.any(|descriptor| matches(&descriptor.text, name)) {
            self.event(name)
        } else {
            NONE
        }
    }

    fn chart(mut self, fireable: u16) -> Result<Chart, TooLarge> {
        self.fits(self.events.len());
        if self.too_large {
            return Err(TooLarge);
        }
        let machine = self.machine;
        let mut of_source: Vec<Vec<&model::Transition>> = vec![Vec::new(); machine.states.len()];
        for transition in &machine.transitions {
            of_source[transition.source.0].push(transition);
        }
        let mut states = self.states();
        let mut transitions: Vec<Transition> = Vec::new();
        let mut defaults: Vec<(u16, &[StateId], &[Action])> = Vec::new();
        defaults.push((0, &machine.top.initial, &machine.top.actions));
        for (at, id) in self.order.clone().into_iter().enumerate() {
            let number = (at + 1) as u16;
            let own = &of_source[id.0];
            if states[at + 1].kind.is_history() {
                let default = own.first();
                defaults.extend(default.map(|t| (number, &t.targets[..], &t.actions[..])));
                continue;
            }
            let start = transitions.len();
            for transition in own {
                let made = self.transition(number, transition);
                transitions.push(made);
            }
            states[at + 1].transitions = self.range(start, transitions.len());
            let region = machine.state(id).region.as_ref();
            let region = region.filter(|region| !region.parallel);
            defaults.extend(region.map(|r| (number, &r.initial[..], &r.actions[..])));
        }
        for (source, targets, actions) in defaults {
            states[usize::from(source)].initial = self.fits(transitions.len());
            let targets: Vec<u16> = targets.iter().map(|id| self.numbers[id.0]).collect();
            transitions.push(Transition {
                source,
                targets: self.list(targets),
                trigger: Trigger::Eventless,
                condition: rc_machine::Condition::Always,
                domain: NONE,
                through_history: false,
                internal: false,
                actions: self.block(actions),
            });
        }
        let histories = states.iter().filter(|s| s.kind.is_history()).count();
        let mut chart = Chart {
            name: Cow::Owned(machine.name.text.clone()),
            states: Cow::Owned(states),
            transitions: Cow::Owned(transitions),
            events: owned(self.events.clone()),
            fireable,
            execution_error: self.matched(EXECUTION),
            communication_error: self.matched(COMMUNICATION),
            histories: histories as u16,
            lists: Cow::Owned(self.lists),
            blocks: Cow::Owned(self.blocks),
            actions: Cow::Owned(self.actions),
            texts: owned(self.texts),
            guards: owned(self.guards),
            functions: owned(self.functions),
        };
        if self.too_large || chart.transitions.len() >= usize::from(NONE) {
            return Err(TooLarge);
        }
        domains(&mut chart);
        Ok(chart)
    }

    /// All states without their transitions.
    fn states(&mut self) -> Vec<State> {
        let machine = self.machine;
        let count = self.order.len() + 1;
        let mut states = vec![State {
            name: Cow::Owned(machine.name.text.clone()),
            path: Cow::Borrowed(""),
            kind: Kind::Compound,
            parent: NONE,
            end: self.fits(count),
            initial: NONE,
            transitions: Range::default(),
            histories: Range::default(),
            history: NONE,
            entry: Range::default(),
            exit: Range::default(),
            done: NONE,
        }];
        let mut histories = 0;
        for id in self.order.clone() {
            let state = machine.state(id);
            let parent = state.parent.map_or(0, |parent| self.numbers[parent.0]);
            let name = &state.name.text;
            let path = match parent {
                0 => name.clone(),
                parent => format!("{}.{name}", states[usize::from(parent)].path),
            };
            let kind = match (state.kind, &state.region) {
                (StateKind::History { deep: true }, _) => Kind::Deep,
                (StateKind::History { deep: false }, _) => Kind::Shallow,
                (StateKind::End, _) => Kind::Final,
                (StateKind::Plain, None) => Kind::Atomic,
                (StateKind::Plain, Some(region)) if region.parallel => Kind::Parallel,
                (StateKind::Plain, Some(region)) if only_history(machine, region) => Kind::Atomic,
                (StateKind::Plain, Some(_)) => Kind::Compound,
            };
            let inner = state.region.iter().flat_map(|region| &region.states);
            let remember: Vec<u16> = inner
                .filter(|id| matches!(machine.state(**id).kind, StateKind::History { .. }))
                .map(|id| self.numbers[id.0])
                .collect();
            let history = if kind.is_history() { histories } else { NONE };
            histories += u16::from(kind.is_history());
            states.push(State {
                name: Cow::Owned(name.clone()),
                path: Cow::Owned(path),
                kind,
                parent,
                end: self.numbers[id.0] + 1,
                initial: NONE,
                transitions: Range::default(),
                histories: self.list(remember),
                history,
                entry: self.blocks(&state.on_entry),
                exit: self.blocks(&state.on_exit),
                done: self.matched(&format!("done.state.{name}")),
            });
        }
        for at in (1..states.len()).rev() {
            let (end, parent) = (states[at].end, usize::from(states[at].parent));
            states[parent].end = states[parent].end.max(end);
        }
        states
    }

    fn blocks(&mut self, blocks: &[Vec<Action>]) -> Range {
        let start = self.blocks.len();
        for block in blocks {
            let made = self.block(block);
            self.blocks.push(made);
        }
        self.range(start, self.blocks.len())
    }

    fn transition(&mut self, source: u16, transition: &model::Transition) -> Transition {
        let targets: Vec<u16> = transition
            .targets
            .iter()
            .map(|id| self.numbers[id.0])
            .collect();
        let descriptors = &transition.events;
        let trigger = if descriptors.is_empty() {
            Trigger::Eventless
        } else if descriptors.iter().any(|d| d.text == "*") {
            Trigger::Any
        } else {
            let events = self.events.iter().enumerate();
            let events = events.filter(|(_, e)| descriptors.iter().any(|d| matches(&d.text, e)));
            let events: Vec<u16> = events.map(|(at, _)| at as u16).collect();
            Trigger::Events(self.list(events))
        };
        Transition {
            source,
            targets: self.list(targets),
            trigger,
            condition: match &transition.cond {
                None => rc_machine::Condition::Always,
                Some(Condition::In(id, _)) => rc_machine::Condition::In(self.numbers[id.0]),
                Some(Condition::Guard(name)) => {
                    rc_machine::Condition::Guard(self.id_of(&name.text, |t| &mut t.guards))
                }
            },
            domain: NONE,
            through_history: false,
            internal: transition.internal,
            actions: self.block(&transition.actions),
        }
    }
}

/// Whether a region has no state that can be active.
fn only_history(machine: &StateMachine, region: &Region) -> bool {
    let mut states = region.states.iter();
    states.all(|id| matches!(machine.state(*id).kind, StateKind::History { .. }))
}

fn owned(texts: Vec<String>) -> Cow<'static, [Cow<'static, str>]> {
    texts.into_iter().map(Cow::Owned).collect()
}

/// Sets the domains of transitions: `getTransitionDomain` of SCXML.
fn domains(chart: &mut Chart) {
    let decided: Vec<(u16, bool)> = chart
        .transitions
        .iter()
        .map(|transition| {
            let targets = chart.list(transition.targets);
            let through_history = targets.iter().any(|t| chart.state(*t).kind.is_history());
            if targets.is_empty() || through_history || transition.source == 0 {
                return (NONE, through_history);
            }
            let inside = |state: u16| targets.iter().all(|t| chart.is_descendant(*t, state));
            let source = transition.source;
            let compound = |state: u16| chart.state(state).kind == Kind::Compound;
            if transition.internal && compound(source) && inside(source) {
                return (source, false);
            }
            let mut outer = chart.ancestors(source, NONE);
            let domain = outer.find(|state| compound(*state) && inside(*state));
            (domain.unwrap_or(0), false)
        })
        .collect();
    for (transition, (domain, through_history)) in
        chart.transitions.to_mut().iter_mut().zip(decided)
    {
        transition.domain = domain;
        transition.through_history = through_history;
    }
}
