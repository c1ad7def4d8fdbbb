//! Splits a text into comments, strings and the code between them. `//` in a string is not a
//! comment.

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
        return rest
            .iter()
            .position(|byte| ends_line(*byte))
            .unwrap_or(rest.len());
    }
    let end = rest[2..].windows(2).position(|w| w == b"*/");
    end.map_or(rest.len(), |end| end + 4)
}

/// The statements around `places`, which are in order: byte ranges between the nearest `;` or
/// braces, with these.
pub(crate) fn statement_of(text: &str, places: impl Iterator<Item = usize>) -> Vec<(usize, usize)> {
    let mut places = places.peekable();
    let mut statements = Vec::new();
    let mut start = 0;
    let code = segments(text).filter(|(kind, ..)| *kind == SegmentKind::Code);
    let bytes = code.flat_map(|(_, start, stop)| start..stop);
    let ends = bytes.filter(|at| matches!(text.as_bytes()[*at], b';' | b'{' | b'}'));
    for end in ends.chain([text.len()]) {
        if places.peek().is_none() {
            break;
        }
        if places.next_if(|place| *place < end).is_some() {
            statements.push((start, end));
        }
        while places.next_if(|place| *place < end).is_some() {}
        start = end;
    }
    statements
}

/// The lines of a text. A line ends with LF, CR or both.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest.filter(|text| !text.is_empty())?;
        let Some(end) = text.find(['\n', '\r']) else {
            rest = None;
            return Some(text);
        };
        let both = usize::from(text[end..].starts_with("\r\n"));
        rest = text.get(end + 1 + both..);
        Some(&text[..end])
    })
}

/// A CR ends a line, too, as in texts of old editors.
fn ends_line(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// A string ends at the end of its line at the latest, so that a missing quote does not hide the
/// rest of the file.
fn quoted_length(rest: &[u8]) -> usize {
    let mut at = 1;
    while at < rest.len() && !ends_line(rest[at]) {
        match rest[at] {
            b'"' => return at + 1,
            b'\\' if !rest.get(at + 1).is_some_and(|byte| ends_line(*byte)) => at += 2,
            _ => at += 1,
        }
    }
    at.min(rest.len())
}
