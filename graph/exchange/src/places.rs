//! Where the members of a JSON text are. Findings need this; reading does not.

use crate::older::OLDER;
use rc_diagnostics::{SourceId, Span};
use std::collections::HashMap;

/// How deep values are scanned. The text of an unknown member may nest deeper.
const DEEPEST: usize = 128;
/// The longest path that is kept, in bytes. Deeper values have the place of their container.
const LONGEST: usize = 1024;

/// Separates the names in a path.
pub(crate) const SEPARATOR: char = '\u{1}';

/// The places of all members of a text that is valid.
pub(crate) struct Places {
    source: SourceId,
    values: HashMap<String, (usize, usize)>,
}

impl Places {
    pub(crate) fn new(source: SourceId, text: &str) -> Self {
        let mut scanner = Scanner {
            text: text.as_bytes(),
            at: 0,
            values: HashMap::new(),
        };
        scanner.value(&mut String::new(), 0, true);
        Self {
            source,
            values: scanner.values,
        }
    }

    /// The place of a value, or of what holds it.
    pub(crate) fn of(&self, path: &str) -> Span {
        let mut path = path;
        loop {
            let oldest = || self.values.get(&oldest(path)?);
            if let Some((start, end)) = self.values.get(path).or_else(oldest) {
                return Span::new(self.source, *start, *end);
            }
            match path.rsplit_once(SEPARATOR) {
                Some((above, _)) => path = above,
                None => return Span::new(self.source, 0, 0),
            }
        }
    }
}

/// A path to an attribute as the oldest files of DSR name it.
fn oldest(path: &str) -> Option<String> {
    let (above, name) = path.rsplit_once(SEPARATOR)?;
    let (oldest, _) = OLDER.iter().find(|(_, present)| *present == name)?;
    Some(format!("{above}{SEPARATOR}{oldest}"))
}

struct Scanner<'t> {
    text: &'t [u8],
    at: usize,
    values: HashMap<String, (usize, usize)>,
}

impl Scanner<'_> {
    fn peek(&mut self) -> u8 {
        while self.text.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        self.text.get(self.at).copied().unwrap_or_default()
    }

    /// Skips a string, and returns its content with escapes as they are written.
    fn string(&mut self) -> String {
        let start = self.at + 1;
        self.at = start;
        while let Some(byte) = self.text.get(self.at) {
            match byte {
                b'\\' => self.at += 1,
                b'"' => break,
                _ => {}
            }
            self.at += 1;
        }
        let end = self.at.min(self.text.len());
        self.at += 1;
        String::from_utf8_lossy(&self.text[start.min(end)..end]).into_owned()
    }

    /// Scans a value, and keeps its place if it `is_kept`. It stops at a value that is too deep.
    fn value(&mut self, path: &mut String, depth: usize, is_kept: bool) {
        if depth > DEEPEST {
            self.at = self.text.len();
            return;
        }
        let first = self.peek();
        let start = self.at;
        let length = path.len();
        match first {
            b'{' => {
                self.at += 1;
                while !matches!(self.peek(), b'}' | 0) {
                    if self.peek() == b',' {
                        self.at += 1;
                        continue;
                    }
                    let name = self.string();
                    if self.peek() == b':' {
                        self.at += 1;
                    }
                    path.push(SEPARATOR);
                    path.push_str(&name);
                    self.value(path, depth + 1, true);
                    path.truncate(length);
                }
                self.at += 1;
            }
            b'[' => {
                self.at += 1;
                let mut count = 0;
                while !matches!(self.peek(), b']' | 0) {
                    if self.peek() == b',' {
                        self.at += 1;
                        continue;
                    }
                    path.push(SEPARATOR);
                    path.push_str(&count.to_string());
                    // A number of an array has the place of the array.
                    let is_kept = matches!(self.peek(), b'{' | b'[');
                    self.value(path, depth + 1, is_kept);
                    path.truncate(length);
                    count += 1;
                }
                self.at += 1;
            }
            b'"' => {
                self.string();
            }
            _ => {
                while let Some(byte) = self.text.get(self.at) {
                    if matches!(byte, b',' | b']' | b'}') || byte.is_ascii_whitespace() {
                        break;
                    }
                    self.at += 1;
                }
                // Nothing was read: the text is not valid.
                self.at = self.at.max(start + 1);
            }
        }
        let end = match first {
            // The first line of a value that has several says enough.
            b'{' | b'[' => start + 1,
            _ => self.at.min(self.text.len()),
        };
        if is_kept && path.len() <= LONGEST {
            self.values.insert(path.clone(), (start, end.max(start)));
        }
    }
}
