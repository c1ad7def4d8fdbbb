//! Resolves the syntax tree of SMDSL into the model.

use crate::ast::{self, Block, ClauseKind};
use crate::builder::{MachineBuilder, empty_region};
use crate::model::{StateId, StateKind, StateMachine, Transition};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::Name;
use std::collections::HashMap;

/// Loads and checks one `.smdsl` text.
pub(crate) fn load(sources: &SourceMap, source: SourceId) -> (Option<StateMachine>, Diagnostics) {
    let (file, found) = parse(sources, source);
    let Some(top) = file.machine else {
        return (None, found);
    };
    let mut builder = MachineBuilder::new(top.name.clone(), top.doc.clone(), file.complete, found);
    let outer = declare(&mut builder, &top, "the machine");
    builder.machine.top.initial = outer.initial.into_iter().collect();
    builder.machine.top.states = outer.all;
    let inner: Vec<DeclaredStates> = file
        .substates
        .iter()
        .map(|block| declare(&mut builder, block, &format!("`{}`", block.name.text)))
        .collect();
    // Blocks may be in any order, and transitions may lead to states of any block.
    for (block, declared) in file.substates.iter().zip(inner) {
        attach_substates(&mut builder, block, declared);
    }
    for block in std::iter::once(&top).chain(&file.substates) {
        transitions(&mut builder, block);
    }
    let (machine, found) = builder.finish();
    (Some(machine), found)
}

/// The states of one block.
struct DeclaredStates {
    initial: Option<StateId>,
    all: Vec<StateId>,
}

/// Declares the states of a block: the initial state, the others, the end state. `whose` names the
/// block in messages.
fn declare(builder: &mut MachineBuilder, block: &Block, whose: &str) -> DeclaredStates {
    check_unique_clauses(builder, block);
    let of = |wanted: fn(&ClauseKind) -> Option<&Vec<ast::State>>| -> Vec<&ast::State> {
        block
            .clauses
            .iter()
            .filter_map(|i| wanted(&i.kind))
            .flatten()
            .collect()
    };
    let plain = of(|kind| match kind {
        ClauseKind::States(list) => Some(list),
        _ => None,
    });
    let mut initial = of(|kind| match kind {
        ClauseKind::Initial(list) => Some(list),
        _ => None,
    });
    let mut end = of(|kind| match kind {
        ClauseKind::End(list) => Some(list),
        _ => None,
    });
    let parallel = block.parallel.is_some();
    if parallel {
        reject_in_parallel(builder, block);
    } else {
        check_single(builder, &mut initial, "initial");
        check_single(builder, &mut end, "end");
    }
    let marked: HashMap<&str, Span> = initial
        .iter()
        .chain(&end)
        .map(|state| (state.name.text.as_str(), state.name.span))
        .collect();
    let mut declared = DeclaredStates {
        initial: None,
        all: Vec::new(),
    };
    for state in &initial {
        let id = builder.declare(state.name.clone(), state.doc.clone(), StateKind::Plain);
        declared.all.push(id);
        declared.initial.get_or_insert(id);
    }
    for state in plain {
        if let Some(first) = marked.get(state.name.text.as_str()) {
            let message = format!(
                "`{}` is already declared as the initial or the end state",
                state.name.text
            );
            builder.found.push(
                Diagnostic::warning("repeated-state", state.name.span, message)
                    .label(*first, "declared here"),
            );
            continue;
        }
        let id = builder.declare(state.name.clone(), state.doc.clone(), StateKind::Plain);
        declared.all.push(id);
    }
    let kind = if parallel {
        StateKind::Plain
    } else {
        StateKind::End
    };
    for state in &end {
        let id = builder.declare(state.name.clone(), state.doc.clone(), kind);
        declared.all.push(id);
    }
    // A clause that could not be parsed is not missing.
    if block.complete && parallel && declared.all.is_empty() {
        builder.error(
            "no-states",
            block.name.span,
            format!("{whose} has no states"),
        );
    }
    if block.complete && !parallel && declared.initial.is_none() {
        let message = format!("{whose} has no initial state");
        let diagnostic = Diagnostic::error("no-initial-state", block.name.span, message);
        builder
            .found
            .push(diagnostic.help("add `initial_state NAME;`"));
    }
    declared
}

