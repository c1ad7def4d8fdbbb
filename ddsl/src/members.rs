//! Members of slot arrays: what `slots { … }` lists, and the component that an instance is with
//! these members.

use crate::ast;
use crate::model::{Array, Instance};
use rc_cdsl::Component;
use rc_cdsl::model::Slot;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::Name;
use rc_vocabulary::member;
use std::collections::HashMap;

/// Reads the field `slots`. Reports names that cannot be members, and those that occur twice.
pub(crate) fn listed(lists: &[(Name, Vec<Name>)], found: &mut Diagnostics) -> Vec<Array> {
    let mut arrays: Vec<Array> = Vec::new();
    for (name, members) in lists {
        if let Some(first) = arrays.iter().find(|array| array.name.text == name.text) {
            let message = format!("duplicate array `{}`", name.text);
            let error = Diagnostic::error("duplicate-name", name.span, message)
                .label(first.name.span, "first listed here")
                .help("list all members of an array in one line");
            found.push(error);
            continue;
        }
        let mut seen: HashMap<String, &Name> = HashMap::new();
        let mut own = Vec::new();
        for written in members {
            if let Err(reason) = member::check(&written.text) {
                let message = format!("`{}` cannot be a member of `{}`", written.text, name.text);
                let error = Diagnostic::error("bad-member", written.span, message).help(reason);
                found.push(error);
            } else if let Some(first) = seen.insert(written.text.to_lowercase(), written) {
                let message = format!("duplicate member `{}` of `{}`", written.text, name.text);
                let error = Diagnostic::error("duplicate-member", written.span, message)
                    .label(first.span, "first listed here");
                found.push(if first.text == written.text {
                    error
                } else {
                    error.help("choose names that differ in more than case")
                });
            } else {
                own.push(written.clone());
            }
        }
        if let Some(beyond) = own.get(member::MOST) {
            let most = member::MOST;
            let message = format!(
                "`{}` has {} members, but the maximum is {most}",
                name.text,
                own.len()
            );
            found.push(Diagnostic::error("bad-member", beyond.span, message));
        }
        arrays.push(Array {
            name: name.clone(),
            members: own,
        });
    }
    arrays
}

/// The component of an instance with a slot for each member, named `ARRAY.MEMBER`, in place of its
/// arrays. `None` if it has no array. Completes [`Instance::arrays`]: an array that the network
/// does not list has no members.
pub fn expand(
    network: &str,
    instance: &mut Instance,
    component: &Component,
    found: &mut Diagnostics,
) -> Option<Component> {
    check_arrays(instance, component, found);
    let arrays = component.slots.iter().filter(|slot| slot.is_array);
    let arrays: Vec<Array> = arrays
        .map(|slot| {
            let listed = instance.arrays.iter().find(|a| a.name.text == slot.name);
            listed.cloned().unwrap_or_else(|| Array {
                name: Name::new(slot.name.as_str(), instance.name.span),
                members: Vec::new(),
            })
        })
        .collect();
    instance.arrays = arrays;
    if instance.arrays.is_empty() {
        return None;
    }
    check_lengths(network, instance, found);
    let slots = component.slots.iter().flat_map(|slot| {
        let array = instance.arrays.iter().find(|a| a.name.text == slot.name);
        match array.filter(|_| slot.is_array) {
            Some(array) => array
                .members
                .iter()
                .map(|name| member(slot, name))
                .collect(),
            None => vec![slot.clone()],
        }
    });
    Some(Component {
        slots: slots.collect(),
        ..component.clone()
    })
}

fn member(array: &Slot, name: &Name) -> Slot {
    Slot {
        name: member::path(&array.name, &name.text),
        is_array: false,
        ..array.clone()
    }
}

