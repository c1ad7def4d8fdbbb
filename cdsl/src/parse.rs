//! From text to tree. Never stops: what could not be read is a diagnostic, and the rest is read.

use crate::ast::{Clause, Communication, Component, File, Setting, SlotDecl};
use crate::model::Role;
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Literal, Name, ParseContext};

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "../../syntax/src/common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// The words that begin a clause.
const KEYWORDS: [&str; 8] = [
    "Communications",
    "language",
    "gui",
    "options",
    "statemachine",
    "parameters",
    "dependencies",
    "period",
];

/// Reads one `.cdsl` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let mut reader = ParseContext::new(sources, source);
    let file = file(&mut reader);
    (file, reader.found)
}

fn file(r: &mut ParseContext<'_>) -> File {
    let mut file = File::default();
    for pair in r.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::import => file.imports.extend(r.texts(pair)),
            Rule::component => file.component = Some(component(r, pair)),
            Rule::trailing => r.trailing(&pair),
            _ => {}
        }
    }
    file
}

fn component(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Component {
    let doc = r.doc(&pair);
    let mut component = Component {
        name: Name::new("", r.span(&pair)),
        doc,
        clauses: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => component.name = r.name(&part),
            Rule::clause => component
                .clauses
                .extend(part.into_inner().filter_map(|p| clause(r, p))),
            _ => {}
        }
    }
    component
}

fn clause(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<(Name, Clause)> {
    let rule = pair.as_rule();
    if rule == Rule::skipped {
        report_skipped_clause(r, &pair);
        return None;
    }
    let first = pair.clone().into_inner().next().map(|p| r.name(&p))?;
    let clause = match rule {
        Rule::communications => {
            let mut communications = Vec::new();
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::communication => communications.extend(communication(r, part)),
                    Rule::skipped => report_skipped_communication(r, &part),
                    _ => {}
                }
            }
            Clause::Communications(communications)
        }
        Rule::dependencies => {
            let dependencies = pair
                .into_inner()
                .filter(|p| p.as_rule() == Rule::dependency);
            Clause::Dependencies(
                dependencies
                    .filter_map(|p| {
                        let mut texts = r.texts(p).into_iter();
                        Some((texts.next()?, texts.next()?))
                    })
                    .collect(),
            )
        }
        Rule::period => {
            let value = pair
                .clone()
                .into_inner()
                .find(|p| matches!(p.as_rule(), Rule::duration | Rule::number))?;
            let literal = Literal::parse(value.as_str(), r.span(&value));
            r.texts(pair);
            Clause::Period(literal)
        }
        _ => {
            let visual = pair
                .clone()
                .into_inner()
                .any(|p| p.as_rule() == Rule::kw_visual);
            let mut texts = r.texts(pair).into_iter();
            match rule {
                Rule::language => Clause::Language(texts.next()?),
                Rule::gui => Clause::Gui(texts.next()?, texts.next()),
                Rule::options => Clause::Options(texts.collect()),
                Rule::statemachine => Clause::StateMachine(texts.next()?, visual),
                _ => Clause::Parameters(texts.next()?),
            }
        }
    };
    Some((first, clause))
}

