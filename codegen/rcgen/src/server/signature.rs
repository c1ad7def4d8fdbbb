//! Help for `bind` while it is typed.

use super::context::Context;
use super::editor::Editor;
use super::known_files::KnownFiles;
use rc_cdsl::model::Role;
use serde_json::{Value, json};
use std::path::Path;

/// The most listed slots.
const MOST: usize = 20;

/// The ends of a `bind`, as its help shows them.
const CONSUMER: &str = "CONSUMER.SLOT";
const PROVIDER: &str = "PROVIDER.SLOT";

/// The form of `bind` around a position of an open network, with the slots that are allowed there.
pub(super) fn signature(
    files: &KnownFiles,
    editor: &Editor,
    path: &Path,
    position: &Value,
) -> Value {
    let Some(document) = editor.document(path) else {
        return Value::Null;
    };
    let byte = document.text.byte(editor.encoding(), position);
    let text = document.text.as_str();
    let context = byte.and_then(|byte| Context::at(text, byte));
    let is_network = path.extension().is_some_and(|ending| ending == "ddsl");
    let Some(context) = context.filter(|context| is_network && context.word() == "bind") else {
        return Value::Null;
    };
    let arrow = context.statement.iter().position(|token| *token == "->");
    let consumer = context
        .statement
        .get(1..arrow.unwrap_or(context.statement.len()));
    let consumer = consumer.unwrap_or_default().concat();
    let prefix: String = context
        .groups()
        .iter()
        .map(|group| format!("{group}."))
        .collect();
    let active = usize::from(arrow.is_some());
    let (wanted, about) = match arrow {
        None => (
            None,
            "The slot that requires an interface or subscribes to it.".to_owned(),
        ),
        Some(_) => match consumer_of(files, path, &prefix, &consumer) {
            None => (
                None,
                "The slot that implements or publishes the interface.".to_owned(),
            ),
            Some((role, interface)) => {
                let wanted = match role {
                    Role::SubscribesTo => Role::Publishes,
                    Role::Requires | Role::Implements | Role::Publishes => Role::Implements,
                };
                let about = format!("A slot that {} `{interface}`.", wanted.word());
                (Some((wanted, interface)), about)
            }
        },
    };
    let mut lines = vec![about];
    for (slot, role, interface) in slots_in(files, path, &prefix) {
        let fits = match &wanted {
            Some((role_wanted, wanted)) => role == *role_wanted && interface == *wanted,
            None => active == usize::from(role.is_provided()),
        };
        if fits && lines.len() <= MOST {
            lines.push(format!("- `{slot}` {} `{interface}`", role.word()));
        }
    }
    let label = format!("bind {CONSUMER} -> {PROVIDER};");
    let part = |of: &str| {
        let start = label.find(of).unwrap_or(0);
        json!([start, start + of.len()])
    };
    let parameters = [CONSUMER, PROVIDER].map(|of| json!({ "label": part(of) }));
    json!({
        "signatures": [{
            "label": label,
            "documentation": { "kind": "markdown", "value": lines.join("\n") },
            "parameters": parameters,
            "activeParameter": active,
        }],
        "activeSignature": 0,
        "activeParameter": active,
    })
}

/// The role and the interface of a consumer, by its path in a group.
fn consumer_of(
    files: &KnownFiles,
    path: &Path,
    prefix: &str,
    written: &str,
) -> Option<(Role, String)> {
    let slots = slots_in(files, path, prefix);
    let found = slots.into_iter().find(|(slot, ..)| {
        let member = |rest: &str| rest.starts_with('.');
        written == slot || written.strip_prefix(slot.as_str()).is_some_and(member)
    });
    found.map(|(_, role, interface)| (role, interface))
}

/// The slots of the components that are visible in a group, by their paths there: those of other groups
/// as far as they export them.
fn slots_in(files: &KnownFiles, path: &Path, prefix: &str) -> Vec<(String, Role, String)> {
    let Some(names) = files.readable(path) else {
        return Vec::new();
    };
    let mut all = Vec::new();
    for (instance, cdsl) in &names.instances {
        let Some(slots) = files.readable(cdsl).map(|names| &names.slots) else {
            continue;
        };
        let Some(inside) = instance.strip_prefix(prefix) else {
            continue;
        };
        let group = inside.split('.').next().unwrap_or_default();
        for slot in slots {
            let seen = if inside == group {
                format!("{inside}.{}", slot.name)
            } else {
                let known = names.groups.get(&format!("{prefix}{group}"));
                if known.is_none_or(|known| !known.exports.contains(&slot.name)) {
                    continue;
                }
                format!("{group}.{}", slot.name)
            };
            all.push((seen, slot.role, slot.interface.clone()));
        }
    }
    all
}
