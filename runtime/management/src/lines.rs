//! Lines of bounded length from a stream of bytes.

use serde::Serialize;
use std::io::{self, Read};

/// The default limit of a line, in bytes without its end.
pub const LIMIT: usize = 64 * 1024;

/// Action of [`Lines`] on a line that exceeds its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlong {
    /// Skip the line and report [`Line::TooLong`] in its place.
    Skip,
    /// Skip the line and report [`Line::TooLong`] for each piece of it that is as long as the
    /// limit.
    Count,
    /// Split the line into several.
    Split,
}

/// One line, without its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// A line within the limit.
    Complete(Vec<u8>),
    /// A skipped line.
    TooLong,
}

impl Line {
    /// The bytes of a complete line.
    pub fn bytes(&self) -> Option<&[u8]> {
        match self {
            Self::Complete(bytes) => Some(bytes),
            Self::TooLong => None,
        }
    }

    /// How many bytes were received for it, with its end.
    pub fn size(&self) -> usize {
        match self {
            Self::Complete(bytes) => bytes.len() + 1,
            Self::TooLong => LIMIT,
        }
    }

    /// The text of a complete line; U+FFFD replaces invalid UTF-8.
    pub fn into_text(self) -> Option<String> {
        match self {
            Self::Complete(bytes) => Some(match String::from_utf8(bytes) {
                Ok(text) => text,
                Err(error) => String::from_utf8_lossy(error.as_bytes()).into_owned(),
            }),
            Self::TooLong => None,
        }
    }
}

/// Collects bytes and returns complete lines. Never holds more bytes than its limit.
///
/// ```
/// use rc_management::lines::{Line, Lines, Overlong};
///
/// let mut lines = Lines::new(Overlong::Skip);
/// assert_eq!(lines.push(b"on"), []);
/// assert_eq!(lines.push(b"e\ntwo"), [Line::Complete(b"one".to_vec())]);
/// assert_eq!(lines.finish(), Some(Line::Complete(b"two".to_vec())));
/// ```
#[derive(Debug)]
pub struct Lines {
    pending: Vec<u8>,
    skipping: bool,
    /// How many skipped bytes are not counted yet.
    skipped: usize,
    overlong: Overlong,
    limit: usize,
}

impl Lines {
    /// Lines of at most [`LIMIT`] bytes.
    pub fn new(overlong: Overlong) -> Self {
        Self::up_to(LIMIT, overlong)
    }

    /// Lines of at most `limit` bytes.
    pub fn up_to(limit: usize, overlong: Overlong) -> Self {
        Self {
            pending: Vec::new(),
            skipping: false,
            skipped: 0,
            overlong,
            limit,
        }
    }

    /// Adds `bytes` and returns the lines that they complete.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Line> {
        let mut lines = Vec::new();
        for piece in bytes.split_inclusive(|&byte| byte == b'\n') {
            let (text, ended) = match piece.split_last() {
                Some((b'\n', text)) => (text, true),
                _ => (piece, false),
            };
            self.extend(text, &mut lines);
            if ended {
                if self.skipping {
                    self.skipping = false;
                } else {
                    lines.push(self.take());
                }
            }
        }
        lines
    }

    /// Returns the last line if the stream ended without an end of line.
    pub fn finish(&mut self) -> Option<Line> {
        self.skipping = false;
        (!self.pending.is_empty()).then(|| self.take())
    }

    fn extend(&mut self, mut text: &[u8], lines: &mut Vec<Line>) {
        if self.skipping {
            return self.skip(text.len(), lines);
        }
        while self.pending.len() + text.len() > self.limit {
            if self.overlong != Overlong::Split {
                let count = self.pending.len() + text.len();
                self.pending.clear();
                self.skipping = true;
                self.skipped = 0;
                lines.push(Line::TooLong);
                return self.skip(count - self.limit, lines);
            }
            let (now, later) = text.split_at(self.limit - self.pending.len());
            self.pending.extend_from_slice(now);
            lines.push(self.take());
            text = later;
        }
        self.pending.extend_from_slice(text);
    }

    fn skip(&mut self, count: usize, lines: &mut Vec<Line>) {
        if self.overlong == Overlong::Count {
            self.skipped += count;
            let pieces = self.skipped / self.limit;
            self.skipped %= self.limit;
            lines.extend(std::iter::repeat_n(Line::TooLong, pieces));
        }
    }

    fn take(&mut self) -> Line {
        Line::Complete(std::mem::take(&mut self.pending))
    }

    /// Reads once from a stream that does not block. Returns its lines, and whether the stream has
    /// ended.
    ///
    /// Every error except `WouldBlock` ends the stream. When it ends, the result holds the
    /// unfinished line, if any.
    pub fn read(&mut self, mut stream: impl Read) -> (Vec<Line>, bool) {
        let mut buffer = [0; 16 * 1024];
        loop {
            return match stream.read(&mut buffer) {
                Ok(0) => (self.finish().into_iter().collect(), true),
                Ok(count) => (self.push(&buffer[..count]), false),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => (Vec::new(), error.kind() != io::ErrorKind::WouldBlock),
            };
        }
    }
}

/// Writes a message as one line of JSON, with its end.
pub fn encode(message: &impl Serialize) -> Vec<u8> {
    // Messages consist of texts, numbers and maps with text keys, which JSON can always express.
    let mut line = serde_json::to_vec(message).unwrap_or_default();
    line.push(b'\n');
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Line {
        Line::Complete(text.as_bytes().to_vec())
    }

    #[test]
    fn pieces_are_joined_to_lines() {
        let mut lines = Lines::new(Overlong::Skip);
        assert_eq!(lines.push(b"on"), []);
        assert_eq!(
            lines.push(b"e\n\ntwo\nth"),
            [text("one"), text(""), text("two")]
        );
        assert_eq!(lines.finish(), Some(text("th")));
        assert_eq!(lines.finish(), None);
    }

    #[test]
    fn an_overlong_line_is_skipped_or_split() {
        let long = [&vec![b'x'; LIMIT + 3][..], b"\nnext\n"].concat();
        let mut skip = Lines::new(Overlong::Skip);
        assert_eq!(skip.push(&long), [Line::TooLong, text("next")]);
        let mut count = Lines::new(Overlong::Count);
        assert_eq!(count.push(&long), [Line::TooLong, text("next")]);
        assert_eq!(skip.push(&vec![b'x'; 3 * LIMIT]), [Line::TooLong]);
        assert_eq!(count.push(&vec![b'x'; 3 * LIMIT]), vec![Line::TooLong; 3]);
        let mut split = Lines::new(Overlong::Split);
        let whole = "x".repeat(LIMIT);
        assert_eq!(split.push(&long), [text(&whole), text("xxx"), text("next")]);
    }

    #[test]
    fn the_size_of_a_line_is_what_was_received_for_it() {
        assert_eq!(text("").size(), 1);
        assert_eq!(text("abc").size(), 4);
        assert_eq!(Line::TooLong.size(), LIMIT);
        assert_eq!(text("abc").bytes(), Some(&b"abc"[..]));
        assert_eq!(Line::TooLong.bytes(), None);
    }

    #[test]
    fn text_that_is_not_utf8_is_replaced() {
        assert_eq!(
            Line::Complete(b"a\xff".to_vec()).into_text().as_deref(),
            Some("a\u{fffd}")
        );
        assert_eq!(Line::TooLong.into_text(), None);
    }
}
