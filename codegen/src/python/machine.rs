//! Names of Python for the state machine of a component.

use super::{documentation, names};
use crate::{description, view};
use serde::Serialize;

/// A state machine as its template sees it.
#[derive(Debug, Serialize)]
pub(crate) struct Machine<'a> {
    name: &'a str,
    doc: String,
    states: Vec<State<'a>>,
    events: Vec<Event<'a>>,
    /// The functions that the worker must write.
    functions: Vec<super::handlers::Handler>,
}

impl Machine<'_> {
    /// Last parts of the names of the states' functions.
    pub(crate) fn suffixes(&self) -> impl Iterator<Item = &str> {
        self.states.iter().map(|state| state.suffix.as_str())
    }
}

#[derive(Debug, Serialize)]
struct State<'a> {
    path: &'a str,
    name: String,
    number: u16,
    doc: String,
    suffix: String,
}

#[derive(Debug, Serialize)]
struct Event<'a> {
    idsl: &'a str,
    name: String,
    number: usize,
}

pub(crate) fn of(view: &view::Machine) -> Machine<'_> {
    Machine {
        name: &view.name,
        doc: documentation::docstring_or(
            0,
            &view.doc,
            format!("The state machine `{}`.", view.name),
        ),
        states: view
            .states
            .iter()
            .map(|state| State {
                path: &state.path,
                name: names::shout(&state.name),
                number: state.number,
                doc: documentation::docstring_or(4, &state.doc, format!("`{}`", state.path)),
                suffix: description::state_suffix(&state.name),
            })
            .collect(),
        events: view
            .events
            .iter()
            .enumerate()
            .map(|(number, event)| Event {
                idsl: event,
                name: names::shout(event),
                number,
            })
            .collect(),
        functions: super::handlers::of_machine(view),
    }
}
