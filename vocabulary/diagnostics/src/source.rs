//! Source texts and locations in them.

use std::any::Any;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Identifies a text of a [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SourceId(u32);

impl SourceId {
    /// Its place in the map of sources.
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// A range of bytes, `start..end`, in one text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The text.
    pub source: SourceId,
    /// Offset of the first byte.
    pub start: usize,
    /// Offset after the last byte. Equal to `start` for a position between two characters.
    pub end: usize,
}

impl Span {
    /// The range `start..end` of `source`.
    pub fn new(source: SourceId, start: usize, end: usize) -> Self {
        Self { source, start, end }
    }

    /// The empty range at the end of this one, where a missing `;` belongs.
    #[must_use]
    pub fn after(self) -> Self {
        Self {
            start: self.end,
            ..self
        }
    }

    /// The smallest range that contains this one and `other`. Both must be of the same text.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        Self {
            start: self.start.min(other.start),
            end: self.end.max(other.end),
            ..self
        }
    }
}

/// A name or another piece of text, with its location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    /// The text as written; the content of a string.
    pub text: String,
    /// The location.
    pub span: Span,
}

impl Name {
    /// A name at a location.
    pub fn new(text: impl Into<String>, span: Span) -> Self {
        Self {
            text: text.into(),
            span,
        }
    }
}

/// Line and column. A tab counts as one column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

#[derive(Debug)]
struct Source {
    path: PathBuf,
    text: String,
    line_starts: Vec<usize>,
    /// The number of characters before each block of [`BLOCK`] bytes. `None` for ASCII, where each
    /// byte is a character.
    characters: Option<Vec<usize>>,
}

/// How many bytes are counted for one column at most, however long a line is.
const BLOCK: usize = 256;

impl Source {
    fn new(path: PathBuf, text: String) -> Self {
        let bytes = text.as_bytes();
        let ends = bytes.iter().enumerate().filter(|(at, byte)| match byte {
            b'\n' => true,
            b'\r' => bytes.get(at + 1) != Some(&b'\n'),
            _ => false,
        });
        let line_starts = std::iter::once(0).chain(ends.map(|(at, _)| at + 1));
        let line_starts = line_starts.collect();
        let characters = (!text.is_ascii()).then(|| {
            let blocks = bytes.chunks(BLOCK).scan(0, |sum, block| {
                let before = *sum;
                *sum += count(block);
                Some(before)
            });
            blocks.collect()
        });
        Self {
            path,
            text,
            line_starts,
            characters,
        }
    }

    /// The number of characters before byte `at`.
    fn characters_before(&self, at: usize) -> usize {
        let at = at.min(self.text.len());
        let Some(blocks) = &self.characters else {
            return at;
        };
        // The end of the text may be where a further block would begin.
        let block = (at / BLOCK).min(blocks.len() - 1);
        blocks[block] + count(&self.text.as_bytes()[block * BLOCK..at])
    }
}

/// The number of characters that begin in some bytes of UTF-8.
fn count(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| **byte & 0xc0 != 0x80).count()
}

/// All source texts of one run of a tool.
#[derive(Debug, Default)]
pub struct SourceMap {
    sources: Vec<Source>,
    /// Results of [`SourceMap::cached`], by path.
    cache: HashMap<PathBuf, (SourceId, Arc<dyn Any + Send + Sync>)>,
}

impl SourceMap {
    /// A map without texts.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a text and drops a byte order mark at its start.
    ///
    /// Each call adds a new entry, also for a known path: the caller of a component's loader counts
    /// the texts that the component consists of.
    pub fn add(&mut self, path: impl Into<PathBuf>, text: impl Into<String>) -> SourceId {
        let mut text = text.into();
        if text.starts_with('\u{feff}') {
            text.drain(..'\u{feff}'.len_utf8());
        }
        self.sources.push(Source::new(path.into(), text));
        SourceId((self.sources.len() - 1) as u32)
    }

