//! From a text to pest's pairs, and what every language reads of them in the same way.

use crate::syntax_error::{check_nesting, syntax_error};
use crate::{Literal, Name, Trivia, unescape};
use pest::iterators::{Pair, Pairs};
use pest::{Parser, RuleType};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};

/// The rules of one language's grammar.
pub trait Language: RuleType {
    /// The parser that pest made of the grammar.
    type Grammar: Parser<Self>;
    /// The rule of a whole file.
    const FILE: Self;
    /// What a file holds, for messages: `` `module NAME { … };` ``.
    const FILE_CONTENT: &'static str;
    /// Whether this rule reads a name, a text in quotes or a `;`.
    fn terminal(self) -> Option<Terminal>;
    /// How people call what this rule reads; a rule without a word is not mentioned in messages.
    fn description(self) -> Option<&'static str>;
}

/// What stands by itself in most declarations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terminal {
    /// A name or a number, taken as it is written.
    Word,
    /// A text in quotes.
    String,
    /// A `;`, perhaps forgotten.
    Semicolon,
}

/// Implements [`Language`] for the `Rule` that pest made beside `Grammar`: what a file holds, what else than a name is
/// read as a word, and how people call the rules that the languages do not share (`common.pest`).
#[macro_export]
macro_rules! language {
    ($holds:literal, words: [$($leaf:ident),*], { $($($rule:ident)|+ => $word:literal,)+ }) => {
        impl $crate::Language for Rule {
            type Grammar = Grammar;
            const FILE: Self = Self::file;
            const FILE_CONTENT: &'static str = $holds;

            fn terminal(self) -> Option<$crate::Terminal> {
                match self {
                    Self::name $(| Self::$leaf)* => Some($crate::Terminal::Word),
                    Self::string => Some($crate::Terminal::String),
                    Self::semicolon => Some($crate::Terminal::Semicolon),
                    _ => None,
                }
            }

            #[allow(unreachable_patterns, reason = "a language may call a shared rule by another word")]
            fn description(self) -> Option<&'static str> {
                Some(match self {
                    $($(Self::$rule)|+ => $word,)+
                    Self::EOI => "the end of the file",
                    Self::name => "a name",
                    Self::string => "a text in quotes",
                    Self::number => "a number",
                    Self::literal => "a value",
                    Self::semicolon | Self::begins_next => "`;`",
                    Self::open => "`{`",
                    Self::close => "`}`",
                    Self::open_round => "`(`",
                    Self::close_round => "`)`",
                    Self::comma => "`,`",
                    Self::colon => "`:`",
                    _ => return None,
                })
            }
        }
    };
}

/// One text on its way to a tree, and what was found wrong with it on the way.
#[derive(Debug)]
pub struct ParseContext<'a> {
    /// The text's place among the sources.
    pub source: SourceId,
    /// The text.
    pub text: &'a str,
    /// Its comments.
    pub trivia: Trivia<'a>,
    /// What was found so far.
    pub found: Diagnostics,
}

impl<'a> ParseContext<'a> {
    /// A reader of one text of `sources`.
    pub fn new(sources: &'a SourceMap, source: SourceId) -> Self {
        let text = sources.text(source);
        Self {
            source,
            text,
            trivia: Trivia::new(text),
            found: Diagnostics::new(),
        }
    }

