//! The members of slot arrays that a scene gives a simulator, as a `.ddsl` lists them.

use crate::command_line::Failure;
use innermodel::Snapshot;
use innermodel::slots::{self, Members};
use rc_diagnostics::foreign::clean;
use rc_vocabulary::member;
use std::collections::BTreeMap;

/// The clause `slots` of a component that serves the devices of `tree`.
///
/// # Errors
/// An id cannot be the name of a member, two ids differ only in case, or an array has too many
/// members.
pub(crate) fn clause(tree: &Snapshot) -> Result<String, Failure> {
    let arrays = slots::of(tree);
    let wrong: Vec<String> = arrays.iter().filter_map(problem).collect();
    if !wrong.is_empty() {
        return Err(Failure::Input(wrong.join("\nrcview: error: ")));
    }
    let width = arrays.iter().map(|array| array.array.len()).max();
    let mut text = "slots\n{\n".to_owned();
    for Members {
        array,
        interface,
        members,
    } in &arrays
    {
        let members: Vec<String> = members.iter().map(|name| format!("\"{name}\"")).collect();
        let (members, width) = (members.join(", "), width.unwrap_or_default());
        text += &format!("    {array:width$} {members}; // {interface}\n");
    }
    Ok(text + "};\n")
}

/// Fault of the members of an array.
fn problem(array: &Members) -> Option<String> {
    let name = array.array;
    if array.members.len() > member::MOST {
        let (count, most) = (array.members.len(), member::MOST);
        return Some(format!(
            "`{name}` has {count} members; at most {most} are possible"
        ));
    }
    let mut seen: BTreeMap<String, &String> = BTreeMap::new();
    array.members.iter().find_map(|id| {
        if let Err(reason) = member::check(id) {
            let id = clean(id);
            return Some(format!("`{id}` cannot be a member of `{name}`: {reason}"));
        }
        let same = seen.insert(id.to_ascii_lowercase(), id)?;
        Some(format!(
            "`{same}` and `{id}` of `{name}` differ only in case"
        ))
    })
}
