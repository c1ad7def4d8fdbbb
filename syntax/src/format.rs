//! The formatter of all languages. It changes only white space and redundant or missing `;`.
//!
//! All languages consist of statements that end with `;`, blocks in braces and lists with commas.
//! So one printer of tokens formats all of them. It works on tokens and comments instead of syntax
//! trees, and therefore never loses a comment.

use crate::scan::{SegmentKind, lines, segments};
use rc_vocabulary::duration;

/// The maximum width. Longer lines are broken after a comma or before `throws`.
const WIDTH: usize = 100;

/// The formatting options of a language.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style {
    /// `<` and `>` are brackets around types. Otherwise they are operators.
    pub angle_brackets: bool,
    /// Braces without a `;` in them are the block of an enum: on one line if it fits, otherwise one
    /// name per line. Without this option, they are part of a statement.
    pub enum_blocks: bool,
    /// Braces at this depth or deeper stay on the line of their statement.
    pub inline_braces_from: Option<usize>,
}

/// Formats `text`, and keeps its ends of lines. If the text has syntax errors, the result is unspecified, but the call returns.
pub fn format(text: &str, style: Style) -> String {
    let mut printer = Printer {
        tokens: tokens(text),
        at: 0,
        style,
        out: String::with_capacity(text.len() + text.len() / 4),
    };
    while printer.at < printer.tokens.len() {
        printer.entries(0, ";");
        // Skip an unmatched `}`: `entries` does not consume it.
        printer.at += 1;
    }
    printer.end_line();
    with_ends_of(text, printer.out)
}

/// The lines of `formatted`, which end with LF, with the ends of lines of `text`: CR and LF if its
/// first line ends so.
pub fn with_ends_of(text: &str, formatted: String) -> String {
    let first = text.find('\n').unwrap_or_default();
    if text[..first].ends_with('\r') {
        // A comment of InnerModel keeps the ends of its lines.
        return formatted.replace("\r\n", "\n").replace('\n', "\r\n");
    }
    formatted
}

fn ends_of_lines(blank: &str) -> usize {
    let both = blank.matches("\r\n").count();
    blank.matches(['\n', '\r']).count() - both
}

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TokenKind {
    /// A name, a keyword or a number.
    Word,
    /// A string with its quotes, of which the second one may be missing.
    String,
    /// One or two signs.
    Punctuation,
    /// A comment.
    Comment,
}

/// A token of a text, which may be a broken one.
#[derive(Clone, Copy, Debug)]
pub struct Token<'a> {
    /// Its kind.
    pub kind: TokenKind,
    /// Its text.
    pub text: &'a str,
    /// Offset of its first byte.
    pub start: usize,
    /// Number of ends of lines before this token.
    newlines: usize,
    /// No white space is before this token.
    joint: bool,
    /// A unit of time after a number.
    unit: bool,
}

/// Punctuation of two characters. All other punctuation has one.
const TWO_CHARACTER_PUNCTUATION: [&str; 7] = ["::", "->", "=>", "==", "!=", "<=", ">="];

/// The tokens of a text, with its comments.
pub fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens: Vec<Token<'_>> = Vec::new();
    let (mut newlines, mut joint) = (0, true);
    for (segment, start, stop) in segments(text) {
        let mut rest = &text[start..stop];
        while !rest.is_empty() {
            let blank = rest.len() - rest.trim_start().len();
            if blank > 0 && segment == SegmentKind::Code {
                newlines += ends_of_lines(&rest[..blank]);
                joint = false;
                rest = &rest[blank..];
                continue;
            }
            let (kind, length) = match segment {
                SegmentKind::Comment => (TokenKind::Comment, rest.len()),
                SegmentKind::String => (TokenKind::String, rest.len()),
                SegmentKind::Code => code_token(rest),
            };
            let (token, after) = rest.split_at(length);
            let number = |t: &Token<'_>| {
                t.kind == TokenKind::Word && t.text.bytes().all(|b| b.is_ascii_digit() || b == b'.')
            };
            tokens.push(Token {
                kind,
                text: token.trim_end(),
                start: stop - rest.len(),
                newlines,
                joint,
                unit: duration::is_unit(token) && tokens.last().is_some_and(number),
            });
            (newlines, joint) = (0, true);
            rest = after;
        }
    }
    tokens
}

