//! From text to tree. Never stops: what could not be read is a diagnostic, and the rest is read.

use crate::ast::{
    Array, DefaultValue, File, Flag, FlagKind, Group, Import, Item, Length, List, Param, Params,
    Range, Rule as RequireRule,
};
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

/// Reads one `.pdsl` text.
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
            let message = "this file is empty; it should hold `ComponentParams NAME { … };`";
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
                Rule::import => file.imports.extend(self.import(pair)),
                Rule::params => file.params = Some(self.params(pair)),
                Rule::trailing => {
                    let message = "there is text after the end of the parameters; a file holds one `ComponentParams`";
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
        let span = pair.as_span();
        Span::new(
            self.source,
            span.start(),
            span.start() + pair.as_str().trim_end().len(),
        )
    }

    fn name(&self, pair: &Pair<'a, Rule>) -> Name {
        Name::new(pair.as_str(), self.span(pair))
    }

    fn literal(&self, pair: &Pair<'a, Rule>) -> Literal {
        Literal::parse(pair.as_str(), self.span(pair))
    }

    fn literals(&self, pair: Pair<'a, Rule>) -> Vec<Literal> {
        pair.into_inner().map(|p| self.literal(&p)).collect()
    }

    fn bounds(&self, pair: Pair<'a, Rule>) -> Vec<Literal> {
        pair.into_inner()
            .filter(|p| p.as_rule() == Rule::number)
            .map(|p| self.literal(&p))
            .collect()
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

    fn unread(&mut self, pair: &Pair<'a, Rule>) {
        let first: String = pair
            .as_str()
            .chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect();
        let likely = match first.to_lowercase().as_str() {
            "group" => Rule::group,
            "list" => Rule::list,
            "require" => Rule::require,
            _ => Rule::param,
        };
        let offset = pair.as_span().start();
        let found = explain::<Grammar, Rule>(likely, pair.as_str(), self.source, offset, word);
        self.found.extend(found.or_else(|| {
            let span = self.span(pair);
            Some(Diagnostic::error(
                "syntax-error",
                span,
                "this cannot be read here",
            ))
        }));
    }

    fn import(&mut self, pair: Pair<'a, Rule>) -> Option<Import> {
        let mut import = None;
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::string => {
                    import = Some(Import {
                        path: unescape(part.as_str()),
                        span: self.span(&part),
                    });
                }
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        import
    }

    fn params(&mut self, pair: Pair<'a, Rule>) -> Params {
        let block = self.block(pair);
        Params {
            name: block.name,
            doc: block.doc,
            items: block.items,
        }
    }

    /// What `ComponentParams`, `group` and `list` have in common.
    fn block(&mut self, pair: Pair<'a, Rule>) -> Block {
        let doc = self.trivia.documentation(pair.as_span().start());
        let mut name = Name::new("", self.span(&pair));
        let (mut items, mut bounds) = (Vec::new(), Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = self.name(&part),
                Rule::number => bounds.push(self.literal(&part)),
                Rule::param => {
                    items.extend(self.param(part).map(|param| Item::Param(Box::new(param))));
                }
                Rule::require => items.push(Item::Rule(self.require(part))),
                Rule::unread => self.unread(&part),
                Rule::group => {
                    let Block {
                        name,
                        doc,
                        items: inner,
                        ..
                    } = self.block(part);
                    items.push(Item::Group(Group {
                        name,
                        doc,
                        items: inner,
                    }));
                }
                Rule::list => {
                    let Block {
                        name,
                        doc,
                        items: inner,
                        length,
                    } = self.block(part);
                    items.push(Item::List(List {
                        name,
                        doc,
                        length,
                        items: inner,
                    }));
                }
                _ => {}
            }
        }
        Block {
            name,
            doc,
            items,
            length: length(bounds),
        }
    }

    fn require(&mut self, pair: Pair<'a, Rule>) -> RequireRule {
        let mut rule = RequireRule {
            condition: String::new(),
            message: String::new(),
            span: self.span(&pair),
        };
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::condition => {
                    rule.span = self.span(&part);
                    let end = self.trivia.end_of_token_before(part.as_span().end());
                    rule.span.end = end.max(rule.span.start);
                    let text = &self.text[rule.span.start..rule.span.end];
                    Trivia::new(text)
                        .significant()
                        .trim_end()
                        .clone_into(&mut rule.condition);
                }
                Rule::string => rule.message = unescape(part.as_str()),
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        rule
    }

    fn param(&mut self, pair: Pair<'a, Rule>) -> Option<Param> {
        let doc = self.trivia.documentation(pair.as_span().start());
        let (mut name, mut ty, mut array, mut default) = (None, None, None, None);
        let (mut range, mut choices, mut flags) = (None, Vec::new(), Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::type_ref => {
                    for piece in part.into_inner() {
                        match piece.as_rule() {
                            Rule::name => ty = Some(self.name(&piece)),
                            _ => {
                                array = Some(Array {
                                    span: self.span(&piece),
                                    length: length(self.bounds(piece)),
                                });
                            }
                        }
                    }
                }
                Rule::default => default = part.into_inner().next().map(|p| self.default(p)),
                Rule::range => range = Some(self.range(part)),
                Rule::choice => choices = self.literals(part),
                Rule::flag => flags.extend(self.flag(part)),
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        Some(Param {
            name: name?,
            doc,
            ty: ty?,
            array,
            default,
            range,
            choices,
            flags,
        })
    }

    fn default(&mut self, pair: Pair<'a, Rule>) -> DefaultValue {
        let span = self.span(&pair);
        match pair.as_rule() {
            Rule::values => DefaultValue::Many(self.literals(pair), span),
            _ => DefaultValue::One(self.literal(&pair)),
        }
    }

    fn range(&mut self, pair: Pair<'a, Rule>) -> Range {
        let mut range = Range {
            min: None,
            max: None,
            span: self.span(&pair),
        };
        for part in pair.into_inner() {
            let literal = Some(self.literal(&part));
            if part.as_rule() == Rule::low {
                range.min = literal;
            } else {
                range.max = literal;
            }
        }
        range
    }

    fn flag(&mut self, pair: Pair<'a, Rule>) -> Option<Flag> {
        let span = self.span(&pair);
        let mut parts = pair.into_inner();
        let kind = match parts.next()?.as_rule() {
            Rule::kw_editable => FlagKind::Editable,
            Rule::kw_fixed => FlagKind::Fixed,
            Rule::kw_unit => FlagKind::Unit(unescape(parts.next()?.as_str())),
            Rule::kw_restart => FlagKind::Restart,
            _ => FlagKind::Secret,
        };
        Some(Flag { kind, span })
    }
}

struct Block {
    name: Name,
    doc: Vec<String>,
    items: Vec<Item>,
    length: Option<Length>,
}

fn length(bounds: Vec<Literal>) -> Option<Length> {
    let mut bounds = bounds.into_iter();
    Some(Length {
        min: bounds.next()?,
        max: bounds.next()?,
    })
}

/// The words of messages for the rules that can be missing.
fn word(rule: Rule) -> Option<&'static str> {
    Some(match rule {
        Rule::EOI => "the end of the file",
        Rule::file | Rule::params | Rule::kw_params => "`ComponentParams`",
        Rule::open => "`{`",
        Rule::close => "`}`",
        Rule::colon => "`:`",
        Rule::name => "a name",
        Rule::string => "a text in quotes",
        Rule::number | Rule::high => "a number",
        Rule::literal => "a value",
        Rule::type_ref => "a type",
        Rule::default | Rule::values => "a default",
        Rule::range => "a range",
        Rule::choice => "choices",
        Rule::flag => "a flag",
        Rule::end_of_item | Rule::next_item | Rule::semicolon => "`;`",
        Rule::condition => "a condition",
        Rule::comparator => "a comparison",
        Rule::path | Rule::param => "a parameter",
        _ => return None,
    })
}
