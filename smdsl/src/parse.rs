//! The parser. Errors become diagnostics, and parsing continues after the skipped input.

use crate::ast::{Block, Clause, ClauseKind, File, State, Transition};
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_syntax::{Name, ParseContext};

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// The keywords of clauses.
const KEYWORDS: [&str; 4] = ["states", "initial_state", "end_state", "transitions"];

/// Parses one `.smdsl` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let mut reader = ParseContext::new(sources, source);
    let file = file(&mut reader);
    (file, reader.finish())
}

fn file(r: &mut ParseContext<'_>) -> File {
    let mut file = File {
        complete: true,
        ..File::default()
    };
    for pair in r.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::machine => file.machine = Some(block(r, pair)),
            Rule::substates => file.substates.push(block(r, pair)),
            Rule::skipped_substates => {
                file.complete = false;
                r.report_skipped(&pair, Rule::substates);
            }
            Rule::trailing => {
                file.complete = false;
                r.trailing(&pair);
            }
            _ => {}
        }
    }
    let mut blocks = file.machine.iter().chain(&file.substates);
    file.complete &= blocks.all(|block| block.complete);
    file
}

fn block(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Block {
    let mut block = Block {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        parallel: None,
        clauses: Vec::new(),
        complete: true,
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => block.name = r.name(&part),
            Rule::kw_parallel => block.parallel = Some(r.name(&part)),
            Rule::states | Rule::initial | Rule::end | Rule::transitions => {
                block.clauses.extend(clause(r, part));
            }
            Rule::skipped => {
                block.complete = false;
                report_skipped_clause(r, &part);
            }
            _ => {}
        }
    }
    block
}

fn clause(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Clause> {
    let rule = pair.as_rule();
    let keyword = pair.clone().into_inner().next().map(|p| r.name(&p))?;
    let kind = match rule {
        Rule::states => ClauseKind::States(states(r, pair)),
        Rule::initial => ClauseKind::Initial(states(r, pair)),
        Rule::end => ClauseKind::End(states(r, pair)),
        _ => ClauseKind::Transitions(transitions(r, pair)),
    };
    Some(Clause { keyword, kind })
}

/// The states of a clause. States without documentation get that of the clause.
fn states(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<State> {
    let common = r.doc(&pair);
    let mut states = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => {
                let own = r.doc(&part);
                states.push(State {
                    name: r.name(&part),
                    doc: if own.is_empty() { common.clone() } else { own },
                });
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    states
}

fn transitions(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Transition> {
    let mut transitions = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::transition => {
                let doc = r.doc(&part);
                let mut names = r.texts(part).into_iter();
                transitions.extend(names.next().map(|source| Transition {
                    source,
                    targets: names.collect(),
                    doc,
                }));
            }
            Rule::skipped => r.report_skipped(&part, Rule::transition),
            _ => {}
        }
    }
    transitions
}

fn report_skipped_clause(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let first = r.first_word(pair);
    let rule = match first.text.to_lowercase().as_str() {
        "states" => Rule::states,
        "initial_state" => Rule::initial,
        "end_state" => Rule::end,
        "transitions" | "transition" => Rule::transitions,
        _ => return r.found.push(unknown_clause(&first)),
    };
    r.report_skipped(pair, rule);
}

fn unknown_clause(first: &Name) -> Diagnostic {
    let message = format!(
        "expected a clause of a state machine, found `{}`",
        first.text
    );
    let diagnostic = Diagnostic::error("unknown-clause", first.span, message);
    // Keywords of other state machine languages.
    let meant = match first.text.to_lowercase().as_str() {
        ":" => {
            return diagnostic.help("move the block of substates after the machine");
        }
        "initial" | "initialstate" | "start" | "start_state" => "initial_state",
        "end" | "endstate" | "final" | "final_state" | "finalstate" => "end_state",
        _ => &first.text,
    };
    diagnostic.suggest(meant, KEYWORDS)
}

rc_syntax::language!("`NAME { … };` with optional `:STATE { … };` blocks", words: [], {
    file | machine => "a name",
    states | initial | end | transitions => "a clause",
    kw_parallel => "`parallel`",
    transition => "a transition",
    clause_end | transition_end => "`;`",
    arrow => "`=>`",
});