/// The kind and the length of the first token of `rest`.
fn code_token(rest: &str) -> (TokenKind, usize) {
    let bytes = rest.as_bytes();
    let word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
    if !word(bytes[0]) {
        let pair = TWO_CHARACTER_PUNCTUATION
            .iter()
            .find(|p| rest.starts_with(**p));
        let one = rest.chars().next().map_or(1, char::len_utf8);
        return (TokenKind::Punctuation, pair.map_or(one, |p| p.len()));
    }
    let number = bytes[0].is_ascii_digit();
    let hexadecimal = rest.starts_with("0x");
    let mut end = 1;
    while let Some(byte) = bytes.get(end) {
        let digit_next = bytes.get(end + 1).is_some_and(u8::is_ascii_digit);
        let fraction = *byte == b'.' && digit_next;
        let exponent = matches!(byte, b'+' | b'-')
            && !hexadecimal
            && matches!(bytes[end - 1], b'e' | b'E')
            && digit_next;
        if !(word(*byte) || number && (fraction || exponent)) {
            break;
        }
        end += 1;
    }
    // The language, which is a word to people.
    if end == 1 && matches!(bytes[0], b'c' | b'C') && rest[end..].starts_with("++") {
        end = 3;
    }
    (TokenKind::Word, end)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Break {
    Never,
    May,
    Must,
}

/// A token with the white space before it.
struct Piece {
    text: String,
    space: bool,
    before: Break,
}

struct Printer<'a> {
    tokens: Vec<Token<'a>>,
    at: usize,
    style: Style,
    out: String,
}

