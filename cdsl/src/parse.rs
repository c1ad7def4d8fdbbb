//! From text to tree. Never stops: what could not be read is a diagnostic, and the rest is read.

use crate::ast::{Clause, Comm, Component, File, Item};
use crate::model::Role;
use pest::Parser;
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{
    Literal, Name, Trivia, explain, missing_semicolon, nesting, unclosed_comment, unescape,
};

#[derive(pest_derive::Parser)]
#[grammar = "../../syntax/src/common.pest"]
#[grammar = "grammar.pest"]
struct Grammar;

/// The words that begin a clause.
const CLAUSES: [&str; 8] = [
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
    let text = sources.text(source);
    let mut reader = Reader {
        source,
        text,
        trivia: Trivia::new(text),
        found: Diagnostics::new(),
    };
    let file = reader.file();
    (file, reader.found)
}

struct Reader<'a> {
    source: SourceId,
    text: &'a str,
    trivia: Trivia<'a>,
    found: Diagnostics,
}

impl<'a> Reader<'a> {
    fn file(&mut self) -> File {
        if let Some(unclosed) = unclosed_comment(&self.trivia, self.source) {
            self.found.push(unclosed);
            return File::default();
        }
        if self.trivia.significant().is_empty() {
            let message = "this file is empty; it should hold `Component NAME { … };`";
            self.found.push(Diagnostic::error(
                "empty-file",
                Span::new(self.source, 0, 0),
                message,
            ));
            return File::default();
        }
        if let Some(deep) = nesting(self.text, self.source) {
            self.found.push(deep);
            return File::default();
        }
        let Ok(mut pairs) = Grammar::parse(Rule::file, self.text) else {
            self.found.extend(explain::<Grammar, Rule>(
                Rule::file,
                self.text,
                self.source,
                0,
                word,
            ));
            return File::default();
        };
        let mut file = File::default();
        for pair in pairs.next().into_iter().flat_map(Pair::into_inner) {
            match pair.as_rule() {
                Rule::import => file.imports.extend(self.texts(pair)),
                Rule::component => file.component = Some(self.component(pair)),
                Rule::trailing => {
                    let message =
                        "there is text after the end of the component; a file holds one component";
                    let first = pair
                        .as_str()
                        .lines()
                        .next()
                        .unwrap_or_default()
                        .trim_end()
                        .len();
                    let start = pair.as_span().start();
                    let span = Span::new(self.source, start, start + first);
                    self.found
                        .push(Diagnostic::error("text-after-end", span, message));
                }
                _ => {}
            }
        }
        file
    }

    fn span(&self, pair: &Pair<'a, Rule>) -> Span {
        Span::new(self.source, pair.as_span().start(), pair.as_span().end())
    }

    fn name(&self, pair: &Pair<'a, Rule>) -> Name {
        Name::new(pair.as_str(), self.span(pair))
    }

    fn semicolon(&mut self, pair: &Pair<'a, Rule>) {
        if pair.as_str().is_empty() {
            self.found.push(missing_semicolon(
                &self.trivia,
                self.source,
                pair.as_span().start(),
            ));
        }
    }

    /// The names and texts directly inside a pair, its semicolon checked.
    fn texts(&mut self, pair: Pair<'a, Rule>) -> Vec<Name> {
        let mut texts = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name | Rule::crate_name => texts.push(self.name(&part)),
                Rule::string => texts.push(Name::new(unescape(part.as_str()), self.span(&part))),
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        texts
    }

