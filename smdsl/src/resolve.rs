//! From the tree of SMDSL to the model.

use crate::ast::{self, Block, ItemKind};
use crate::model::{Machine, StateId, StateKind, Transition};
use crate::parse::parse;
use crate::states::{States, region};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::Name;
use std::collections::HashMap;

/// Reads, resolves and checks one `.smdsl` text.
pub(crate) fn load(sources: &SourceMap, source: SourceId) -> (Option<Machine>, Diagnostics) {
    let (file, found) = parse(sources, source);
    let Some(top) = file.machine else {
        return (None, found);
    };
    let mut states = States::new(top.name.clone(), top.doc.clone(), file.complete, found);
    let outer = declare(&mut states, &top, "the machine");
    states.machine.top.initial = outer.initial.into_iter().collect();
    states.machine.top.states = outer.all;
    let inner: Vec<Declared> = file
        .substates
        .iter()
        .map(|block| declare(&mut states, block, &format!("`{}`", block.name.text)))
        .collect();
    // A block may stand before the one that declares its parent, and a transition may lead into any block.
    for (block, declared) in file.substates.iter().zip(inner) {
        attach(&mut states, block, declared);
    }
    for block in std::iter::once(&top).chain(&file.substates) {
        transitions(&mut states, block);
    }
    let (machine, found) = states.finish();
    (Some(machine), found)
}

/// The states of one block.
struct Declared {
    initial: Option<StateId>,
    all: Vec<StateId>,
}

/// Declares the states of a block: the initial one, the others, the end state. `whose` names the block in messages.
fn declare(states: &mut States, block: &Block, whose: &str) -> Declared {
    once(states, block);
    let of = |wanted: fn(&ItemKind) -> Option<&Vec<ast::State>>| -> Vec<&ast::State> {
        block
            .items
            .iter()
            .filter_map(|i| wanted(&i.kind))
            .flatten()
            .collect()
    };
    let plain = of(|kind| match kind {
        ItemKind::States(list) => Some(list),
        _ => None,
    });
    let mut initial = of(|kind| match kind {
        ItemKind::Initial(list) => Some(list),
        _ => None,
    });
    let mut end = of(|kind| match kind {
        ItemKind::End(list) => Some(list),
        _ => None,
    });
    let parallel = block.parallel.is_some();
    if parallel {
        not_in_parallel(states, block);
    } else {
        one(states, &mut initial, "initial");
        one(states, &mut end, "end");
    }
    let marked: HashMap<&str, Span> = initial
        .iter()
        .chain(&end)
        .map(|state| (state.name.text.as_str(), state.name.span))
        .collect();
    let mut declared = Declared {
        initial: None,
        all: Vec::new(),
    };
    for state in &initial {
        let id = states.declare(state.name.clone(), state.doc.clone(), StateKind::Plain);
        declared.all.push(id);
        declared.initial.get_or_insert(id);
    }
    for state in plain {
        if let Some(first) = marked.get(state.name.text.as_str()) {
            let message = format!(
                "`{}` is the initial or the end state, and is not repeated under `states`",
                state.name.text
            );
            states.found.push(
                Diagnostic::warning("repeated-state", state.name.span, message)
                    .label(*first, "declared here"),
            );
            continue;
        }
        let id = states.declare(state.name.clone(), state.doc.clone(), StateKind::Plain);
        declared.all.push(id);
    }
    let kind = if parallel {
        StateKind::Plain
    } else {
        StateKind::End
    };
    for state in &end {
        let id = states.declare(state.name.clone(), state.doc.clone(), kind);
        declared.all.push(id);
    }
    // A clause that is there, but could not be read, has been reported.
    if block.complete && parallel && declared.all.is_empty() {
        states.error(
            "no-states",
            block.name.span,
            format!("{whose} has no states"),
        );
    }
    if block.complete && !parallel && declared.initial.is_none() {
        let message = format!("{whose} has no initial state");
        let diagnostic = Diagnostic::error("no-initial-state", block.name.span, message);
        states
            .found
            .push(diagnostic.help("add `initial_state NAME;`"));
    }
    declared
}

