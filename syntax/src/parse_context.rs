//! Parsing with pest, and the conversions from pest's pairs that all languages share.

use crate::scan::statement_of;
use crate::syntax_error::{check_nesting, help_for, syntax_error};
use crate::{Literal, Name, Trivia, lexical, unescape};
use pest::iterators::{Pair, Pairs};
use pest::{Parser, RuleType};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceId, SourceMap, Span};

/// The rules of one language's grammar.
pub trait Language: RuleType {
    /// The parser that pest generated from the grammar.
    type Grammar: Parser<Self>;
    /// The rule for a whole file.
    const FILE: Self;
    /// Content of a file, for messages: `` `module NAME { … };` ``.
    const FILE_CONTENT: &'static str;
    /// Whether a word after a number is a unit of time.
    const HAS_DURATIONS: bool = true;
    /// Whether `<` opens a bracket, as in `sequence<int>`.
    const HAS_ANGLE_BRACKETS: bool = true;
    /// The terminal that this rule matches, if it is one.
    fn terminal(self) -> Option<Terminal>;
    /// How messages name what this rule matches. Messages omit a rule without a description.
    fn description(self) -> Option<&'static str>;
}

/// The terminals of most declarations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terminal {
    /// A name or a number.
    Word,
    /// A quoted string.
    String,
    /// A `;`. An empty match means that the `;` is missing.
    Semicolon,
    /// The `}` of a block. An empty match means that the file ends before it.
    Close,
}

