//! Connections, and how they convert.

use super::{Rule, report_skipped, slot_path};
use crate::ast::{Bind, SlotPath};
use crate::duplicates::check_unique;
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::{Name, ParseContext};
use std::collections::BTreeSet;

const BIND: [(&str, Rule); 1] = [("convert", Rule::convert)];
const CONVERT: [(&str, Rule); 1] = [("frames", Rule::frames)];
/// What stands after `via`.
const PROCESS_WORD: &str = "process";

pub(super) fn bind(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Bind> {
    let (mut paths, mut convert) = (Vec::new(), None);
    let (mut frames, mut process) = (Vec::new(), None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::slot_path => paths.extend(slot_path(r, part)),
            Rule::semicolon => r.semicolon(&part),
            Rule::bind_block => {
                for part in part.into_inner() {
                    match part.as_rule() {
                        Rule::convert => {
                            convert = convert.or(Some(r.first_word(&part).span));
                            process = process.or(via_process(r, &part));
                            frames.extend(frames_of(r, part));
                        }
                        Rule::skipped => report_skipped(r, &part, &BIND, "`convert`"),
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    check_unique(&frames, "slot", &mut r.found);
    let mut seen = BTreeSet::new();
    frames.retain(|slot: &Name| seen.insert(slot.text.clone()));
    let [consumer, provider] = <[SlotPath; 2]>::try_from(paths).ok()?;
    Some(Bind {
        consumer,
        provider,
        convert,
        frames,
        process,
    })
}

/// Where `via process` stands in a `convert`.
fn via_process(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) -> Option<Span> {
    let mut parts = pair.clone().into_inner();
    let via = parts.find(|part| part.as_rule() == Rule::via)?;
    let span = r.span(&via);
    let word = r.texts(via).pop()?;
    if word.text.eq_ignore_ascii_case(PROCESS_WORD) {
        return Some(span);
    }
    let message = format!("expected `{PROCESS_WORD}`, found `{}`", word.text);
    let error = Diagnostic::error("unknown-field", word.span, message);
    r.found.push(error.suggest(&word.text, [PROCESS_WORD]));
    None
}

/// The slots that `convert { frames SLOT; }` names.
fn frames_of(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Name> {
    let mut slots = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::semicolon => r.semicolon(&part),
            Rule::convert_block => {
                for part in part.into_inner() {
                    match part.as_rule() {
                        Rule::frames => slots.extend(r.texts(part)),
                        Rule::skipped => report_skipped(r, &part, &CONVERT, "`frames`"),
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    slots
}