/// `states` and `transitions` come once in a block.
fn once(states: &mut States, block: &Block) {
    let mut seen: HashMap<&str, Span> = HashMap::new();
    for item in &block.items {
        let clause = match item.kind {
            ItemKind::States(_) => "states",
            ItemKind::Transitions(_) => "transitions",
            // A second one of these has a message of its own.
            ItemKind::Initial(_) | ItemKind::End(_) => continue,
        };
        let first = *seen.entry(clause).or_insert(item.word.span);
        if first != item.word.span {
            let message = format!("clause `{}` is repeated; each stands once", item.word.text);
            states.found.push(
                Diagnostic::error("repeated-clause", item.word.span, message)
                    .label(first, "the first one"),
            );
        }
    }
}

/// A block has one initial state and one end state; further ones are ordinary states, so that what names them has
/// something to name.
fn one(states: &mut States, named: &mut Vec<&ast::State>, what: &str) {
    let Some((first, others)) = named.split_first() else {
        return;
    };
    let code = if what == "initial" {
        "second-initial-state"
    } else {
        "second-end-state"
    };
    for other in others {
        let message = format!(
            "there is an {what} state already: `{}`; a block has one",
            first.name.text
        );
        states.found.push(
            Diagnostic::error(code, other.name.span, message)
                .label(first.name.span, "the first one"),
        );
    }
    let first = first.name.text.clone();
    let mut at_first = true;
    named.retain(|state| std::mem::take(&mut at_first) || state.name.text != first);
}

fn not_in_parallel(states: &mut States, block: &Block) {
    for item in &block.items {
        let (what, help) = match item.kind {
            ItemKind::Initial(_) => ("initial", "all of its states are entered together"),
            ItemKind::End(_) => ("end", "it ends when each of its states has ended"),
            _ => continue,
        };
        let message = format!("a parallel block has no {what} state");
        let help = format!("{help}; name this one under `states`");
        let mut diagnostic =
            Diagnostic::error("not-in-parallel", item.word.span, message).help(help);
        if let Some(word) = &block.parallel {
            diagnostic = diagnostic.label(word.span, "parallel because of this");
        }
        states.found.push(diagnostic);
    }
}

/// Puts the states of a block into the state that it names.
fn attach(states: &mut States, block: &Block, declared: Declared) {
    let Some(parent) = states.find(&block.name) else {
        return;
    };
    for id in &declared.all {
        states.machine.states[id.0].parent = Some(parent);
    }
    let place = &mut states.machine.states[parent.0].inside;
    if let Some(first) = place {
        let message = format!("the substates of `{}` are declared twice", block.name.text);
        states.found.push(
            Diagnostic::error("duplicate-parent", block.name.span, message)
                .label(first.span, "the first block")
                .help("put all of them into one block"),
        );
        return;
    }
    let parallel = block.parallel.is_some();
    *place = Some(crate::model::Region {
        doc: block.doc.clone(),
        parallel,
        initial: declared.initial.into_iter().filter(|_| !parallel).collect(),
        states: declared.all,
        ..region(block.name.span)
    });
}

fn transitions(states: &mut States, block: &Block) {
    for item in &block.items {
        let ItemKind::Transitions(lines) = &item.kind else {
            continue;
        };
        for line in lines {
            let source = states.find(&line.source);
            for target in &line.targets {
                transition(states, source, target, line);
            }
        }
    }
}

fn transition(states: &mut States, source: Option<StateId>, target: &Name, line: &ast::Transition) {
    let target_id = states.find(target);
    let (Some(source), Some(target_id)) = (source, target_id) else {
        return;
    };
    states.machine.transitions.push(Transition {
        source,
        targets: vec![target_id],
        events: Vec::new(),
        cond: None,
        actions: Vec::new(),
        doc: line.doc.clone(),
        span: target.span,
    });
}
