//! The clause `reactions`: what follows what.

use crate::ast::{self, OperationPath};
use crate::model::{Collect, Reaction, Role, Slot, Step};
use crate::resolver::Resolver;
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::Literal;
use rc_vocabulary::duration;
use std::collections::{HashMap, HashSet};
use std::time::Duration;

/// The word for the periodic function.
pub(super) const COMPUTE: &str = "compute";

/// A place in a reaction.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Cause,
    Effect,
}

impl Side {
    /// Whether a slot of this role is allowed here.
    fn takes(self, role: Role) -> bool {
        let receives = matches!(role, Role::Implements | Role::SubscribesTo);
        receives == (self == Self::Cause)
    }

    const fn expected(self) -> &'static str {
        match self {
            Self::Cause => "implements or subscribes to",
            Self::Effect => "requires or publishes",
        }
    }
}

impl Resolver<'_> {
    /// The reactions, one for each cause.
    pub(super) fn reactions(
        &mut self,
        declared: &[ast::Reaction],
        slots: &[Slot],
        collects: &[Collect],
        period: Duration,
    ) -> Vec<Reaction> {
        let mut out: Vec<Reaction> = Vec::new();
        let mut seen: HashMap<Step, Span> = HashMap::new();
        for tree in declared {
            let budget = tree.budget.as_ref().and_then(|b| self.budget(b, period));
            let effects = tree.effects.iter();
            let mut effects: Vec<Step> = effects
                .filter_map(|path| self.step(path, slots, Side::Effect))
                .collect();
            // A repeated one means nothing more.
            let mut known = HashSet::new();
            effects.retain(|effect| known.insert(effect.clone()));
            for path in &tree.causes {
                let collected = collects.iter().find(|collect| {
                    path.slot.is_none() && collect.name.text == path.operation.text
                });
                let cause = match collected {
                    Some(collect) => Some(Step::Collected(collect.name.text.clone())),
                    None => self.step(path, slots, Side::Cause),
                };
                let Some(cause) = cause else {
                    continue;
                };
                if cause == Step::Compute && effects.contains(&Step::Compute) {
                    let message = "`compute` cannot follow `compute`: it runs with each period";
                    let error = Diagnostic::error("bad-reaction", path.span(), message);
                    self.found
                        .push(error.help("name the messages that it sends"));
                    continue;
                }
                if let Some(first) = seen.insert(cause.clone(), path.span()) {
                    let message = format!("`{}` has two reactions", path.operation.text);
                    let error = Diagnostic::error("repeated-reaction", path.span(), message);
                    let error = error.label(first, "the first one");
                    self.found
                        .push(error.help("write all that follows into one of them"));
                    continue;
                }
                out.push(Reaction {
                    cause,
                    effects: effects.clone(),
                    budget,
                });
            }
        }
        out
    }

    fn budget(&mut self, literal: &Literal, period: Duration) -> Option<Duration> {
        let time = literal.as_nanoseconds().filter(|ns| *ns > 0);
        let Some(time) = time.map(Duration::from_nanos) else {
            let message = "`budget` takes a duration of more than 0, such as `2ms`";
            let error = Diagnostic::error("bad-budget", literal.span, message);
            self.found.push(error);
            return None;
        };
        if time > period {
            self.found.push(over_period(literal.span, time, period));
        }
        Some(time)
    }

    /// `compute`, or an operation of a slot that is allowed on this side.
    pub(super) fn step(
        &mut self,
        path: &OperationPath,
        slots: &[Slot],
        side: Side,
    ) -> Option<Step> {
        let name = &path.operation.text;
        if path.slot.is_none() && name.eq_ignore_ascii_case(COMPUTE) {
            return Some(Step::Compute);
        }
        let named = slots.iter().filter(|slot| {
            let wanted = path.slot.as_ref();
            wanted.is_none_or(|wanted| wanted.text == slot.name)
        });
        let named: Vec<&Slot> = named.collect();
        if let Some(wanted) = path.slot.as_ref().filter(|_| named.is_empty()) {
            let message = format!("the component has no slot `{}`", wanted.text);
            let error = Diagnostic::error("unknown-slot", wanted.span, message);
            let known = slots.iter().map(|slot| slot.name.as_str());
            self.found.push(error.suggest(&wanted.text, known));
            return None;
        }
        let has = |slot: &Slot| {
            let operations = &self.library.interface(slot.interface).operations;
            operations.iter().any(|o| o.name.text == *name)
        };
        let having: Vec<&Slot> = named.iter().copied().filter(|slot| has(slot)).collect();
        let fitting = having.iter().filter(|slot| side.takes(slot.role));
        let fitting: Vec<&&Slot> = fitting.collect();
        let error = match (&fitting[..], having.first()) {
            ([slot], _) => {
                return Some(Step::Operation {
                    slot: slot.name.clone(),
                    operation: name.clone(),
                });
            }
            ([first, ..], _) => {
                let message = format!("several slots have an operation `{name}`");
                let all = fitting.iter().map(|slot| format!("`{}.{name}`", slot.name));
                let all = all.collect::<Vec<_>>().join(" or ");
                Diagnostic::error("ambiguous-operation", path.span(), message)
                    .label(first.span, "one of them")
                    .help(format!("write {all}"))
            }
            ([], Some(slot)) => {
                let message = format!(
                    "expected an operation that the component {}, but it {} `{name}`",
                    side.expected(),
                    slot.role.word()
                );
                Diagnostic::error("bad-reaction", path.span(), message)
                    .label(slot.span, "declared here")
                    .help("write what the component receives left of `->`, and what it sends right of it")
            }
            ([], None) => {
                let message = format!("no slot has an operation `{name}`");
                let fitting = named.iter().filter(|slot| side.takes(slot.role));
                let known = fitting.flat_map(|slot| {
                    let operations = &self.library.interface(slot.interface).operations;
                    operations.iter().map(|o| o.name.text.as_str())
                });
                Diagnostic::error("unknown-operation", path.operation.span, message)
                    .suggest(name, known.chain([COMPUTE]))
            }
        };
        // An operation of an unknown interface is not reported a second time.
        let is_incomplete = !self.failed_imports.is_empty()
            || self.found.iter().any(|d| d.code == "unknown-interface");
        if !is_incomplete || !having.is_empty() {
            self.found.push(error);
        }
        None
    }
}

/// A budget that is longer than the period.
fn over_period(span: Span, budget: Duration, period: Duration) -> Diagnostic {
    let message = format!(
        "a budget of {} is longer than the period of {}: each run that needs it is an overrun",
        duration::text_of(budget),
        duration::text_of(period)
    );
    Diagnostic::error("budget-over-period", span, message)
        .help("shorten the budget, or lengthen `period`")
}
