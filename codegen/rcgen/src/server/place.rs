//! Places of files and texts as the protocol has them: addresses, and lines with characters from 0.

use rc_diagnostics::{SourceId, SourceMap, Span};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

/// The unit in which a client counts columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Encoding {
    Utf8,
    /// The unit of a client that names none.
    #[default]
    Utf16,
    Utf32,
}

impl Encoding {
    /// The encoding to use, of those that a client offers.
    pub(super) fn of(offered: &Value) -> Self {
        let offered: Vec<&str> = offered.as_array().map_or_else(Vec::new, |all| {
            all.iter().filter_map(Value::as_str).collect()
        });
        let all = [Self::Utf8, Self::Utf32];
        let best = all.into_iter().find(|one| offered.contains(&one.word()));
        best.unwrap_or_default()
    }

    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Utf8 => "utf-8",
            Self::Utf16 => "utf-16",
            Self::Utf32 => "utf-32",
        }
    }

    /// The length of a text in units of the client.
    pub(super) fn count(self, text: &str) -> usize {
        match self {
            Self::Utf16 | Self::Utf32 if text.is_ascii() => text.len(),
            Self::Utf8 => text.len(),
            Self::Utf16 => text.encode_utf16().count(),
            Self::Utf32 => text.chars().count(),
        }
    }

    /// A range of a text.
    pub(super) fn range(self, sources: &SourceMap, span: Span) -> Value {
        let text = sources.text(span.source);
        let position = |at: usize| {
            let at = at.min(text.len());
            let line = sources.position(span.source, at).line - 1;
            let (start, _) = sources.lines(Span::new(span.source, at, at));
            let before = text.get(start..at).unwrap_or_default();
            json!({ "line": line, "character": self.count(before) })
        };
        json!({ "start": position(span.start), "end": position(span.end) })
    }
}

/// A text with its lines.
#[derive(Debug)]
pub(super) struct Text {
    sources: SourceMap,
    source: SourceId,
}

impl Default for Text {
    fn default() -> Self {
        Self::new("")
    }
}

impl Text {
    pub(super) fn new(text: impl Into<String>) -> Self {
        let mut sources = SourceMap::new();
        let source = sources.add("", text);
        Self { sources, source }
    }

    pub(super) fn as_str(&self) -> &str {
        self.sources.text(self.source)
    }

    /// The byte at a position. After the end of a line, the end of the line.
    pub(super) fn byte(&self, encoding: Encoding, position: &Value) -> Option<usize> {
        let line = usize::try_from(position["line"].as_u64()?).ok()?;
        let character = usize::try_from(position["character"].as_u64()?).ok()?;
        let (start, end) = self.sources.line(self.source, line)?;
        let mut counted = 0;
        let before = self.as_str()[start..end].char_indices().find(|(_, c)| {
            let here = counted;
            counted += encoding.count(c.encode_utf8(&mut [0; 4]));
            here >= character || counted > character
        });
        Some(before.map_or(end, |(at, _)| start + at))
    }

    /// The bytes of a range. A part outside the text is cut off; a range that ends before it starts
    /// is reversed.
    pub(super) fn bytes(&self, encoding: Encoding, range: &Value) -> Option<(usize, usize)> {
        let place = |position: &Value| {
            position["line"].as_u64()?;
            position["character"].as_u64()?;
            let byte = self.byte(encoding, position);
            Some(byte.unwrap_or(self.as_str().len()))
        };
        let (start, end) = (place(&range["start"])?, place(&range["end"])?);
        Some((start.min(end), start.max(end)))
    }

    /// The range of a part.
    pub(super) fn range(&self, encoding: Encoding, start: usize, end: usize) -> Value {
        encoding.range(&self.sources, Span::new(self.source, start, end))
    }

    /// The range of all of it.
    pub(super) fn whole(&self, encoding: Encoding) -> Value {
        self.range(encoding, 0, self.as_str().len())
    }

    /// The line of a byte, from 0.
    pub(super) fn line(&self, at: usize) -> usize {
        self.sources.position(self.source, at).line - 1
    }

    /// The bytes of a line, from 0, without its end.
    pub(super) fn bytes_of_line(&self, line: usize) -> Option<(usize, usize)> {
        self.sources.line(self.source, line)
    }
}

/// The path of a file by its address, `file://…`.
pub(super) fn path(uri: &str) -> Option<PathBuf> {
    let rest = uri.strip_prefix("file://")?;
    // A host comes before the path; only the own one has files.
    let rest = rest.strip_prefix("localhost").unwrap_or(rest);
    if !rest.starts_with('/') {
        return None;
    }
    let mut bytes = Vec::with_capacity(rest.len());
    let mut all = rest.bytes();
    while let Some(byte) = all.next() {
        bytes.push(match byte {
            b'%' => {
                let mut digit = || char::from(all.next()?).to_digit(16);
                let (high, low) = (digit()?, digit()?);
                u8::try_from(high * 16 + low).ok()?
            }
            byte => byte,
        });
    }
    Some(OsString::from_vec(bytes).into())
}

/// The address of a file.
pub(super) fn uri(path: &Path) -> String {
    let mut out = "file://".to_owned();
    for byte in path.as_os_str().as_bytes() {
        let plain = byte.is_ascii_alphanumeric() || b"/-._~".contains(byte);
        if plain {
            out.push(char::from(*byte));
        } else {
            out.push_str(&format!("%{byte:02X}"));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_paths_are_inverse() {
        for text in ["/a/b.cdsl", "/a b/é%/c#d?.idsl", "/"] {
            let address = uri(Path::new(text));
            assert!(address.is_ascii(), "{address}");
            assert_eq!(path(&address), Some(PathBuf::from(text)));
        }
        for wrong in [
            "http://a/b",
            "file://host/a",
            "file:///%",
            "file:///%g0",
            "",
        ] {
            assert_eq!(path(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn characters_are_counted_as_the_client_does() {
        let mut sources = SourceMap::new();
        let source = sources.add("a", "x\r\né😀y\n");
        let span = Span::new(source, 9, 10);
        for (encoding, column) in [
            (Encoding::Utf8, 6),
            (Encoding::Utf16, 3),
            (Encoding::Utf32, 2),
        ] {
            let range = encoding.range(&sources, span);
            assert_eq!(range["start"], json!({ "line": 1, "character": column }));
            assert_eq!(range["end"]["character"], column + 1);
        }
    }
}