impl<'a> Printer<'a> {
    fn peek(&self) -> Option<Token<'a>> {
        self.tokens.get(self.at).copied()
    }

    /// Prints the statements of a block, or the names of an enum, up to the closing brace.
    fn entries(&mut self, depth: usize, end: &str) {
        let mut first = true;
        while let Some(token) = self.peek() {
            if token.text == "}" && token.kind == TokenKind::Punctuation {
                return;
            }
            // Drop a redundant `;`, unless it separates a comment from the next declaration.
            let behind_comment = |at: usize| self.tokens[at - 1].kind == TokenKind::Comment;
            if token.kind == TokenKind::Punctuation
                && token.text == ";"
                && !(self.at > 0 && behind_comment(self.at))
            {
                self.at += 1;
                continue;
            }
            let comment = token.kind == TokenKind::Comment;
            if comment && token.newlines == 0 && !self.out.is_empty() {
                self.out.push(' ');
                self.comment(token.text, depth);
                self.at += 1;
                first = false;
                continue;
            }
            self.end_line();
            if token.newlines > 1 && !first && !self.out.is_empty() {
                self.out.push('\n');
            }
            if comment {
                self.indent(depth);
                self.comment(token.text, depth);
                self.at += 1;
            } else {
                self.statement(depth, end);
            }
            first = false;
        }
    }

    fn end_line(&mut self) {
        if !self.out.is_empty() && !self.out.ends_with('\n') {
            self.out.push('\n');
        }
    }

    fn indent(&mut self, depth: usize) {
        self.out.extend(std::iter::repeat_n("    ", depth));
    }

    fn comment(&mut self, text: &str, depth: usize) {
        let text = comment_lines(text, depth);
        self.out.push_str(&text);
    }

    /// Prints one statement with its `;`, or one name with its `,`, and its block if it has one.
    fn statement(&mut self, depth: usize, end: &str) {
        let mut line = Line::new(self.style.angle_brackets, depth);
        while let Some(token) = self.peek() {
            if token.kind != TokenKind::Punctuation {
                line.push(token);
                self.at += 1;
                continue;
            }
            match token.text {
                "}" => break,
                "{" => {
                    if self.braces(&mut line, depth) {
                        return;
                    }
                }
                text => {
                    line.push(token);
                    self.at += 1;
                    if text == end {
                        break;
                    }
                }
            }
        }
        line.print(&mut self.out);
    }

    /// Prints braces. Returns whether they ended the statement.
    fn braces(&mut self, line: &mut Line, depth: usize) -> bool {
        let inner = self.block_contents();
        let close = self.at + 1 + inner.len();
        let code = |t: &&Token<'_>| t.kind != TokenKind::Comment;
        let comments = inner.len() != inner.iter().filter(code).count();
        let statements =
            |t: &Token<'_>| t.kind == TokenKind::Punctuation && matches!(t.text, ";" | "{");
        let listed =
            inner.iter().any(|t| t.kind != TokenKind::Comment) && !inner.iter().any(statements);
        let one_line = inner.iter().all(|t| t.newlines == 0);
        let settings = self
            .style
            .inline_braces_from
            .is_some_and(|from| depth >= from);
        if settings || listed && !self.style.enum_blocks {
            (self.at..=close).for_each(|at| line.extend(self.tokens.get(at)));
            self.at = close + 1;
            return false;
        }
        let bare = inner
            .iter()
            .all(|t| t.kind == TokenKind::Punctuation && t.text == ";");
        if bare || listed && one_line && !comments {
            let pieces = line.pieces.len();
            let shown = |at: &usize| !bare || *at == self.at || *at == close;
            let shown = (self.at..=close).filter(shown);
            shown.for_each(|at| line.extend(self.tokens.get(at)));
            if bare || line.width() < WIDTH {
                self.at = close + 1;
                self.end_block(line);
                return true;
            }
            line.pieces.truncate(pieces);
        }
        line.print(&mut self.out);
        self.end_line();
        self.indent(depth);
        self.out.push('{');
        self.at += 1;
        self.entries(depth + 1, if listed { "," } else { ";" });
        self.end_line();
        let mut end = Line::new(self.style.angle_brackets, depth);
        end.extend(self.tokens.get(self.at));
        self.at += 1;
        self.end_block(&mut end);
        true
    }

    /// The tokens between the `{` at the current position and the matching `}`.
    fn block_contents(&self) -> &[Token<'a>] {
        let inner = &self.tokens[self.at + 1..];
        let mut depth = 0_usize;
        for (length, token) in inner.iter().enumerate() {
            match (token.kind, token.text) {
                (TokenKind::Punctuation, "{") => depth += 1,
                (TokenKind::Punctuation, "}") if depth == 0 => return &inner[..length],
                (TokenKind::Punctuation, "}") => depth -= 1,
                _ => {}
            }
        }
        inner
    }

    /// Prints the last line of a block with its optional `;`. Comments before the `;` stay before
    /// it: after it they would document the next declaration.
    fn end_block(&mut self, line: &mut Line) {
        let next =
            (self.at..self.tokens.len()).find(|i| self.tokens[*i].kind != TokenKind::Comment);
        let semicolon = next.filter(|i| self.tokens[*i].text == ";");
        if let Some(semicolon) = semicolon {
            (self.at..=semicolon).for_each(|at| line.extend(self.tokens.get(at)));
            self.at = semicolon + 1;
        } else {
            line.add(";", false, Break::Never);
        }
        line.print(&mut self.out);
    }
}

/// One statement before line breaking.
struct Line {
    pieces: Vec<Piece>,
    angle_brackets: bool,
    depth: usize,
    parentheses: usize,
    last: Option<(TokenKind, String)>,
    break_before_next: bool,
}

impl Line {
    fn new(angle_brackets: bool, depth: usize) -> Self {
        Self {
            pieces: Vec::new(),
            angle_brackets,
            depth,
            parentheses: 0,
            last: None,
            break_before_next: false,
        }
    }

    fn extend(&mut self, token: Option<&Token<'_>>) {
        if let Some(token) = token {
            self.push(*token);
        }
    }

    fn push(&mut self, token: Token<'_>) {
        let line_comment = token.kind == TokenKind::Comment && token.text.starts_with("//");
        let long_comment = token.kind == TokenKind::Comment && token.text.contains(['\n', '\r']);
        let after_comma = matches!(&self.last, Some((TokenKind::Punctuation, text)) if text == ",");
        let throws = self.angle_brackets && token.kind == TokenKind::Word && token.text == "throws";
        // Documentation must be on a line of its own.
        let own_line = long_comment || token.kind == TokenKind::Comment && token.newlines > 0;
        let before = if self.break_before_next || own_line {
            Break::Must
        } else if after_comma && token.kind != TokenKind::Comment || throws {
            Break::May
        } else {
            Break::Never
        };
        let space = self.space(token);
        let text = if token.kind == TokenKind::Comment {
            comment_lines(token.text, self.depth + 1)
        } else {
            token.text.to_owned()
        };
        self.add(&text, space, before);
        self.break_before_next = line_comment || own_line;
        match token.text {
            "(" => self.parentheses += 1,
            ")" => self.parentheses = self.parentheses.saturating_sub(1),
            _ => {}
        }
        self.last = Some((token.kind, token.text.to_owned()));
    }

