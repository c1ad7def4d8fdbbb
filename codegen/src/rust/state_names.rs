//! Names of Rust for the states, events and functions of a state machine.

use super::names;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_smdsl::StateMachine;

/// The functions of every worker. One of a machine cannot have their names: a call of it would be
/// ambiguous.
const WORKER: [&str; 6] = [
    "initialize",
    "compute",
    "params_changed",
    "emergency",
    "restore",
    "finalize",
];

/// The function of a state.
pub(crate) fn hook(what: &str, state: &str) -> String {
    format!("{what}_{}", names::snake(state).trim_end_matches('_'))
}

/// Reports names of states, events and functions that are not names of Rust, or become one.
pub(crate) fn check(machine: &StateMachine, found: &mut Diagnostics) {
    let Ok(chart) = rc_smdsl::tables::of(machine) else {
        return;
    };
    let mut names: Vec<(&str, &str, String)> = Vec::new();
    for state in &machine.states {
        let name = &state.name;
        if !is_name(&names::camel(&name.text)) || !is_name(&hook("entry", &name.text)) {
            let message = format!("state `{}` cannot be written in Rust", name.text);
            let help = "use letters, digits and `_`";
            found.push(Diagnostic::error("name-collision", name.span, message).help(help));
        }
        names.push(("state", &name.text, hook("entry", &name.text)));
    }
    for event in &chart.events[..usize::from(chart.fireable)] {
        if !is_name(&names::camel(event)) {
            let message = format!("event `{event}` cannot be written in Rust");
            let help = "use letters, digits, `_`, and `.` between words";
            let place = machine.name.span;
            found.push(Diagnostic::error("name-collision", place, message).help(help));
        }
        names.push(("event", event, names::camel(event)));
    }
    let hooks: Vec<String> = machine
        .states
        .iter()
        .flat_map(|s| ["entry", "exit", "during"].map(|what| hook(what, &s.name.text)))
        .collect();
    for function in chart.guards.iter().chain(chart.functions.iter()) {
        let name = names::snake(function);
        if WORKER.contains(&name.as_str()) {
            let message =
                format!("the function `{function}` has the name of a function of the worker");
            let help = "give the function another name";
            let place = machine.name.span;
            found.push(Diagnostic::error("name-collision", place, message).help(help));
        }
        if hooks.contains(&name) {
            let message =
                format!("the function `{function}` has the name of a function of a state");
            found.push(Diagnostic::error(
                "name-collision",
                machine.name.span,
                message,
            ));
        }
        names.push(("function", function, name));
    }
    for (at, (kind, name, rust)) in names.iter().enumerate() {
        let same = |(other, _, text): &&(&str, &str, String)| other == kind && text == rust;
        if let Some((_, other, _)) = names[..at].iter().find(same) {
            let states = &machine.states;
            let place = states.iter().find(|state| state.name.text == **name);
            let place = place.map_or(machine.name.span, |state| state.name.span);
            let message = if other == name {
                format!("the function `{name}` is both a guard and an action")
            } else {
                format!("{kind}s `{other}` and `{name}` are both `{rust}` in Rust")
            };
            found.push(Diagnostic::error("name-collision", place, message));
        }
    }
}

fn is_name(text: &str) -> bool {
    syn::parse_str::<syn::Ident>(text).is_ok()
}
