//! Layout of a part of an open text: only white space between its words changes.

use super::editor::Editor;
use super::place::Text;
use super::structure::Structure;
use crate::format::laid_out;
use crate::languages::Language;
use rc_diagnostics::SourceMap;
use serde_json::{Value, json};
use std::path::Path;

/// The signs after which an editor asks for layout.
pub(super) const SIGNS: [&str; 2] = [";", "}"];

/// The edits that format a range of an open file, as `rcgen fmt` formats the whole of it. Nothing
/// if the file has errors.
pub(super) fn format_range(editor: &Editor, path: &Path, range: &Value) -> Value {
    let Some(document) = editor.document(path) else {
        return Value::Null;
    };
    let range = document.text.bytes(editor.encoding(), range);
    range.map_or(Value::Null, |(start, end)| {
        format_between(editor, path, &document.text, start, end)
    })
}

/// The edits that lay out the statement, or the block, that the sign before a position ends.
pub(super) fn format_behind(editor: &Editor, path: &Path, position: &Value) -> Value {
    let Some(document) = editor.document(path) else {
        return Value::Null;
    };
    let text = document.text.as_str();
    let byte = document.text.byte(editor.encoding(), position);
    let sign = byte.and_then(|byte| text[..byte].char_indices().next_back());
    let Some((at, _)) = sign.filter(|(_, sign)| SIGNS.contains(&sign.to_string().as_str())) else {
        return Value::Null;
    };
    let (start, end) = Structure::of(text).ended_by(at);
    format_between(editor, path, &document.text, start, end)
}

fn format_between(editor: &Editor, path: &Path, text: &Text, start: usize, end: usize) -> Value {
    if Language::of(path).is_none() {
        return Value::Null;
    }
    let mut sources = SourceMap::new();
    let source = sources.add(path, text.as_str());
    let Some(Ok(formatted)) = laid_out(path, &sources, source) else {
        return Value::Null;
    };
    let edits = changes(text.as_str(), &formatted, start, end).into_iter();
    let edits = edits.map(
        |(start, end, new)| json!({ "range": editor.range(text, start, end), "newText": new }),
    );
    json!(edits.collect::<Vec<_>>())
}

/// The changes of white space between the words of a part of a text, and before it: bytes, and the
/// new text. None if the words differ.
fn changes(old: &str, new: &str, start: usize, end: usize) -> Vec<(usize, usize, String)> {
    let (before, after) = (rc_syntax::tokens(old), rc_syntax::tokens(new));
    let same = before.len() == after.len()
        && before
            .iter()
            .zip(&after)
            .all(|(one, other)| one.text == other.text);
    if !same {
        return Vec::new();
    }
    let mut edits = Vec::new();
    let (mut from, mut from_new) = (0, 0);
    for (one, other) in before.iter().zip(&after) {
        let (blank, wanted) = (&old[from..one.start], &new[from_new..other.start]);
        if start <= one.start && one.start < end && blank != wanted {
            edits.push((from, one.start, wanted.to_owned()));
        }
        from = one.start + one.text.len();
        from_new = other.start + other.text.len();
    }
    edits
}

#[cfg(test)]
mod tests {
    use super::changes;

    #[test]
    fn only_white_space_in_the_part_changes() {
        let (old, new) = ("a  b;\nc  d;\ne  f;\n", "a b;\nc d;\ne f;\n");
        assert_eq!(changes(old, new, 6, 11), [(7, 9, " ".to_owned())]);
        assert_eq!(changes(old, new, 0, old.len()).len(), 3);
        assert_eq!(changes(old, "a b c", 0, old.len()), []);
    }
}