    /// The parts of a whole file, or a finding and none.
    pub fn file<R: Language>(&mut self) -> Option<Pairs<'a, R>> {
        let problem = self.unreadable::<R>();
        if let Some(problem) = problem {
            self.found.push(problem);
            return None;
        }
        if let Ok(mut pairs) = R::Grammar::parse(R::FILE, self.text) {
            return pairs.next().map(Pair::into_inner);
        }
        let found = syntax_error(R::FILE, self.text, 0, self.text, self.source);
        self.found.extend(found);
        None
    }

    /// What makes it useless to begin.
    fn unreadable<R: Language>(&self) -> Option<Diagnostic> {
        if let Some(at) = self.trivia.unclosed() {
            let message = "this comment has no end: `*/` is missing";
            let span = Span::new(self.source, at, at + 2);
            return Some(Diagnostic::error("unclosed-comment", span, message));
        }
        if self.trivia.is_blank() {
            let message = format!("this file is empty; it should hold {}", R::FILE_CONTENT);
            let span = Span::new(self.source, 0, 0);
            return Some(Diagnostic::error("empty-file", span, message));
        }
        check_nesting(self.text, self.source)
    }

    /// The text after the end of what a file holds.
    pub fn trailing<R: Language>(&mut self, pair: &Pair<'_, R>) {
        let holds = R::FILE_CONTENT;
        let message = if pair.as_str().starts_with('#') {
            "`#` begins nothing here: an include guard of old is not needed, delete its lines"
                .into()
        } else {
            format!("there is text after the end; a file holds one {holds}")
        };
        let first = pair.as_str().lines().next().unwrap_or_default();
        let start = pair.as_span().start();
        let span = Span::new(self.source, start, start + first.trim_end().len());
        self.found
            .push(Diagnostic::error("text-after-end", span, message));
    }

    /// The place of a pair, without the white space and comments that pest may count to its end.
    pub fn span<R: RuleType>(&self, pair: &Pair<'_, R>) -> Span {
        let span = pair.as_span();
        let end = self.trivia.end_of_token_before(span.end());
        Span::new(self.source, span.start(), end.max(span.start()))
    }

    /// The text of a pair and its place.
    pub fn name<R: RuleType>(&self, pair: &Pair<'_, R>) -> Name {
        let span = self.span(pair);
        Name::new(&self.text[span.start..span.end], span)
    }

    /// The content of a text in quotes, and the place of all of it.
    pub fn string<R: RuleType>(&self, pair: &Pair<'_, R>) -> Name {
        Name::new(unescape(pair.as_str()), self.span(pair))
    }

    /// The value that a pair holds.
    pub fn literal<R: RuleType>(&self, pair: &Pair<'_, R>) -> Literal {
        Literal::parse(pair.as_str(), self.span(pair))
    }

    /// The documentation directly before a pair.
    pub fn doc<R: RuleType>(&self, pair: &Pair<'_, R>) -> Vec<String> {
        self.trivia.documentation(pair.as_span().start())
    }

    /// Reports the `;` that this pair should be, where it is empty.
    pub fn semicolon<R: RuleType>(&mut self, pair: &Pair<'_, R>) {
        if pair.as_str().is_empty() {
            let end = self.trivia.end_of_token_before(pair.as_span().start());
            let span = Span::new(self.source, end, end);
            let message = "`;` expected here";
            self.found
                .push(Diagnostic::error("missing-semicolon", span, message));
        }
    }

    /// The first word of a pair, or its first character where it begins with none.
    pub fn first_word<R: RuleType>(&self, pair: &Pair<'_, R>) -> Name {
        let text = pair.as_str();
        let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_'));
        let end = match end.unwrap_or(text.len()) {
            0 => text.chars().next().map_or(0, char::len_utf8),
            end => end,
        };
        let start = pair.as_span().start();
        Name::new(&text[..end], Span::new(self.source, start, start + end))
    }

    /// The names, numbers and texts directly inside a pair, its `;` checked.
    pub fn texts<R: Language>(&mut self, pair: Pair<'_, R>) -> Vec<Name> {
        let mut texts = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule().terminal() {
                Some(Terminal::Word) => texts.push(self.name(&part)),
                Some(Terminal::String) => texts.push(self.string(&part)),
                Some(Terminal::Semicolon) => self.semicolon(&part),
                None => {}
            }
        }
        texts
    }

    /// Says why a piece cannot be read as `rule`, which is what it looks like.
    pub fn report_skipped<R: Language>(&mut self, pair: &Pair<'_, R>, rule: R) {
        let offset = pair.as_span().start();
        let found = syntax_error(rule, pair.as_str(), offset, self.text, self.source);
        let found = found.unwrap_or_else(|| {
            Diagnostic::error("syntax-error", self.span(pair), "this cannot be read here")
        });
        self.found.push(found);
    }
}
