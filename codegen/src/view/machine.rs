//! The state machine of a component.

use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_machine::{Chart, Kind};
use rc_smdsl::StateMachine;
use serde::Serialize;

/// A state machine.
#[derive(Debug, Serialize)]
pub struct Machine {
    /// Name of the machine in the `.smdsl`.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// The states that can be active, in document order.
    pub states: Vec<State>,
    /// The events that the worker can fire.
    pub events: Vec<String>,
    /// The events that may be fired from outside of the component, as their places in `events`.
    pub external: Vec<u16>,
    /// The functions that guard transitions.
    pub guards: Vec<String>,
    /// The functions that are actions.
    pub actions: Vec<String>,
    /// The tables of the interpreter.
    #[serde(skip)]
    pub chart: Chart,
}

/// One state.
#[derive(Debug, Serialize)]
pub struct State {
    /// Name, unique in the machine.
    pub name: String,
    /// The names of its ancestors and its own, joined by dots.
    pub path: String,
    /// Number in the tables.
    pub number: u16,
    /// Whether it is an end state.
    pub is_end: bool,
    /// Lines of documentation.
    pub doc: Vec<String>,
}

/// The view of a machine without errors, which the component names so.
pub(super) fn of(
    machine: &StateMachine,
    named: &rc_cdsl::model::StateMachine,
    found: &mut Diagnostics,
) -> Option<Machine> {
    let Ok(chart) = rc_smdsl::tables::of(machine) else {
        let message =
            "the state machine has more states or transitions than the 65534 of its tables";
        let place = named.file.span;
        found.push(Diagnostic::error("machine-too-large", place, message));
        return None;
    };
    let doc = |name: &str| {
        let mut states = machine.states.iter();
        let state = states.find(|state| state.name.text == name);
        state.map(|state| state.doc.clone()).unwrap_or_default()
    };
    let events = &chart.events[..usize::from(chart.fireable)];
    let place_of = |name: &str| events.iter().position(|event| event == name);
    let external = named.external.iter().filter_map(|e| place_of(&e.text));
    let states = chart.states.iter().enumerate().skip(1);
    let states = states.filter(|(_, state)| !state.kind.is_history());
    Some(Machine {
        name: machine.name.text.clone(),
        doc: machine.top.doc.clone(),
        states: states
            .map(|(number, state)| State {
                name: state.name.to_string(),
                path: state.path.to_string(),
                number: number as u16,
                is_end: state.kind == Kind::Final,
                doc: doc(&state.name),
            })
            .collect(),
        events: events.iter().map(ToString::to_string).collect(),
        external: external.map(|at| at as u16).collect(),
        guards: chart.guards.iter().map(ToString::to_string).collect(),
        actions: chart.functions.iter().map(ToString::to_string).collect(),
        chart,
    })
}
