//! Layout and fixes of an open text.

use super::editor::{Document, Editor};
use super::findings::{Findings, Place, together};
use super::hints;
use super::known_files::KnownFiles;
use crate::format::laid_out;
use rc_diagnostics::SourceMap;
use serde_json::{Value, json};
use std::path::Path;

/// The edit that formats an open file. Nothing if it has errors, as with `rcgen fmt`.
pub(super) fn format(editor: &Editor, uri: &str) -> Value {
    let Some(Document { path, text, .. }) = editor.at(uri) else {
        return Value::Null;
    };
    let mut sources = SourceMap::new();
    let source = sources.add(path, text.as_str());
    match laid_out(path, &sources, source) {
        Some(Ok(formatted)) if formatted == text.as_str() => json!([]),
        Some(Ok(formatted)) => {
            json!([{ "range": text.whole(editor.encoding()), "newText": formatted }])
        }
        Some(Err(_)) | None => Value::Null,
    }
}

/// The fixes of the findings in a range, one for all that are certain, and the stubs of missing handlers.
pub(super) fn actions(
    (files, editor): (&KnownFiles, &Editor),
    findings: &Findings,
    path: &Path,
    range: &Value,
    context: &Value,
) -> Value {
    let uri = &*editor.address(path);
    let kinds = context["only"].as_array();
    let wanted = |kind: &str| {
        let holds = |only: &str| {
            let rest = kind.strip_prefix(only);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        kinds.is_none_or(|kinds| kinds.iter().filter_map(Value::as_str).any(holds))
    };
    let edit = |edits: Vec<Value>| json!({ "changes": { uri: edits } });
    let mut actions = Vec::new();
    let mut certain = Vec::new();
    for (diagnostic, fix) in findings.fixes(path) {
        if fix.certain {
            certain.push(fix.edit.clone());
        }
        if wanted("quickfix") && Place::meet(&diagnostic["range"], range) {
            actions.push(json!({
                "title": fix.title,
                "kind": "quickfix",
                "diagnostics": [diagnostic],
                "isPreferred": fix.certain,
                "edit": edit(vec![fix.edit]),
            }));
        }
    }
    // What changes a whole file is a command of the editor.
    for diagnostic in findings.of(path) {
        let is_here = Place::meet(&diagnostic["range"], range);
        if wanted("quickfix") && is_here && diagnostic["code"] == "unset-parameter" {
            let title = "Update the configuration";
            let command = json!({
                "title": title,
                "command": "rcgen.updateConfiguration",
                "arguments": [uri],
            });
            actions.push(json!({
                "title": title,
                "kind": "quickfix",
                "diagnostics": [diagnostic],
                "command": command,
            }));
        }
    }
    if wanted("quickfix") && path.extension().is_some_and(|ending| ending == "cdsl") {
        actions.extend(hints::stubs_action(files, editor, path, range));
    }
    if wanted("source.fixAll") && !certain.is_empty() {
        actions.push(json!({
            "title": "Apply all certain fixes",
            "kind": "source.fixAll",
            "edit": edit(together(certain)),
        }));
    }
    json!(actions)
}