/// Implements [`Language`] for the `Rule` enum that pest generates together with `Grammar`.
///
/// Arguments: the content of a file for messages; the rules besides `name` that are words; constants
/// of [`Language`] that differ from its own; the descriptions of the rules that are not in `common.pest`.
#[macro_export]
macro_rules! language {
    ($content:literal, words: [$($word_rule:ident),*], $($option:ident = $value:literal,)* { $($($rule:ident)|+ => $word:literal,)+ }) => {
        impl $crate::Language for Rule {
            type Grammar = Grammar;
            const FILE: Self = Self::file;
            const FILE_CONTENT: &'static str = $content;
            $(const $option: bool = $value;)*

            fn terminal(self) -> Option<$crate::Terminal> {
                match self {
                    Self::name $(| Self::$word_rule)* => Some($crate::Terminal::Word),
                    Self::string => Some($crate::Terminal::String),
                    Self::semicolon => Some($crate::Terminal::Semicolon),
                    Self::close => Some($crate::Terminal::Close),
                    _ => None,
                }
            }

            #[allow(unreachable_patterns, reason = "a language may describe a shared rule otherwise")]
            fn description(self) -> Option<&'static str> {
                Some(match self {
                    $($(Self::$rule)|+ => $word,)+
                    Self::EOI => "the end of the file",
                    Self::name => "a name",
                    Self::string => "a string",
                    Self::number => "a number",
                    Self::literal => "a value",
                    Self::semicolon | Self::begins_next => "`;`",
                    Self::open => "`{`",
                    Self::close | Self::at_end => "`}`",
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

/// The state of parsing one text.
#[derive(Debug)]
pub struct ParseContext<'a> {
    /// The text's identifier.
    pub source: SourceId,
    /// The text.
    pub text: &'a str,
    /// Comments of the file.
    pub trivia: Trivia<'a>,
    /// The diagnostics so far.
    pub found: Diagnostics,
    /// Findings about characters and numbers.
    lexical: Vec<Diagnostic>,
    /// Whether the file ends before its blocks.
    unclosed: bool,
}

impl<'a> ParseContext<'a> {
    /// A context for one text of `sources`.
    pub fn new(sources: &'a SourceMap, source: SourceId) -> Self {
        let text = sources.text(source);
        Self {
            source,
            text,
            trivia: Trivia::new(text),
            found: Diagnostics::new(),
            lexical: Vec::new(),
            unclosed: false,
        }
    }

    /// Parses the whole file. Reports an error and returns `None` if no rule matches.
    pub fn file<R: Language>(&mut self) -> Option<Pairs<'a, R>> {
        if let Some(error) = self.check_text::<R>() {
            self.found.push(error);
            return None;
        }
        self.lexical = lexical::check(self.text, self.source, R::HAS_DURATIONS);
        if let Ok(mut pairs) = R::Grammar::parse(R::FILE, self.text) {
            let content = pairs.next().map(Pair::into_inner)?;
            // Only the end of the file matches nothing in the place of a `}`.
            self.unclosed = content
                .clone()
                .flatten()
                .rev()
                .take_while(|pair| pair.as_span().end() == self.text.len())
                .any(|pair| {
                    pair.as_rule().terminal() == Some(Terminal::Close) && pair.as_str().is_empty()
                });
            return Some(content);
        }
        if self.lexical.iter().all(|d| d.severity != Severity::Error) {
            let found = syntax_error(R::FILE, self.text, 0, self.text, self.source);
            self.found.extend(found);
        }
        None
    }

    /// All diagnostics. If a character or a number of a statement is an error, no other error of
    /// this statement is among them: the parser could only say that it expected something else.
    pub fn finish(mut self) -> Diagnostics {
        self.report_unclosed();
        let errors = self
            .lexical
            .iter()
            .filter(|d| d.severity == Severity::Error);
        let faulty = statement_of(self.text, errors.map(|d| d.span.start));
        if faulty.is_empty() && self.lexical.is_empty() {
            return self.found;
        }
        let mut all = Diagnostics::new();
        all.extend(self.found.into_iter().filter(|d| {
            let at = faulty.partition_point(|(_, end)| *end < d.span.start);
            let inside = faulty
                .get(at)
                .is_some_and(|(start, _)| *start <= d.span.start);
            !inside || d.severity != Severity::Error
        }));
        all.extend(self.lexical);
        all
    }

    /// Reports that the file ends before its blocks, once for all of them, and not where another
    /// error says so.
    fn report_unclosed(&mut self) {
        let end = self.text.len();
        let span = Span::new(self.source, end, end);
        if self.unclosed && self.found.iter().all(|known| known.span != span) {
            let message = "expected `}`, found the end of the file";
            self.found
                .push(Diagnostic::error("syntax-error", span, message));
        }
    }

    /// Checks that make parsing pointless if they fail.
    fn check_text<R: Language>(&self) -> Option<Diagnostic> {
        if let Some(at) = self.trivia.unclosed() {
            let span = Span::new(self.source, at, at + 2);
            let diagnostic =
                Diagnostic::error("unclosed-comment", span, "unterminated block comment");
            return Some(diagnostic.help("end the comment with `*/`"));
        }
        if self.trivia.is_blank() {
            let message = format!("expected {}, found an empty file", R::FILE_CONTENT);
            let span = Span::new(self.source, 0, 0);
            return Some(Diagnostic::error("empty-file", span, message));
        }
        check_nesting(self.text, self.source, R::HAS_ANGLE_BRACKETS)
    }

    /// Reports text after the content of the file.
    pub fn trailing<R: Language>(&mut self, pair: &Pair<'_, R>) {
        let content = R::FILE_CONTENT;
        let message = format!("unexpected text: a file contains one {content}");
        let first = pair.as_str().lines().next().unwrap_or_default();
        let start = pair.as_span().start();
        let span = Span::new(self.source, start, start + first.trim_end().len());
        let diagnostic = Diagnostic::error("text-after-end", span, message);
        self.found.push(match help_for(first) {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
    }

    /// The location of a pair, without trailing white space and comments.
    pub fn span<R: RuleType>(&self, pair: &Pair<'_, R>) -> Span {
        let span = pair.as_span();
        let end = self.trivia.end_of_token_before(span.end());
        Span::new(self.source, span.start(), end.max(span.start()))
    }

    /// The text and the location of a pair.
    pub fn name<R: RuleType>(&self, pair: &Pair<'_, R>) -> Name {
        let span = self.span(pair);
        Name::new(&self.text[span.start..span.end], span)
    }

    /// The content of a string. The location includes the quotes.
    pub fn string<R: RuleType>(&self, pair: &Pair<'_, R>) -> Name {
        Name::new(unescape(pair.as_str()), self.span(pair))
    }

    /// The literal that a pair matched.
    pub fn literal<R: RuleType>(&self, pair: &Pair<'_, R>) -> Literal {
        Literal::parse(pair.as_str(), self.span(pair))
    }

    /// The documentation directly before a pair.
    pub fn doc<R: RuleType>(&self, pair: &Pair<'_, R>) -> Vec<String> {
        self.trivia.documentation(pair.as_span().start())
    }

    /// Reports a missing `;` if the pair is empty.
    pub fn semicolon<R: RuleType>(&mut self, pair: &Pair<'_, R>) {
        if pair.as_str().is_empty() {
            let end = self.trivia.end_of_token_before(pair.as_span().start());
            let span = Span::new(self.source, end, end);
            let message = "expected `;`";
            let error = Diagnostic::error("missing-semicolon", span, message);
            self.found.push(error.fix("", ";"));
        }
    }

    /// The first word of a pair. If it does not begin with a word, its first character.
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

    /// The words and strings directly inside a pair. Reports a missing `;`.
    pub fn texts<R: Language>(&mut self, pair: Pair<'_, R>) -> Vec<Name> {
        let mut texts = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule().terminal() {
                Some(Terminal::Word) => texts.push(self.name(&part)),
                Some(Terminal::String) => texts.push(self.string(&part)),
                Some(Terminal::Semicolon) => self.semicolon(&part),
                Some(Terminal::Close) | None => {}
            }
        }
        texts
    }

    /// Reports why skipped input does not match `rule`, which is the rule it resembles.
    pub fn report_skipped<R: Language>(&mut self, pair: &Pair<'_, R>, rule: R) {
        self.report_skipped_with(pair, rule, |_, _| None);
    }

    /// The same. `help` says what to write instead of what people know from other languages: it has
    /// the skipped text before the place of the error, and that from there on.
    pub fn report_skipped_with<R: Language>(
        &mut self,
        pair: &Pair<'_, R>,
        rule: R,
        help: impl FnOnce(&str, &str) -> Option<String>,
    ) {
        let skipped = pair.as_span();
        let (offset, end) = (skipped.start(), skipped.end());
        let found = syntax_error(rule, pair.as_str(), offset, self.text, self.source);
        let found = found.unwrap_or_else(|| {
            Diagnostic::error("syntax-error", self.span(pair), "invalid syntax")
        });
        let at = found.span.start.clamp(offset, end);
        self.found
            .push(match help(&self.text[offset..at], &self.text[at..end]) {
                Some(help) => found.help(help),
                None => found,
            });
    }
}