fn communication(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Communication> {
    let (mut keyword, mut slots) = (None, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_communication => keyword = Some(r.name(&part)),
            Rule::slot => slots.extend(slot(r, part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Communication {
        keyword: keyword?,
        slots,
    })
}

fn slot(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<SlotDecl> {
    let span = r.span(&pair);
    let (mut interface, mut backend, mut name, mut qos) = (None, None, None, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => interface = Some(r.name(&part)),
            Rule::backend => backend = Some(r.name(&part)),
            Rule::slot_name => name = Some(r.name(&part)),
            Rule::qos => qos = part.into_inner().filter_map(|p| setting(r, p)).collect(),
            _ => {}
        }
    }
    let trimmed = r.trivia.end_of_token_before(span.end);
    Some(SlotDecl {
        interface: interface?,
        backend,
        name,
        qos,
        span: Span::new(r.source, span.start, trimmed),
    })
}

fn setting(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Setting> {
    let (mut name, mut value, mut spin) = (None, None, false);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::literal => value = Some(Literal::parse(part.as_str(), r.span(&part))),
            Rule::spin => {
                spin = true;
                let time = part.into_inner().find(|p| p.as_rule() == Rule::literal)?;
                value = Some(Literal::parse(time.as_str(), r.span(&time)));
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Setting {
        name: name?,
        value: value?,
        spin,
    })
}

fn report_skipped_clause(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let first = r.first_word(pair);
    let rule = match first.text.to_lowercase().as_str() {
        "communications" => Rule::communications,
        "language" => return unknown_language(r, pair),
        "gui" => Rule::gui,
        "options" => Rule::options,
        "statemachine" => Rule::statemachine,
        "parameters" => Rule::parameters,
        "dependencies" => Rule::dependencies,
        "period" => Rule::period,
        _ => return r.found.push(unknown_clause(&first)),
    };
    r.report_skipped(pair, rule);
}

/// `language N++;` is no name, and still a language that is not there.
fn unknown_language(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let text = pair.as_str();
    let rest = &text["language".len()..];
    let written = rest.trim_end_matches(';').trim();
    if written.is_empty() || written.contains(char::is_whitespace) {
        return r.report_skipped(pair, Rule::language);
    }
    let start = pair.as_span().end() - rest.trim_start().len();
    let span = Span::new(r.source, start, start + written.len());
    r.found
        .push(crate::resolve::unknown_language(&Name::new(written, span)));
}

fn report_skipped_communication(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    const ALL: &str = "allowed here: `implements`, `requires`, `publishes`, `subscribesTo`";
    let first = r.first_word(pair);
    let words = Role::WORDS.map(|(word, _)| word);
    if words.iter().any(|w| w.eq_ignore_ascii_case(&first.text)) {
        return r.report_skipped(pair, Rule::communication);
    }
    let message = format!("`{}` does not begin a communication clause", first.text);
    let words = ["implements", "requires", "publishes", "subscribesTo"];
    // What people write who know components by other names.
    let near = match first.text.to_lowercase().as_str() {
        "provides" | "provide" | "offers" | "serves" => Some("implements"),
        "uses" | "needs" | "calls" => Some("requires"),
        _ => rc_diagnostics::nearest(&first.text, words),
    };
    let help = near.map_or(ALL.to_owned(), |near| {
        format!("did you mean `{near}`? {ALL}")
    });
    r.found
        .push(Diagnostic::error("unknown-communication", first.span, message).help(help));
}

/// Eclipse's RoboComp had clauses that are gone; people still have the files.
fn unknown_clause(first: &Name) -> Diagnostic {
    let today = match first.text.to_lowercase().as_str() {
        "robocompmodules" | "robocompclasses" => {
            Some("it is `dependencies { NAME \"VERSION\"; };`, with crates instead of classes")
        }
        "useqt" => Some("it is `gui Qt (QWidget);`"),
        "worker" => {
            Some("the worker's loop needs no clause; `period 50ms;` sets how often it runs")
        }
        _ => None,
    };
    if let Some(today) = today {
        let message = format!("`{}` is a clause of old; today {today}", first.text);
        Diagnostic::error("old-clause", first.span, message)
    } else {
        let message = format!("`{}` does not begin a clause of a component", first.text);
        Diagnostic::error("unknown-clause", first.span, message).suggest(&first.text, KEYWORDS)
    }
}

rc_syntax::language!("`Component NAME { … };`", words: [crate_name], {
    file | kw_component => "`Component`",
    crate_name | slot | interface_name | backend | slot_name => "a name",
    duration | number => "a time such as `50ms`",
    communication | kw_communication => "`implements`, `requires`, `publishes` or `subscribesTo`",
    clause => "a clause",
    communication_end => "`;`",
});
