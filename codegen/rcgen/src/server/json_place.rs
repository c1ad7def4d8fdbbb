//! The context of a cursor in JSON, also in a broken text.

/// The context of a cursor.
#[derive(Debug, Default)]
pub(super) struct JsonPlace<'a> {
    /// The keys above it, the outermost first; an element of a list has none.
    pub(super) keys: Vec<&'a str>,
    /// The members before it of the objects around it, the outermost first, with texts as values.
    pub(super) members: Vec<Vec<(&'a str, &'a str)>>,
    /// Whether a key stands there, and not a value.
    pub(super) is_key: bool,
    /// Whether it is in a string.
    pub(super) is_string: bool,
    /// Start of the word, or of the content of the string.
    pub(super) start: usize,
}

/// A text in JSON.
#[derive(Debug, Default)]
pub(super) struct Json<'a> {
    /// The context of the cursor. `None` where neither a key nor a value may stand.
    pub(super) place: Option<JsonPlace<'a>>,
    /// The objects that are elements of a list: the key of the list, and their members with texts.
    pub(super) listed: Vec<(&'a str, Vec<(&'a str, &'a str)>)>,
    /// The members of the outermost object with texts.
    pub(super) outermost: Vec<(&'a str, &'a str)>,
}

/// An object or a list that is not closed.
#[derive(Debug, Default)]
struct Open<'a> {
    is_list: bool,
    /// The key of the member, as soon as it is read.
    key: Option<&'a str>,
    has_colon: bool,
    members: Vec<(&'a str, &'a str)>,
}

/// Reads a text, and finds the context of a byte.
pub(super) fn read(text: &str, cursor: usize) -> Json<'_> {
    let mut json = Json::default();
    let mut open: Vec<Open<'_>> = Vec::new();
    let mut at = 0;
    let mut is_placed = false;
    while let Some(next) = text[at..].chars().next() {
        let token = token(&text[at..], next);
        let end = at + token.len();
        let is_string = next == '"';
        let content = token.strip_prefix('"').unwrap_or(token);
        let content = content.strip_suffix('"').unwrap_or(content);
        let is_word = is_string || next.is_alphanumeric();
        let is_in = if is_string {
            let is_closed = token.len() > 1 && token.ends_with('"');
            at < cursor && (cursor < end || cursor == end && !is_closed)
        } else {
            is_word && at < cursor && cursor <= end
        };
        if !is_placed && (is_in || at >= cursor) {
            is_placed = true;
            let start = match (is_in, is_string) {
                (true, true) => at + 1,
                (true, false) => at,
                (false, _) => cursor,
            };
            json.place = place(&open, is_in && is_string, start);
        }
        match next {
            '{' | '[' => open.push(Open {
                is_list: next == '[',
                ..Open::default()
            }),
            '}' | ']' => close(&mut open, &mut json),
            ',' => {
                if let Some(last) = open.last_mut() {
                    (last.key, last.has_colon) = (None, false);
                }
            }
            ':' => {
                if let Some(last) = open.last_mut() {
                    last.has_colon = true;
                }
            }
            _ if is_word => {
                if let Some(last) = open.last_mut().filter(|last| !last.is_list) {
                    match last.key {
                        Some(key) if last.has_colon => last.members.push((key, content)),
                        _ => last.key = Some(content),
                    }
                }
            }
            _ => {}
        }
        at = end;
    }
    if !is_placed {
        json.place = place(&open, false, cursor);
    }
    while !open.is_empty() {
        close(&mut open, &mut json);
    }
    json
}

fn close<'a>(open: &mut Vec<Open<'a>>, json: &mut Json<'a>) {
    let Some(closed) = open.pop().filter(|closed| !closed.is_list) else {
        return;
    };
    match open.as_slice() {
        [] => json.outermost = closed.members,
        [.., above, list] if list.is_list => {
            let key = above.key.unwrap_or_default();
            json.listed.push((key, closed.members));
        }
        _ => {}
    }
}

fn place<'a>(open: &[Open<'a>], is_string: bool, start: usize) -> Option<JsonPlace<'a>> {
    let last = open.last()?;
    // Behind a key, and behind a value, other signs come first.
    let is_key = !last.is_list && !last.has_colon;
    let is_behind = match last.key {
        Some(key) if last.has_colon => last.members.last().is_some_and(|(known, _)| *known == key),
        Some(_) => true,
        None => false,
    };
    (!is_behind).then(|| JsonPlace {
        keys: open.iter().filter_map(|one| one.key).collect(),
        members: open.iter().map(|one| one.members.clone()).collect(),
        is_key,
        is_string,
        start,
    })
}

/// The token that begins with `next`. A string that is not closed ends with its line.
fn token(rest: &str, next: char) -> &str {
    let end = if next == '"' {
        let mut is_escaped = false;
        let end = rest.char_indices().skip(1).find(|(_, c)| {
            let is_end = !is_escaped && *c == '"' || *c == '\n';
            is_escaped = *c == '\\' && !is_escaped;
            is_end
        });
        end.map(|(at, c)| if c == '"' { at + 1 } else { at })
    } else if next.is_alphanumeric() {
        rest.find(|c: char| !c.is_alphanumeric() && !matches!(c, '.' | '_' | '+' | '-'))
    } else {
        Some(next.len_utf8())
    };
    &rest[..end.unwrap_or(rest.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> String {
        let cursor = text.find('|').expect("a cursor");
        let text = text.replace('|', "");
        let json = read(&text, cursor);
        let Some(at) = json.place else {
            return "nothing".to_owned();
        };
        let what = if at.is_key { "key" } else { "value" };
        let quoted = if at.is_string { "\"" } else { "" };
        let known = at.members.last().cloned().unwrap_or_default();
        let word = &text[at.start..cursor];
        format!("{} {what} {known:?} +{quoted}{word}", at.keys.join("/"))
    }

    #[test]
    fn a_cursor_in_a_broken_text_is_at_a_key_or_a_value() {
        for (text, expected) in [
            ("|", "nothing"),
            ("{|", " key [] +"),
            ("{ \"no|", " key [] +\"no"),
            ("{ \"a\" |", "nothing"),
            ("{ \"a\": |", "a value [] +"),
            ("{ \"a\": \"x|y\" }", "a value [] +\"x"),
            ("{ \"a\": tr| }", "a value [] +tr"),
            ("{ \"a\": \"x\" | }", "nothing"),
            ("{ \"a\": \"x\", | }", " key [(\"a\", \"x\")] +"),
            ("{ \"n\": [ { \"t\": \"R\", \"a\": { \"|", "n/a key [] +\""),
            ("{ \"n\": [ { \"t\": \"|\n    { \"t\"", "n/t value [] +\""),
            ("{ \"a\": \"x\\\"|\" }", "a value [] +\"x\\\""),
            ("[ | ]", " value [] +"),
        ] {
            assert_eq!(shown(text), expected, "{text}");
        }
    }

    #[test]
    fn elements_of_lists_are_known_also_behind_an_error() {
        let json = read(
            "{ \"schema\": \"s\", \"nodes\": [ { \"id\": \"1:1\", }, oops { \"id\": \"é",
            0,
        );
        assert_eq!(json.outermost, [("schema", "s")]);
        let nodes = [("nodes", vec![("id", "1:1")]), ("nodes", vec![("id", "é")])];
        assert_eq!(json.listed, nodes);
    }
}
