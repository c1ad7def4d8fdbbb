//! Checks of a state machine, independent of its source language.

use crate::model::{Condition, StateId, StateKind, StateMachine, Transition};
use crate::tables::{covers, stem};
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::collections::HashMap;

/// The maximum nesting of states, so that later passes may recurse.
pub(crate) const MAX_NESTING: usize = 100;

/// Checks a machine whose names are resolved.
pub(crate) fn check(machine: &StateMachine, found: &mut Diagnostics) {
    nesting(machine, found);
    end_states(machine, found);
    // After an error, an unreachable state or a repeated transition may be the intended one.
    if found.has_errors() {
        return;
    }
    duplicate_transitions(machine, found);
    shadowed_transitions(machine, found);
    if machine.transitions.is_empty() {
        let message = format!(
            "state machine `{}` has no transitions: it stays in its initial state",
            machine.name.text
        );
        found.push(Diagnostic::warning(
            "no-transitions",
            machine.name.span,
            message,
        ));
    } else {
        unreachable(machine, found);
    }
}

/// Reports states that contain themselves and states that are nested too deep.
fn nesting(machine: &StateMachine, found: &mut Diagnostics) {
    // The depth of each state, from 1. 0 if not visited yet.
    let mut depths = vec![0_usize; machine.states.len()];
    // The index of each state on the current path to the root.
    let mut met = vec![usize::MAX; machine.states.len()];
    let mut too_deep = false;
    for start in machine.ids() {
        let mut path: Vec<StateId> = Vec::new();
        let mut next = Some(start);
        let mut depth = 0;
        while let Some(id) = next {
            if depths[id.0] > 0 {
                depth = depths[id.0];
                break;
            }
            if met[id.0] != usize::MAX {
                found.push(parent_cycle(machine, &path[met[id.0]..]));
                break;
            }
            met[id.0] = path.len();
            path.push(id);
            next = machine.state(id).parent;
        }
        for id in path.iter().rev() {
            depth += 1;
            depths[id.0] = depth;
            if depth > MAX_NESTING && !too_deep {
                too_deep = true;
                let message = format!("states are nested more than {MAX_NESTING} levels deep");
                let span = machine.state(*id).name.span;
                found.push(Diagnostic::error("nested-too-deep", span, message));
            }
        }
    }
}

/// Reports states that contain each other. Each state is inside the next, the last inside the
/// first.
fn parent_cycle(machine: &StateMachine, states: &[StateId]) -> Diagnostic {
    let mut names: Vec<String> = states
        .iter()
        .map(|id| format!("`{}`", machine.state(*id).name.text))
        .collect();
    names.extend(names.first().cloned());
    let mut spans = states
        .iter()
        .filter_map(|id| machine.state(*id).region.as_ref())
        .map(|region| region.span);
    let first = spans.next().unwrap_or(machine.name.span);
    let message = format!("a state cannot contain itself: {}", names.join(" inside "));
    let diagnostic = Diagnostic::error("circular-parents", first, message);
    spans.fold(diagnostic, |d, span| d.label(span, "also this block"))
}

/// Reports end states with substates and transitions out of end states.
fn end_states(machine: &StateMachine, found: &mut Diagnostics) {
    for state in machine.states.iter().filter(|s| s.kind == StateKind::End) {
        if let Some(region) = &state.region {
            let message = format!("end state `{}` has substates", state.name.text);
            found.push(
                Diagnostic::error("end-state-with-substates", region.span, message)
                    .label(state.name.span, "declared here"),
            );
        }
    }
    for transition in &machine.transitions {
        let source = machine.state(transition.source);
        if source.kind == StateKind::End {
            let name = &source.name.text;
            let message = format!("transition out of the end state `{name}`");
            found.push(
                Diagnostic::error("transition-from-end-state", transition.span, message)
                    .label(source.name.span, "declared here"),
            );
        }
    }
}

