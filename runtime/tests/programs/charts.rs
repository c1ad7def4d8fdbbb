//! A small state machine for tests: `a => b` by the event `go`, in the tables that `rcgen` would
//! print.

use rc_runtime::machine::{
    Action, Chart, Condition, Kind, NONE, Range, State, Transition, Trigger,
};
use std::borrow::Cow;

const fn range(start: u16, end: u16) -> Range {
    Range { start, end }
}

fn state(name: &'static str, kind: Kind, parent: u16, end: u16) -> State {
    State {
        name: Cow::Borrowed(name),
        path: Cow::Borrowed(name),
        kind,
        parent,
        end,
        initial: NONE,
        transitions: range(0, 0),
        histories: range(0, 0),
        history: NONE,
        entry: range(0, 0),
        exit: range(0, 0),
        done: NONE,
    }
}

fn transition(source: u16, targets: Range, trigger: Trigger, domain: u16) -> Transition {
    Transition {
        source,
        targets,
        trigger,
        condition: Condition::Always,
        domain,
        through_history: false,
        internal: false,
        actions: range(0, 0),
    }
}

/// The machine. `condition` guards the transition, and `on_entry` runs when `a` is entered.
pub(crate) fn chart(condition: Condition, on_entry: Vec<Action>) -> &'static Chart {
    let root = State {
        initial: 1,
        ..state("m", Kind::Compound, NONE, 3)
    };
    let a = State {
        transitions: range(0, 1),
        entry: range(0, 1),
        ..state("a", Kind::Atomic, 0, 2)
    };
    let go = Transition {
        condition,
        ..transition(1, range(0, 1), Trigger::Events(range(1, 2)), 0)
    };
    let initial = transition(0, range(2, 3), Trigger::Eventless, NONE);
    Box::leak(Box::new(Chart {
        name: Cow::Borrowed("m"),
        states: vec![root, a, state("b", Kind::Atomic, 0, 3)].into(),
        transitions: vec![go, initial].into(),
        events: vec![Cow::Borrowed("go")].into(),
        fireable: 1,
        lists: vec![2, 0, 1].into(),
        blocks: vec![range(0, on_entry.len() as u16)].into(),
        actions: on_entry.into(),
        texts: Cow::Borrowed(&[]),
        guards: vec![Cow::Borrowed("is_ready")].into(),
        functions: Cow::Borrowed(&[]),
        execution_error: NONE,
        communication_error: NONE,
        histories: 0,
    }))
}

/// The number of a state or an event.
#[derive(Clone, Copy)]
pub(crate) struct Number(pub(crate) u16);

impl rc_runtime::machine::Numbered for Number {
    fn number(self) -> u16 {
        self.0
    }
}