/// Reports repeated `states` and `transitions` clauses.
fn check_unique_clauses(builder: &mut MachineBuilder, block: &Block) {
    let mut seen: HashMap<&str, Span> = HashMap::new();
    for clause in &block.clauses {
        let name = match clause.kind {
            ClauseKind::States(_) => "states",
            ClauseKind::Transitions(_) => "transitions",
            // `check_single` reports these.
            ClauseKind::Initial(_) | ClauseKind::End(_) => continue,
        };
        let first = *seen.entry(name).or_insert(clause.keyword.span);
        if first != clause.keyword.span {
            let message = format!("duplicate clause `{}`", clause.keyword.text);
            builder.found.push(
                Diagnostic::error("repeated-clause", clause.keyword.span, message)
                    .label(first, "first used here"),
            );
        }
    }
}

/// Reports a second initial or end state. It stays declared, so that names can refer to it.
fn check_single(builder: &mut MachineBuilder, named: &mut Vec<&ast::State>, what: &str) {
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
            "a block cannot have a second {what} state `{}`",
            other.name.text
        );
        builder.found.push(
            Diagnostic::error(code, other.name.span, message)
                .label(first.name.span, "first declared here"),
        );
    }
    let first = first.name.text.clone();
    let mut at_first = true;
    named.retain(|state| std::mem::take(&mut at_first) || state.name.text != first);
}

fn reject_in_parallel(builder: &mut MachineBuilder, block: &Block) {
    for clause in &block.clauses {
        let (what, help) = match clause.kind {
            ClauseKind::Initial(_) => ("initial", "all of its states are entered together"),
            ClauseKind::End(_) => ("end", "it ends when each of its states has ended"),
            _ => continue,
        };
        let message = format!("a parallel block cannot have an {what} state");
        let help = format!("declare the state under `states`: {help}");
        let mut diagnostic =
            Diagnostic::error("not-in-parallel", clause.keyword.span, message).help(help);
        if let Some(keyword) = &block.parallel {
            diagnostic = diagnostic.label(keyword.span, "parallel because of this keyword");
        }
        builder.found.push(diagnostic);
    }
}

/// Attaches the states of a block to their parent.
fn attach_substates(builder: &mut MachineBuilder, block: &Block, declared: DeclaredStates) {
    let Some(parent) = builder.find(&block.name) else {
        return;
    };
    for id in &declared.all {
        builder.machine.states[id.0].parent = Some(parent);
    }
    let place = &mut builder.machine.states[parent.0].region;
    if let Some(first) = place {
        let message = format!("duplicate block of substates of `{}`", block.name.text);
        builder.found.push(
            Diagnostic::error("duplicate-parent", block.name.span, message)
                .label(first.span, "first block")
                .help("merge the blocks"),
        );
        return;
    }
    let parallel = block.parallel.is_some();
    *place = Some(crate::model::Region {
        doc: block.doc.clone(),
        parallel,
        initial: declared.initial.into_iter().filter(|_| !parallel).collect(),
        states: declared.all,
        ..empty_region(block.name.span)
    });
}

fn transitions(builder: &mut MachineBuilder, block: &Block) {
    for clause in &block.clauses {
        let ClauseKind::Transitions(lines) = &clause.kind else {
            continue;
        };
        for line in lines {
            let source = builder.find(&line.source);
            for target in &line.targets {
                transition(builder, source, target, line);
            }
        }
    }
}

fn transition(
    builder: &mut MachineBuilder,
    source: Option<StateId>,
    target: &Name,
    line: &ast::Transition,
) {
    let target_id = builder.find(target);
    let (Some(source), Some(target_id)) = (source, target_id) else {
        return;
    };
    let event = event(&line.source.text, &target.text);
    builder.machine.transitions.push(Transition {
        source,
        targets: vec![target_id],
        events: vec![Name::new(event, target.span)],
        cond: None,
        internal: false,
        actions: Vec::new(),
        doc: line.doc.clone(),
        span: target.span,
    });
}

/// The event of the transition `source => target`: `SourceToTarget`.
fn event(source: &str, target: &str) -> String {
    format!("{}To{}", capitalised(source), capitalised(target))
}

/// `battery_low` becomes `BatteryLow`. A name without letters or digits stays as it is.
fn capitalised(name: &str) -> String {
    let mut result = String::new();
    for word in name.split('_') {
        let mut letters = word.chars();
        result.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        result.push_str(letters.as_str());
    }
    if result.is_empty() {
        return name.to_owned();
    }
    result
}
