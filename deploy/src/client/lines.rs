//! Lines out of a stream of bytes, each with a bounded length.

use std::io::{self, Read};

/// The longest line of any protocol here, where nothing else is said.
pub(crate) const LIMIT: usize = 64 * 1024;

/// What becomes of a line that is longer than the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overlong {
    /// It is left out, and reported as [`Line::TooLong`].
    Skip,
    /// It becomes several lines.
    Split,
}

/// One line, without its end.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// The line; what is not UTF-8 in it is replaced.
    Text(String),
    /// A line that was left out.
    TooLong,
}

/// Collects bytes until a line is complete.
#[derive(Debug)]
pub(crate) struct Lines {
    pending: Vec<u8>,
    skipping: bool,
    overlong: Overlong,
    limit: usize,
}

impl Lines {
    pub(crate) fn new(overlong: Overlong) -> Self {
        Self::up_to(LIMIT, overlong)
    }

    /// Lines of at most `limit` bytes.
    pub(crate) fn up_to(limit: usize, overlong: Overlong) -> Self {
        Self {
            pending: Vec::new(),
            skipping: false,
            overlong,
            limit,
        }
    }

    /// The lines that these bytes complete.
    pub(crate) fn push(&mut self, bytes: &[u8]) -> Vec<Line> {
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

    /// The last line, if the stream ended without an end of line.
    pub(crate) fn finish(&mut self) -> Option<Line> {
        self.skipping = false;
        (!self.pending.is_empty()).then(|| self.take())
    }

    fn extend(&mut self, mut text: &[u8], lines: &mut Vec<Line>) {
        if self.skipping {
            return;
        }
        while self.pending.len() + text.len() > self.limit {
            if self.overlong == Overlong::Skip {
                self.pending.clear();
                self.skipping = true;
                lines.push(Line::TooLong);
                return;
            }
            let (now, later) = text.split_at(self.limit - self.pending.len());
            self.pending.extend_from_slice(now);
            lines.push(self.take());
            text = later;
        }
        self.pending.extend_from_slice(text);
    }

    fn take(&mut self) -> Line {
        let text = String::from_utf8_lossy(&self.pending).into_owned();
        self.pending.clear();
        Line::Text(text)
    }

    /// One read of a stream that does not block: its lines, and whether it has ended.
    ///
    /// A broken stream has ended, whatever broke it.
    pub(crate) fn read(&mut self, mut stream: impl Read) -> (Vec<Line>, bool) {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Line {
        Line::Text(text.to_owned())
    }

    #[test]
    fn lines_are_put_together_from_pieces() {
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
        let mut split = Lines::new(Overlong::Split);
        let whole = "x".repeat(LIMIT);
        assert_eq!(split.push(&long), [text(&whole), text("xxx"), text("next")]);
    }
}
