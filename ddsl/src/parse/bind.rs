//! Connections and external slots, and how they convert.

use super::{Rule, report_skipped, slot_path};
use crate::ast::{Bind, Convert, External, Peer, SlotPath};
use crate::duplicates::check_unique;
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::{Name, ParseContext};
use std::collections::BTreeSet;

const BIND: [(&str, Rule); 1] = [("convert", Rule::convert)];
const PEER: [(&str, Rule); 2] = [("cdsl", Rule::peer_cdsl), ("convert", Rule::convert)];
const CONVERT: [(&str, Rule); 1] = [("frames", Rule::frames)];
/// The word after `via`.
const PROCESS_WORD: &str = "process";

pub(super) fn bind(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Bind> {
    let (mut paths, mut converts) = (Vec::new(), Convert::default());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::slot_path => paths.extend(slot_path(r, part)),
            Rule::semicolon => r.semicolon(&part),
            Rule::bind_block => {
                for part in part.into_inner() {
                    match part.as_rule() {
                        Rule::convert => convert(r, part, &mut converts),
                        Rule::skipped => report_skipped(r, &part, &BIND, "`convert`"),
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    let Convert {
        span,
        frames,
        process,
    } = unique(r, converts);
    let [consumer, provider] = <[SlotPath; 2]>::try_from(paths).ok()?;
    Some(Bind {
        consumer,
        provider,
        convert: span,
        frames,
        process,
    })
}

pub(super) fn external(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> External {
    let (mut slots, mut address, mut described) = (Vec::new(), None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::slot_path => slots.extend(slot_path(r, part)),
            Rule::string => address = Some(r.string(&part)),
            Rule::semicolon => r.semicolon(&part),
            Rule::peer => described = peer(r, part),
            _ => {}
        }
    }
    External {
        slots,
        address,
        peer: described,
    }
}

/// The contents of the block of an external slot.
fn peer(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Peer> {
    let span = r.span(&pair);
    let (mut files, mut converts, mut is_whole) = (Vec::new(), Convert::default(), true);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::peer_cdsl => {
                let word = r.first_word(&part);
                let mut texts = r.texts(part).into_iter();
                files.extend(texts.next().map(|text| (word, text)));
            }
            Rule::convert => convert(r, part, &mut converts),
            Rule::skipped => {
                is_whole = false;
                report_skipped(r, &part, &PEER, "`cdsl` or `convert`");
            }
            _ => {}
        }
    }
    if let [(first, _), (word, _), ..] = files.as_slice() {
        let error = Diagnostic::error("repeated-clause", word.span, "`cdsl` occurs twice");
        r.found.push(error.label(first.span, "first here"));
    }
    let converts = unique(r, converts);
    let Some((_, cdsl)) = files.into_iter().next() else {
        if is_whole {
            let message = "the block of an external slot has no `cdsl`";
            let error = Diagnostic::error("missing-clause", span, message);
            let help = "name the file that describes the peer: `cdsl \"lidar.cdsl\";`";
            r.found.push(error.help(help));
        }
        return None;
    };
    Some(Peer {
        cdsl,
        convert: converts,
    })
}

/// Adds the contents of a `convert`.
fn convert(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>, all: &mut Convert) {
    all.span = all.span.or(Some(r.first_word(&pair).span));
    all.process = all.process.or(via_process(r, &pair));
    all.frames.extend(frames_of(r, pair));
}

/// Reports slots that are named twice, and keeps one of each.
fn unique(r: &mut ParseContext<'_>, mut all: Convert) -> Convert {
    check_unique(&all.frames, "slot", &mut r.found);
    let mut seen = BTreeSet::new();
    all.frames.retain(|slot| seen.insert(slot.text.clone()));
    all
}

/// The place of `via process` in a `convert`.
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
