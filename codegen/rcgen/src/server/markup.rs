//! The tags of an XML text and the context of a cursor in it, also in a broken text.

/// A tag that opens an element.
#[derive(Debug, Default)]
pub(super) struct Tag<'a> {
    pub(super) name: &'a str,
    pub(super) attributes: Vec<Attribute<'a>>,
    /// Start of its name, and its end behind the `>`, or where it breaks off.
    start: usize,
    end: usize,
    /// Whether it has a `>`.
    has_end: bool,
    /// Whether its element has no content: `/>`.
    is_whole: bool,
}

/// An attribute with the start and the text of its value.
#[derive(Debug)]
pub(super) struct Attribute<'a> {
    pub(super) name: &'a str,
    start: usize,
    value: Option<(usize, &'a str)>,
}

impl<'a> Tag<'a> {
    /// The value of an attribute.
    pub(super) fn value(&self, name: &str) -> Option<&'a str> {
        let mut all = self.attributes.iter();
        let found = all.find(|attribute| attribute.name == name)?;
        found.value.map(|(_, value)| value)
    }
}

#[derive(Debug)]
enum Piece<'a> {
    Open(Tag<'a>),
    Close {
        name: &'a str,
        start: usize,
        end: usize,
    },
    /// A comment, a text that is taken as it is, or an instruction.
    Other {
        start: usize,
        end: usize,
    },
}

/// The part of a tag in which a cursor is.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Part<'a> {
    /// The name of a tag that opens an element.
    Name,
    /// The name of a tag that closes one.
    Closing,
    /// The name of an attribute.
    Attribute,
    /// The value of the attribute of this name.
    Value(&'a str),
}

/// The context of a cursor.
#[derive(Debug)]
pub(super) struct Markup<'a> {
    /// The elements around the tag, the outermost first.
    pub(super) around: Vec<&'a str>,
    /// The tag of the cursor.
    pub(super) tag: Tag<'a>,
    pub(super) part: Part<'a>,
    /// Start of the word at the cursor.
    pub(super) start: usize,
}

impl<'a> Markup<'a> {
    /// The context of a byte of `text`. `None` outside of tags.
    pub(super) fn at(text: &'a str, cursor: usize) -> Option<Self> {
        let mut around = Vec::new();
        for piece in pieces(text) {
            match piece {
                Piece::Other { start, end } if start < cursor && cursor < end => return None,
                Piece::Close { name, start, end } if start <= cursor && cursor < end => {
                    let is_in_name = cursor <= start + name.len();
                    return is_in_name.then(|| Self {
                        around,
                        tag: Tag::default(),
                        part: Part::Closing,
                        start,
                    });
                }
                Piece::Open(tag) if tag.start <= cursor && tag.reaches(cursor) => {
                    let (part, start) = tag.part(text, cursor)?;
                    return Some(Self {
                        around,
                        tag,
                        part,
                        start,
                    });
                }
                Piece::Open(tag) if tag.start > cursor => return None,
                Piece::Open(tag) if !tag.is_whole && !tag.name.is_empty() => around.push(tag.name),
                Piece::Close { name, .. } => {
                    // A tag that closes nothing is left out.
                    if let Some(at) = around.iter().rposition(|open| *open == name) {
                        around.truncate(at);
                    }
                }
                Piece::Open(_) | Piece::Other { .. } => {}
            }
        }
        None
    }
}

impl<'a> Tag<'a> {
    fn reaches(&self, cursor: usize) -> bool {
        cursor < self.end || cursor == self.end && !self.has_end
    }

    /// The part of a cursor in this tag, and the start of its word. `None` at a `/`, and behind a `=`
    /// without a quote.
    fn part(&self, text: &'a str, cursor: usize) -> Option<(Part<'a>, usize)> {
        if cursor <= self.start + self.name.len() {
            return Some((Part::Name, self.start));
        }
        for attribute in &self.attributes {
            let end = attribute.start + attribute.name.len();
            if attribute.start <= cursor && cursor <= end {
                return Some((Part::Attribute, attribute.start));
            }
            if let Some((start, value)) = attribute.value
                && start <= cursor
                && cursor <= start + value.len()
            {
                return Some((Part::Value(attribute.name), start));
            }
        }
        let before = text[..cursor].chars().next_back();
        before
            .is_some_and(char::is_whitespace)
            .then_some((Part::Attribute, cursor))
    }
}

/// All tags that open elements.
pub(super) fn tags(text: &str) -> impl Iterator<Item = Tag<'_>> {
    pieces(text).filter_map(|piece| match piece {
        Piece::Open(tag) => Some(tag),
        Piece::Close { .. } | Piece::Other { .. } => None,
    })
}