    /// The result of `make` for a text. If an earlier call had the same path and the same text, its
    /// result is returned instead: spans in it stay valid, because path, line and column are equal.
    pub fn cached<T: Any + Send + Sync>(
        &mut self,
        source: SourceId,
        make: impl FnOnce(&Self, SourceId) -> T,
    ) -> Arc<T> {
        let known = self.cache.get(self.path(source));
        let known = known.filter(|(before, _)| self.text(*before) == self.text(source));
        if let Some(Ok(cache)) = known.map(|(_, cache)| Arc::clone(cache).downcast()) {
            return cache;
        }
        let cache = Arc::new(make(self, source));
        let path = self.path(source).to_path_buf();
        self.cache.insert(path, (source, cache.clone()));
        cache
    }

    /// The content of a text.
    pub fn text(&self, source: SourceId) -> &str {
        &self.sources[source.0 as usize].text
    }

    /// The path of a text, as the user or a loader named it.
    pub fn path(&self, source: SourceId) -> &Path {
        &self.sources[source.0 as usize].path
    }

    /// All texts, in the order in which they were added.
    pub fn ids(&self) -> impl Iterator<Item = SourceId> {
        (0..self.sources.len() as u32).map(SourceId)
    }

    /// The byte range of all lines that `span` touches, without the end of the last line.
    pub fn lines(&self, span: Span) -> (usize, usize) {
        let source = &self.sources[span.source.0 as usize];
        let line = |at: usize| source.line_starts.partition_point(|start| *start <= at);
        let start = source.line_starts[line(span.start.min(source.text.len())) - 1];
        let next = source.line_starts.get(line(span.end));
        let end = next.copied().unwrap_or(source.text.len());
        let text = source.text[..end].trim_end_matches(['\n', '\r']);
        (start, text.len().max(start))
    }

    /// The byte range of a line, from 0, without its end. `None` after the last line.
    pub fn line(&self, source: SourceId, line: usize) -> Option<(usize, usize)> {
        let start = *self.sources[source.0 as usize].line_starts.get(line)?;
        Some(self.lines(Span::new(source, start, start)))
    }

    /// The line and column of byte `at`, in a time that does not depend on the length of the line.
    pub fn position(&self, source: SourceId, at: usize) -> Position {
        let source = &self.sources[source.0 as usize];
        let line = source.line_starts.partition_point(|start| *start <= at);
        let start = source.line_starts[line - 1];
        let column = source.characters_before(at) - source.characters_before(start) + 1;
        Position { line, column }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_texts_of_one_file_share_an_id() {
        let mut map = SourceMap::new();
        let mut count = 0;
        let mut length = |path: &str, text: &str| {
            let id = map.add(path, text);
            *map.cached(id, |map, id| {
                count += 1;
                map.text(id).len()
            })
        };
        assert_eq!((length("a", "xy"), length("a", "xy")), (2, 2));
        assert_eq!((length("b", "xy"), length("a", "xyz")), (2, 3));
        assert_eq!(count, 3);
    }

    #[test]
    fn columns_count_characters() {
        let mut map = SourceMap::new();
        let id = map.add("a", "\u{feff}x\n\té;\n");
        assert_eq!(map.position(id, 0), Position { line: 1, column: 1 });
        assert_eq!(map.position(id, 5), Position { line: 2, column: 3 });
        assert_eq!(
            map.position(id, map.text(id).len()),
            Position { line: 3, column: 1 }
        );
    }

    #[test]
    fn columns_of_a_long_line_are_those_of_its_characters() {
        let mut map = SourceMap::new();
        let text = "a\n".to_owned() + &"é大x".repeat(1000);
        let id = map.add("a", text.as_str());
        for (column, (at, _)) in text[2..].char_indices().enumerate() {
            let wanted = Position {
                line: 2,
                column: column + 1,
            };
            assert_eq!(map.position(id, 2 + at), wanted);
        }
        assert_eq!(map.position(id, text.len()).column, 3001);
    }

    #[test]
    fn a_carriage_return_ends_a_line() {
        let mut map = SourceMap::new();
        let id = map.add("a", "a\rb\r\nc\nd");
        let line = |at| map.position(id, at).line;
        assert_eq!([0, 2, 5, 7].map(line), [1, 2, 3, 4]);
        assert_eq!(map.lines(Span::new(id, 2, 3)), (2, 3));
    }
}
