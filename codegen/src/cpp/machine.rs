//! The state machine of a component in C++.

use super::names;
use crate::{description, view};
use heck::ToSnakeCase;
use serde::Serialize;

/// A state machine as its templates see it.
#[derive(Debug, Serialize)]
pub(crate) struct Machine<'a> {
    name: &'a str,
    doc: &'a [String],
    states: Vec<State<'a>>,
    /// The `during` functions that a new worker has: an end state is entered only.
    durings: Vec<During<'a>>,
    events: Vec<Event<'a>>,
    pub(super) guards: Vec<Numbered>,
    pub(super) actions: Vec<Numbered>,
}

#[derive(Debug, Serialize)]
struct State<'a> {
    path: &'a str,
    doc: &'a [String],
    name: String,
    number: u16,
    /// The last part of the names of its functions.
    suffix: String,
}

#[derive(Debug, Serialize)]
struct During<'a> {
    path: &'a str,
    suffix: String,
}

#[derive(Debug, Serialize)]
struct Event<'a> {
    smdsl: &'a str,
    name: String,
    number: usize,
}

#[derive(Debug, Serialize)]
pub(super) struct Numbered {
    pub(super) name: String,
    number: usize,
}

pub(crate) fn of(view: &view::Machine) -> Machine<'_> {
    let functions = |all: &[String]| {
        let all = all.iter().enumerate();
        let all = all.map(|(number, name)| Numbered {
            name: names::own(&name.to_snake_case()),
            number,
        });
        all.collect()
    };
    let states = view.states.iter().map(|state| State {
        path: &state.path,
        doc: &state.doc,
        name: names::camel(&state.name),
        number: state.number,
        suffix: description::state_suffix(&state.name),
    });
    let durings = view.states.iter().filter(|state| !state.is_end);
    let durings = durings.map(|state| During {
        path: &state.path,
        suffix: description::state_suffix(&state.name),
    });
    let events = view.events.iter().enumerate();
    Machine {
        name: &view.name,
        doc: &view.doc,
        states: states.collect(),
        durings: durings.collect(),
        events: events
            .map(|(number, event)| Event {
                smdsl: event,
                name: names::camel(event),
                number,
            })
            .collect(),
        guards: functions(&view.guards),
        actions: functions(&view.actions),
    }
}
