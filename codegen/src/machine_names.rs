//! The states and events that a `.cdsl` names, compared with its state machine.

use rc_cdsl::Component;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_smdsl::StateMachine;
use rc_smdsl::model::StateKind;

/// Reports states and events that the machine does not have. The machine has no errors.
pub(crate) fn check(component: &Component, machine: &StateMachine, found: &mut Diagnostics) {
    let states = machine.states.iter();
    let active = states.filter(|state| !matches!(state.kind, StateKind::History { .. }));
    let states: Vec<&str> = active.map(|state| state.name.text.as_str()).collect();
    let name = &machine.name.text;
    for state in component.slots.iter().flat_map(|slot| &slot.available) {
        if !states.contains(&state.text.as_str()) {
            let message = format!("the state machine `{name}` has no state `{}`", state.text);
            let error = Diagnostic::error("unknown-state", state.span, message);
            found.push(error.suggest(&state.text, states.iter().copied()));
        }
    }
    let Ok(chart) = rc_smdsl::tables::of(machine) else {
        return;
    };
    let events = &chart.events[..usize::from(chart.fireable)];
    for event in component.state_machine.iter().flat_map(|m| &m.external) {
        if !events.iter().any(|known| **known == *event.text) {
            let message = format!("the state machine `{name}` has no event `{}`", event.text);
            let error = Diagnostic::error("unknown-event", event.span, message);
            found.push(error.suggest(&event.text, events.iter().map(|known| &**known)));
        }
    }
}
