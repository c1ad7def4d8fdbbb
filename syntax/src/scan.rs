//! Splits a text into comments, strings and the code between them. `//` in a string is no comment.

/// The kind of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SegmentKind {
    Comment,
    String,
    Code,
}

/// The segments of `text` in order: kind, first byte, byte after the last.
pub(crate) fn segments(text: &str) -> impl Iterator<Item = (SegmentKind, usize, usize)> + '_ {
    let mut at = 0;
    std::iter::from_fn(move || {
        let rest = text.as_bytes().get(at..).filter(|rest| !rest.is_empty())?;
        let (kind, length) = match opens(rest) {
            Some(SegmentKind::Comment) => (SegmentKind::Comment, comment_length(rest)),
            Some(_) => (SegmentKind::String, quoted_length(rest)),
            None => {
                let next = (1..rest.len()).find(|i| opens(&rest[*i..]).is_some());
                (SegmentKind::Code, next.unwrap_or(rest.len()))
            }
        };
        let start = at;
        at += length;
        Some((kind, start, at))
    })
}

fn opens(rest: &[u8]) -> Option<SegmentKind> {
    match rest {
        [b'"', ..] => Some(SegmentKind::String),
        [b'/', b'/' | b'*', ..] => Some(SegmentKind::Comment),
        _ => None,
    }
}

fn comment_length(rest: &[u8]) -> usize {
    if rest[1] == b'/' {
        return rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
    }
    let end = rest[2..].windows(2).position(|w| w == b"*/");
    end.map_or(rest.len(), |end| end + 4)
}

/// A string ends at the end of its line at the latest, so that a missing quote does not hide the
/// rest of the file.
fn quoted_length(rest: &[u8]) -> usize {
    let mut at = 1;
    while at < rest.len() && rest[at] != b'\n' {
        match rest[at] {
            b'"' => return at + 1,
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
    at.min(rest.len())
}