    fn add(&mut self, text: &str, space: bool, before: Break) {
        let before = if self.break_before_next {
            Break::Must
        } else {
            before
        };
        self.break_before_next = false;
        self.pieces.push(Piece {
            text: text.to_owned(),
            space,
            before,
        });
    }

    /// Whether a space separates the last token from `next`.
    fn space(&self, next: Token<'_>) -> bool {
        let Some((kind, last)) = &self.last else {
            return false;
        };
        let last = last.as_str();
        if next.unit {
            return false;
        }
        if *kind == TokenKind::Comment || next.kind == TokenKind::Comment {
            return !(next.kind == TokenKind::Punctuation && matches!(next.text, "," | ";"));
        }
        // Only the grammar knows whether `-` is a hyphen or an operator, so its spacing is kept.
        // After other punctuation it is a sign.
        let value = *kind != TokenKind::Punctuation || matches!(last, ")" | "]");
        if *kind == TokenKind::Punctuation && last == "-"
            || next.kind == TokenKind::Punctuation && next.text == "-" && value
        {
            return !next.joint;
        }
        if *kind == TokenKind::Punctuation {
            match last {
                "(" | "[" | "@" | "::" | "." | ":" => return false,
                "<" if self.angle_brackets => return false,
                "=" if self.parentheses > 0 => return false,
                _ => {}
            }
        }
        if next.kind == TokenKind::Punctuation {
            let word = *kind == TokenKind::Word;
            match next.text {
                "," | ";" | ")" | "]" | "::" | "." => return false,
                "<" | ">" if self.angle_brackets => return false,
                "=" if self.parentheses > 0 => return false,
                "(" => {
                    let operator = ["and", "or", "not", "require"];
                    return !word || operator.iter().any(|o| last.eq_ignore_ascii_case(o));
                }
                "[" => return !word,
                ":" => return !(word && last.starts_with(|c: char| c.is_ascii_digit())),
                _ => {}
            }
        }
        true
    }

    fn width(&self) -> usize {
        let length: usize = self.pieces.iter().map(Piece::width).sum();
        self.depth * 4 + length
    }

    /// Fills lines up to [`WIDTH`]. Breaks where allowed, and after line comments.
    fn print(&self, out: &mut String) {
        let mut column = self.depth * 4;
        out.extend(std::iter::repeat_n("    ", self.depth));
        for (at, piece) in self.pieces.iter().enumerate() {
            let chunk = std::iter::once(piece).chain(
                self.pieces[at + 1..]
                    .iter()
                    .take_while(|p| p.before == Break::Never),
            );
            let must = piece.before == Break::Must;
            let may = piece.before == Break::May;
            if at > 0 && (must || may && column + chunk.map(Piece::width).sum::<usize>() > WIDTH) {
                out.push('\n');
                out.extend(std::iter::repeat_n("    ", self.depth + 1));
                column = (self.depth + 1) * 4;
            } else if piece.space {
                out.push(' ');
                column += 1;
            }
            out.push_str(&piece.text);
            column += piece.text.chars().count();
        }
    }
}

impl Piece {
    fn width(&self) -> usize {
        usize::from(self.space) + self.text.chars().count()
    }
}

/// Indents a multi-line comment if all of its lines begin with `*`.
fn comment_lines(text: &str, depth: usize) -> String {
    let mut all = lines(text).map(str::trim_end);
    let mut out = all.next().unwrap_or_default().to_owned();
    let starred = lines(text).skip(1).all(|l| l.trim_start().starts_with('*'));
    for line in all {
        out.push('\n');
        if starred {
            out.extend(std::iter::repeat_n("    ", depth));
            out.push(' ');
            out.push_str(line.trim_start());
        } else {
            out.push_str(line);
        }
    }
    out
}

#[cfg(test)]
mod tests;