fn duplicate_transitions(machine: &StateMachine, found: &mut Diagnostics) {
    fn key(t: &Transition) -> (StateId, &[StateId], Vec<&str>, Option<&str>) {
        let events = t.events.iter().map(|e| e.text.as_str()).collect();
        (
            t.source,
            &t.targets,
            events,
            t.cond.as_ref().map(Condition::text),
        )
    }
    let mut seen = HashMap::new();
    for transition in &machine.transitions {
        let first = *seen.entry(key(transition)).or_insert(transition.span);
        if first == transition.span {
            continue;
        }
        let targets: Vec<&str> = transition
            .targets
            .iter()
            .map(|id| machine.state(*id).name.text.as_str())
            .collect();
        let message = format!(
            "duplicate transition `{} => {}`",
            machine.state(transition.source).name.text,
            targets.join(" ")
        );
        found.push(
            Diagnostic::warning("duplicate-transition", transition.span, message)
                .label(first, "first declared here"),
        );
    }
}

/// Reports transitions after one of the same state that needs no guard and takes their events.
fn shadowed_transitions(machine: &StateMachine, found: &mut Diagnostics) {
    // Found by state and descriptor, so that the check is linear in the length of the file.
    let mut unguarded: HashMap<(StateId, &str), Vec<&Transition>> = HashMap::new();
    for transition in &machine.transitions {
        let takes = |first: &&&Transition| {
            let covered = |event: &rc_syntax::Name| {
                let mut descriptors = first.events.iter();
                descriptors.any(|d| covers(&d.text, &event.text))
            };
            first.events.is_empty() == transition.events.is_empty()
                && transition.events.iter().all(covered)
                // A repeated one is a duplicate.
                && (first.targets != transition.targets || transition.cond.is_some())
        };
        let event = transition.events.first().map_or("", |e| stem(&e.text));
        let ends = event.match_indices('.').map(|(at, _)| at);
        let prefixes = ends.map(|at| &event[..at]).chain([event, "*"]);
        let earlier = prefixes.filter_map(|key| unguarded.get(&(transition.source, key)));
        if let Some(first) = earlier.flatten().find(takes) {
            let source = &machine.state(transition.source).name.text;
            let message = format!("this transition of `{source}` is never taken");
            found.push(
                Diagnostic::warning("shadowed-transition", transition.span, message)
                    .label(first.span, "this one comes first, and has no `cond`"),
            );
        }
        if transition.cond.is_none() {
            let keys = transition.events.iter().map(|event| stem(&event.text));
            let eventless = transition.events.is_empty().then_some("");
            for key in keys.chain(eventless) {
                let of_key = unguarded.entry((transition.source, key)).or_default();
                of_key.push(transition);
            }
        }
    }
}

/// Reports unreachable states.
fn unreachable(machine: &StateMachine, found: &mut Diagnostics) {
    let entered = machine.entered();
    let mut is_target = vec![false; machine.states.len()];
    for transition in &machine.transitions {
        for target in transition
            .targets
            .iter()
            .filter(|t| **t != transition.source)
        {
            is_target[target.0] = true;
        }
    }
    let regions = machine.states.iter().filter_map(|s| s.region.as_ref());
    for region in regions.chain([&machine.top]) {
        let with_it = if region.parallel {
            &region.states
        } else {
            &region.initial
        };
        with_it.iter().for_each(|id| is_target[id.0] = true);
    }
    for id in machine.ids() {
        let state = machine.state(id);
        // Skip substates of unreachable states.
        if entered[id.0] || state.parent.is_some_and(|parent| !entered[parent.0]) {
            continue;
        }
        let name = &state.name;
        found.push(if is_target[id.0] {
            let message = format!(
                "state `{}` is not reachable from the initial state",
                name.text
            );
            Diagnostic::warning("unreachable-state", name.span, message)
        } else {
            let message = format!("no transition leads to state `{}`", name.text);
            Diagnostic::warning("no-way-in", name.span, message)
        });
    }
}