/// Reports lists of slots that are not arrays of the component.
fn check_arrays(instance: &Instance, component: &Component, found: &mut Diagnostics) {
    for Array { name, .. } in &instance.arrays {
        match component.slots.iter().find(|slot| slot.name == name.text) {
            Some(slot) if slot.is_array => {}
            Some(slot) => {
                let message = format!("`{}` is one slot, not an array", name.text);
                let interface = &component.library.interface(slot.interface).name.text;
                let error = Diagnostic::error("not-an-array", name.span, message)
                    .label(slot.span, "declared here")
                    .help(format!("declare it as `{interface}[] as {}`", slot.name));
                found.push(error);
            }
            None => {
                let message = format!("`{}` has no slot array `{}`", instance.path, name.text);
                let arrays = component.slots.iter().filter(|slot| slot.is_array);
                let error = Diagnostic::error("unknown-slot", name.span, message)
                    .label(component.name.span, "its component")
                    .suggest(&name.text, arrays.map(|slot| slot.name.as_str()));
                found.push(error);
            }
        }
    }
}

/// Reports members whose address would be longer than an address may be.
fn check_lengths(network: &str, instance: &Instance, found: &mut Diagnostics) {
    let most = rc_vocabulary::address::LONGEST;
    for Array { name, members } in &instance.arrays {
        let array = format!("{network}/{}/{}", instance.path, name.text);
        let too_long = members
            .iter()
            .find(|m| array.len() + 1 + m.text.len() > most);
        if let Some(member) = too_long {
            let message = format!(
                "the address `{array}/{}` has more than {most} characters",
                member.text
            );
            let error = Diagnostic::error("name-too-long", member.span, message);
            found.push(error.help("choose shorter names"));
        }
    }
}

impl Instance {
    /// Whether its component has this slot array. Known once it was expanded.
    pub(crate) fn array(&self, name: &str) -> Option<&Array> {
        self.arrays.iter().find(|array| array.name.text == name)
    }
}

/// The whole name of the slot that a path of a member denotes: `ARRAY.MEMBER`.
pub(crate) fn member_slot(array: &Name, tree: &ast::SlotPath) -> Name {
    let name = member::path(&array.text, &tree.slot.text);
    Name::new(name, array.span.to(tree.slot.span))
}

/// Describes the mistake in the path of a member that is not listed, or of a whole array.
pub(crate) fn wrong_member(instance: &Instance, slot: &Name) -> Option<Diagnostic> {
    let path = &instance.path;
    let (array, wanted) = match member::split(&slot.text) {
        Some((array, wanted)) => match instance.array(array) {
            Some(array) => (array, Some(wanted)),
            None => return Some(no_array(instance, array, slot)),
        },
        None => (instance.array(&slot.text)?, None),
    };
    let name = &array.name.text;
    let listed = array.members.iter().map(|m| m.text.as_str());
    let Some(wanted) = wanted else {
        let message = format!("`{path}.{name}` is a slot array, not a slot");
        let member = listed.clone().next().unwrap_or("MEMBER");
        let help = format!("name one of its members: `{path}.{name}.{member}`");
        return Some(Diagnostic::error("unknown-slot", slot.span, message).help(help));
    };
    let message = format!("`{path}` lists no member `{wanted}` of `{name}`");
    let error = Diagnostic::error("unknown-member", slot.span, message);
    let near = rc_diagnostics::nearest(wanted, listed.clone());
    let all = listed.chain([wanted]).map(|name| format!("\"{name}\""));
    let all = all.collect::<Vec<_>>().join(", ");
    let error = error.label(instance.name.span, "the component");
    Some(match near {
        Some(_) => error.did_you_mean(wanted, near),
        None => error.help(format!("list it there: `slots {{ {name} {all}; }}`")),
    })
}

/// The path enters a component, which has no such slot array.
fn no_array(instance: &Instance, array: &str, slot: &Name) -> Diagnostic {
    let path = &instance.path;
    let message = format!("expected a group or a slot array, found component `{path}`");
    let error = Diagnostic::error("not-a-group", slot.span, message).label(
        instance.name.span,
        format!("it has no slot array `{array}`"),
    );
    let arrays = instance.arrays.iter().map(|array| array.name.text.as_str());
    match rc_diagnostics::nearest(array, arrays) {
        Some(near) => error.did_you_mean(array, Some(near)),
        None => error.help(format!("write `{path}.SLOT`")),
    }
}
