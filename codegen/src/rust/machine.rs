//! Names of Rust for the state machine of a component, and its tables.

use super::handlers::Handler;
use super::names;
use super::state_names::hook;
use crate::view;
use rc_machine::{Chart, Condition, NONE, Range, Trigger};
use serde::Serialize;

/// The trait that the worker implements.
pub(crate) const TRAIT: &str = "StateMachine";

/// A state machine as its template sees it.
#[derive(Debug, Serialize)]
pub(crate) struct Machine<'a> {
    name: &'a str,
    doc: &'a [String],
    pub(crate) states: Vec<State<'a>>,
    events: Vec<Event<'a>>,
    /// The numbers of the events that may be fired from outside.
    external: &'a [u16],
    guards: Vec<String>,
    actions: Vec<String>,
    /// The events that RoboComp's template of a machine fires itself: after the start, and in each
    /// period in a state.
    first_event: String,
    period: String,
    tables: Tables,
}

/// One state.
#[derive(Debug, Serialize)]
pub(crate) struct State<'a> {
    path: &'a str,
    number: u16,
    variant: String,
    doc: &'a [String],
    pub(crate) entry: String,
    pub(crate) exit: String,
    pub(crate) during: String,
}

#[derive(Debug, Serialize)]
struct Event<'a> {
    name: &'a str,
    variant: String,
}

/// The tables, each entry as it is written in Rust.
#[derive(Debug, Serialize)]
struct Tables {
    name: String,
    states: Vec<String>,
    transitions: Vec<String>,
    events: Vec<String>,
    fireable: u16,
    lists: Vec<u16>,
    blocks: Vec<String>,
    actions: Vec<String>,
    texts: Vec<String>,
    guards: Vec<String>,
    functions: Vec<String>,
    execution_error: u16,
    communication_error: u16,
    histories: u16,
}

pub(crate) fn of(view: &view::Machine) -> Machine<'_> {
    let event = |wanted: &str| {
        let is_template = view.name.eq_ignore_ascii_case("defaultMachine");
        let mut events = view.events.iter().filter(|_| is_template);
        events.position(|event| event.eq_ignore_ascii_case(wanted))
    };
    let mut states = view.states.iter();
    let state = states.find(|state| state.name.eq_ignore_ascii_case("compute"));
    let period = state.zip(event("ComputeToCompute"));
    let period = period.map(|(state, event)| (state.number, event));
    Machine {
        name: &view.name,
        doc: &view.doc,
        states: view
            .states
            .iter()
            .map(|state| State {
                path: &state.path,
                number: state.number,
                variant: names::camel(&state.name),
                doc: &state.doc,
                entry: hook("entry", &state.name),
                exit: hook("exit", &state.name),
                during: hook("during", &state.name),
            })
            .collect(),
        events: view
            .events
            .iter()
            .map(|name| Event {
                name,
                variant: names::camel(name),
            })
            .collect(),
        external: &view.external,
        guards: view.guards.iter().map(|name| names::snake(name)).collect(),
        actions: view.actions.iter().map(|name| names::snake(name)).collect(),
        first_event: format!("{:?}", event("InitializeToCompute")),
        period: format!("{period:?}"),
        tables: tables(&view.chart),
    }
}

/// The functions that the worker must write.
pub(crate) fn functions(view: &view::Machine) -> Vec<Handler> {
    let guards = view
        .guards
        .iter()
        .map(|name| Handler::guard(&names::snake(name)));
    let actions = view
        .actions
        .iter()
        .map(|name| Handler::action(&names::snake(name)));
    guards.chain(actions).collect()
}

fn tables(chart: &Chart) -> Tables {
    let texts = |texts: &[std::borrow::Cow<'static, str>]| {
        let texts = texts.iter();
        texts
            .map(|text| format!("Cow::Borrowed({text:?})"))
            .collect::<Vec<_>>()
    };
    Tables {
        name: format!("{:?}", chart.name),
        states: chart.states.iter().map(state).collect(),
        transitions: chart.transitions.iter().map(transition).collect(),
        events: texts(&chart.events),
        fireable: chart.fireable,
        lists: chart.lists.to_vec(),
        blocks: chart.blocks.iter().map(|block| range(*block)).collect(),
        actions: chart
            .actions
            .iter()
            .map(|a| format!("Action::{a:?}"))
            .collect(),
        texts: texts(&chart.texts),
        guards: texts(&chart.guards),
        functions: texts(&chart.functions),
        execution_error: chart.execution_error,
        communication_error: chart.communication_error,
        histories: chart.histories,
    }
}

fn number(number: u16) -> String {
    if number == NONE {
        "NONE".to_owned()
    } else {
        number.to_string()
    }
}

fn range(range: Range) -> String {
    format!("{range:?}")
}

fn state(state: &rc_machine::State) -> String {
    format!(
        "State {{ name: Cow::Borrowed({:?}), path: Cow::Borrowed({:?}), kind: Kind::{:?}, parent: {}, end: {}, \
         initial: {}, transitions: {}, histories: {}, history: {}, entry: {}, exit: {}, done: {} }}",
        state.name,
        state.path,
        state.kind,
        number(state.parent),
        state.end,
        number(state.initial),
        range(state.transitions),
        range(state.histories),
        number(state.history),
        range(state.entry),
        range(state.exit),
        number(state.done),
    )
}

fn transition(transition: &rc_machine::Transition) -> String {
    let trigger = match transition.trigger {
        Trigger::Events(events) => format!("Trigger::Events({})", range(events)),
        other @ (Trigger::Eventless | Trigger::Any) => format!("Trigger::{other:?}"),
    };
    let condition: Condition = transition.condition;
    format!(
        "Transition {{ source: {}, targets: {}, trigger: {trigger}, condition: Condition::{condition:?}, domain: {}, \
         through_history: {}, internal: {}, actions: {} }}",
        transition.source,
        range(transition.targets),
        number(transition.domain),
        transition.through_history,
        transition.internal,
        range(transition.actions),
    )
}
