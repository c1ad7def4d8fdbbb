//! Builds a state machine from SMDSL or SCXML: first all states are declared, then names are
//! resolved.

use crate::check::check;
use crate::model::{Region, State, StateId, StateKind, StateMachine};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use std::collections::HashMap;

/// The number of name comparisons per file for suggestions.
const SUGGESTION_BUDGET: usize = 100_000;

/// An unfinished machine with a lookup of its states.
pub(crate) struct MachineBuilder {
    pub(crate) machine: StateMachine,
    pub(crate) found: Diagnostics,
    /// Whether all declarations of states were parsed.
    complete: bool,
    by_name: HashMap<String, StateId>,
    by_lowercase_name: HashMap<String, StateId>,
    suggestion_budget: usize,
}

impl MachineBuilder {
    pub(crate) fn new(name: Name, doc: Vec<String>, complete: bool, found: Diagnostics) -> Self {
        Self {
            machine: StateMachine {
                top: Region {
                    doc,
                    ..empty_region(name.span)
                },
                name,
                states: Vec::new(),
                transitions: Vec::new(),
                references: Vec::new(),
            },
            found,
            complete,
            by_name: HashMap::new(),
            by_lowercase_name: HashMap::new(),
            suggestion_budget: SUGGESTION_BUDGET,
        }
    }

    pub(crate) fn error(&mut self, code: &'static str, span: Span, message: impl Into<String>) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    /// Adds a state. A duplicate stays in the model, but its name refers to the first state.
    pub(crate) fn declare(&mut self, name: Name, doc: Vec<String>, kind: StateKind) -> StateId {
        let id = StateId(self.machine.states.len());
        if !name.text.is_empty() {
            let folded = name.text.to_lowercase();
            let first = *self.by_lowercase_name.entry(folded).or_insert(id);
            self.by_name.entry(name.text.clone()).or_insert(id);
            if first != id {
                let first = &self.machine.state(first).name;
                let message = if first.text == name.text {
                    format!("state `{}` is declared twice", name.text)
                } else {
                    let (one, two) = (&first.text, &name.text);
                    format!("states `{one}` and `{two}` differ only in case")
                };
                self.found.push(
                    Diagnostic::error("duplicate-state", name.span, message)
                        .label(first.span, "first declared here"),
                );
            }
        }
        self.machine.states.push(State {
            name,
            doc,
            kind,
            parent: None,
            region: None,
            on_entry: Vec::new(),
            on_exit: Vec::new(),
        });
        id
    }

    /// Looks up a state by name. Reports an error if there is none.
    pub(crate) fn find(&mut self, name: &Name) -> Option<StateId> {
        let id = self.by_name.get(&name.text).copied();
        match id {
            Some(id) => self.machine.references.push((name.span, id)),
            None => self.unknown(name),
        }
        id
    }

    fn unknown(&mut self, name: &Name) {
        let diagnostic = Diagnostic::error(
            "unknown-state",
            name.span,
            format!("unknown state `{}`", name.text),
        );
        let folded = self.by_lowercase_name.get(&name.text.to_lowercase());
        let mut near = folded.map(|id| self.machine.state(*id).name.text.as_str());
        let states = &self.machine.states;
        if near.is_none() && self.suggestion_budget >= states.len() {
            self.suggestion_budget -= states.len();
            let names = states.iter().map(|s| s.name.text.as_str());
            near = rc_diagnostics::nearest(&name.text, names);
        }
        if near.is_some() {
            self.found.push(diagnostic.did_you_mean(&name.text, near));
        } else if self.complete {
            self.found.push(diagnostic);
        }
    }

    /// Checks the machine and returns it.
    pub(crate) fn finish(mut self) -> (StateMachine, Diagnostics) {
        check(&self.machine, &mut self.found);
        (self.machine, self.found)
    }
}

/// A region without states.
pub(crate) fn empty_region(span: Span) -> Region {
    Region {
        doc: Vec::new(),
        parallel: false,
        initial: Vec::new(),
        actions: Vec::new(),
        states: Vec::new(),
        span,
    }
}