fn pieces(text: &str) -> impl Iterator<Item = Piece<'_>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + text[at..].find('<')?;
        let rest = &text[start..];
        let whole = [
            ("<!--", "-->"),
            ("<![CDATA[", "]]>"),
            ("<?", "?>"),
            ("<!", ">"),
        ];
        if let Some((_, last)) = whole.iter().find(|(first, _)| rest.starts_with(first)) {
            let end = rest
                .find(last)
                .map_or(text.len(), |end| start + end + last.len());
            at = end;
            return Some(Piece::Other { start, end });
        }
        if rest.starts_with("</") {
            let name = word(text, start + 2);
            let end = start + 2 + name.len();
            let last = text[end..]
                .find(['<', '>'])
                .map_or(text.len(), |last| end + last);
            at = last;
            return Some(Piece::Close {
                name,
                start: start + 2,
                // A tag that breaks off is as long as its name.
                end: if text[last..].starts_with('>') {
                    last + 1
                } else {
                    end + 1
                },
            });
        }
        let tag = tag(text, start + 1);
        at = tag.end;
        Some(Piece::Open(tag))
    })
}

/// Reads a tag whose name begins at `start`.
fn tag(text: &str, start: usize) -> Tag<'_> {
    let mut tag = Tag {
        name: word(text, start),
        start,
        ..Tag::default()
    };
    let mut at = start + tag.name.len();
    while let Some(next) = text[at..].chars().next() {
        match next {
            '<' => break,
            '>' => {
                tag.has_end = true;
                at += 1;
                break;
            }
            '/' => {
                tag.is_whole = true;
                at += 1;
            }
            _ => {
                let name = word(text, at);
                let start = at;
                at += if name.is_empty() {
                    next.len_utf8()
                } else {
                    name.len()
                };
                if name.is_empty() {
                    continue;
                }
                let value = value(text, at);
                at = value.map_or(at, |(start, value)| {
                    let end = start + value.len();
                    end + usize::from(text[end..].starts_with(['"', '\'']))
                });
                tag.attributes.push(Attribute { name, start, value });
            }
        }
    }
    tag.end = at;
    tag
}

/// The word that begins at a byte.
fn word(text: &str, at: usize) -> &str {
    let is_part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':');
    let rest = &text[at..];
    &rest[..rest.find(|c| !is_part(c)).unwrap_or(rest.len())]
}

/// The value behind a name: behind `=` and a quote, as far as the next one. One that is not closed ends
/// where the next tag begins, or its own.
fn value(text: &str, at: usize) -> Option<(usize, &str)> {
    let behind = |at: usize| at + text[at..].len() - text[at..].trim_start().len();
    let at = behind(at);
    let at = behind(at + text[at..].strip_prefix('=').map(|_| 1)?);
    let quote = text[at..]
        .chars()
        .next()
        .filter(|c| matches!(c, '"' | '\''))?;
    let rest = &text[at + 1..];
    let closed = rest
        .find([quote, '<'])
        .filter(|end| rest[*end..].starts_with(quote));
    let end = closed
        .or_else(|| rest.find(['<', '>', '\n']))
        .unwrap_or(rest.len());
    Some((at + 1, &rest[..end]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> String {
        let cursor = text.find('|').expect("a cursor");
        let text = text.replace('|', "");
        match Markup::at(&text, cursor) {
            None => "nothing".to_owned(),
            Some(at) => format!(
                "{} > {} {:?} +{}",
                at.around.join("/"),
                at.tag.name,
                at.part,
                &text[at.start..cursor]
            ),
        }
    }

    #[test]
    fn a_cursor_in_a_broken_text_is_in_a_part_of_a_tag() {
        for (text, expected) in [
            ("|", "nothing"),
            ("<|", " >  Name +"),
            ("<a><b/><!-- <c> --><d|", "a > d Name +d"),
            ("<a><b></c></b><|\n<d x=\"1\"/>", "a >  Name +"),
            ("<a><b></|</a>", "a/b >  Closing +"),
            ("<a><b></b|></a>", "a/b >  Closing +b"),
            ("<a x=\"1\" |", " > a Attribute +"),
            ("<a x=\"1\" y| z=\"2\"/>", " > a Attribute +y"),
            ("<a x=\"1|\"/>", " > a Value(\"x\") +1"),
            ("<a x = '|", " > a Value(\"x\") +"),
            ("<a x=\"1|\n<b y=\"2\"/>", " > a Value(\"x\") +1"),
            ("<a x=\"1\"/|>", "nothing"),
            ("<a x=|>", "nothing"),
            ("<a>text|</a>", "nothing"),
            ("<!-- <a | -->", "nothing"),
            ("<![CDATA[<a |]]>", "nothing"),
            ("<?xml |?>", "nothing"),
            ("<é x=\"é|\">", " > é Value(\"x\") +é"),
        ] {
            assert_eq!(shown(text), expected, "{text}");
        }
    }

    #[test]
    fn no_text_is_cut_inside_a_character() {
        let text = "<a é='ü<b ></é '\"<!-- -->< / =\">é<![CDATA[";
        for cursor in (0..=text.len()).filter(|at| text.is_char_boundary(*at)) {
            for start in (0..=cursor).filter(|at| text.is_char_boundary(*at)) {
                let _ = Markup::at(&text[start..], cursor - start);
            }
        }
    }
}