    fn component(&mut self, pair: Pair<'a, Rule>) -> Component {
        let doc = self.trivia.documentation(pair.as_span().start());
        let mut component = Component {
            name: Name::new("", self.span(&pair)),
            doc,
            clauses: Vec::new(),
        };
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => component.name = self.name(&part),
                Rule::clause => component
                    .clauses
                    .extend(part.into_inner().filter_map(|p| self.clause(p))),
                _ => {}
            }
        }
        component
    }

    fn clause(&mut self, pair: Pair<'a, Rule>) -> Option<(Name, Clause)> {
        let rule = pair.as_rule();
        if rule == Rule::unread {
            self.unread_clause(&pair);
            return None;
        }
        let first = pair.clone().into_inner().next().map(|p| self.name(&p))?;
        let clause = match rule {
            Rule::communications => {
                let mut comms = Vec::new();
                for part in pair.into_inner() {
                    match part.as_rule() {
                        Rule::comm => comms.extend(self.comm(part)),
                        Rule::unread => self.unread_comm(&part),
                        _ => {}
                    }
                }
                Clause::Communications(comms)
            }
            Rule::dependencies => {
                let dependencies = pair
                    .into_inner()
                    .filter(|p| p.as_rule() == Rule::dependency);
                Clause::Dependencies(
                    dependencies
                        .filter_map(|p| {
                            let mut texts = self.texts(p).into_iter();
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
                let literal = Literal::parse(value.as_str(), self.span(&value));
                self.texts(pair);
                Clause::Period(literal)
            }
            _ => {
                let visual = pair
                    .clone()
                    .into_inner()
                    .any(|p| p.as_rule() == Rule::kw_visual);
                let mut texts = self.texts(pair).into_iter();
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

    fn comm(&mut self, pair: Pair<'a, Rule>) -> Option<Comm> {
        let (mut keyword, mut items) = (None, Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::kw_comm => keyword = Some(self.name(&part)),
                Rule::item => items.extend(self.item(part)),
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        Some(Comm {
            word: keyword?,
            items,
        })
    }

    fn item(&mut self, pair: Pair<'a, Rule>) -> Option<Item> {
        let span = self.span(&pair);
        let (mut interface, mut backend, mut slot, mut qos) = (None, None, None, Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => interface = Some(self.name(&part)),
                Rule::backend => backend = Some(self.name(&part)),
                Rule::slot => slot = Some(self.name(&part)),
                Rule::qos => qos = part.into_inner().filter_map(|p| self.setting(p)).collect(),
                _ => {}
            }
        }
        let trimmed = self.trivia.end_of_token_before(span.end);
        Some(Item {
            interface: interface?,
            backend,
            slot,
            qos,
            span: Span::new(self.source, span.start, trimmed),
        })
    }

    fn setting(&mut self, pair: Pair<'a, Rule>) -> Option<(Name, Literal)> {
        let (mut name, mut value) = (None, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::literal => value = Some(Literal::parse(part.as_str(), self.span(&part))),
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        Some((name?, value?))
    }

    /// The first word of what could not be read.
    fn first_word(&self, pair: &Pair<'a, Rule>) -> Name {
        let text = pair.as_str();
        let length = text
            .find(|c: char| !(c.is_alphanumeric() || c == '_'))
            .unwrap_or(text.len())
            .max(1);
        let length = text
            .char_indices()
            .map(|(at, c)| at + c.len_utf8())
            .find(|end| *end >= length)
            .unwrap_or(length);
        let start = pair.as_span().start();
        Name::new(
            &text[..length],
            Span::new(self.source, start, start + length),
        )
    }

    fn unread_clause(&mut self, pair: &Pair<'a, Rule>) {
        let first = self.first_word(pair);
        let rule = match first.text.to_lowercase().as_str() {
            "communications" => Rule::communications,
            "language" => Rule::language,
            "gui" => Rule::gui,
            "options" => Rule::options,
            "statemachine" => Rule::statemachine,
            "parameters" => Rule::parameters,
            "dependencies" => Rule::dependencies,
            "period" => Rule::period,
            _ => return self.found.push(unknown_clause(&first)),
        };
        let found =
            explain::<Grammar, Rule>(rule, pair.as_str(), self.source, first.span.start, word);
        self.found.extend(found);
    }

    fn unread_comm(&mut self, pair: &Pair<'a, Rule>) {
        let first = self.first_word(pair);
        let words = Role::WORDS.map(|(word, _)| word);
        if words.iter().any(|w| w.eq_ignore_ascii_case(&first.text)) {
            let offset = first.span.start;
            let found =
                explain::<Grammar, Rule>(Rule::comm, pair.as_str(), self.source, offset, word);
            return self.found.extend(found);
        }
        let message = format!("`{}` does not begin a communication clause", first.text);
        let words = ["implements", "requires", "publishes", "subscribesTo"];
        // What people write who know components by other names.
        let meant = match first.text.to_lowercase().as_str() {
            "provides" | "provide" | "offers" | "serves" => "implements",
            "uses" | "needs" | "calls" => "requires",
            _ => &first.text,
        };
        self.found.push(
            Diagnostic::error("unknown-communication", first.span, message).suggest(meant, words),
        );
    }
}

/// Eclipse's RoboComp had clauses that are gone; people still have the files.
fn unknown_clause(first: &Name) -> Diagnostic {
    let today = match first.text.to_lowercase().as_str() {
        "robocompmodules" | "robocompclasses" => {
            Some("`import \"Name.idsl\";` before the component")
        }
        "useqt" => Some("`gui Qt (QWidget);`"),
        "worker" => Some(
            "nothing: the worker's loop needs no clause; `period 50ms;` sets how often it runs",
        ),
        _ => None,
    };
    if let Some(today) = today {
        let message = format!("`{}` is a clause of old; today it is {today}", first.text);
        Diagnostic::error("old-clause", first.span, message)
    } else {
        let message = format!("`{}` does not begin a clause of a component", first.text);
        Diagnostic::error("unknown-clause", first.span, message).suggest(&first.text, CLAUSES)
    }
}

/// The words of messages for the rules that can be missing.
fn word(rule: Rule) -> Option<&'static str> {
    Some(match rule {
        Rule::EOI => "the end of the file",
        Rule::file | Rule::kw_component => "`Component`",
        Rule::name
        | Rule::crate_name
        | Rule::item
        | Rule::item_name
        | Rule::backend
        | Rule::slot => "a name",
        Rule::string => "a text in quotes",
        Rule::literal => "a value",
        Rule::duration | Rule::number => "a time such as `50ms`",
        Rule::comm | Rule::kw_comm => "`implements`, `requires`, `publishes` or `subscribesTo`",
        Rule::clause => "a clause",
        Rule::semicolon | Rule::begins_next | Rule::ends_comm => "`;`",
        Rule::open => "`{`",
        Rule::close => "`}`",
        Rule::open_round => "`(`",
        Rule::close_round => "`)`",
        Rule::comma => "`,`",
        _ => return None,
    })
}
