//! Structures of C++ for values in shared memory.

use super::library::{self, Field};
use super::{names, types};
use crate::collisions;
use crate::view;
use crate::view::library::Operation;
use crate::view::members::Member;
use crate::view::types::{Declared, Named, Type, resolved};
use rc_vocabulary::Role;
use std::collections::BTreeSet;

/// The named types whose values the worker has in place: those of samples that it publishes, or gets
/// in place, and what they contain. Module and name of each.
pub(super) fn all(view: &view::Component) -> BTreeSet<(&str, &str)> {
    let mut done = BTreeSet::new();
    let slots = view.slots.iter().filter(|slot| {
        slot.role == Role::Publishes || slot.role == Role::SubscribesTo && slot.in_place
    });
    let operations = slots.filter_map(|slot| view.interface(slot));
    let operations = operations.flat_map(|interface| &interface.operations);
    let samples = operations.filter_map(|operation| operation.sample_in_place.as_ref());
    let mut left: Vec<&Named> = samples.flat_map(|ty| ty.names()).collect();
    while let Some(of) = left.pop() {
        if let Some(target) = &of.target {
            left.extend(target.names());
            continue;
        }
        if of.of != Declared::Struct || !done.insert((&*of.module, &*of.name)) {
            continue;
        }
        let mut modules = view.modules.iter();
        let module = modules.find(|module| module.name == of.module);
        let types = module.map_or(&[][..], |module| &module.types);
        let decl = types.iter().find(|decl| decl.name == of.name);
        left.extend(decl.into_iter().flat_map(library::named));
    }
    done
}

/// The name of the structure of a type in place, without its namespace. No type and no interface of the
/// module has it.
pub(super) fn name(view: &view::Component, module: &str, name: &str) -> String {
    let mut modules = view.modules.iter();
    let home = modules.find(|other| other.name == module);
    let mut taken: BTreeSet<String> = BTreeSet::new();
    if let Some(home) = home {
        taken.extend(home.types.iter().map(|decl| names::own(&decl.name)));
        taken.extend(home.interfaces.iter().map(|of| names::own(&of.name)));
    }
    collisions::free(format!("{}InPlace", names::own(name)), &mut taken)
}

/// The structure of a type in place, with its namespace.
fn path(view: &view::Component, of: &Named) -> String {
    let name = name(view, &of.module, &of.name);
    format!("{}::{name}", names::own(&of.module))
}

/// The structure of the samples of a topic in place.
pub(super) fn sample(view: &view::Component, of: &Operation) -> Option<String> {
    let ty = of.sample_in_place.as_ref()?;
    Some(types::in_place(ty, &|named| path(view, named)))
}

/// A member of a structure in place. An optional one is missing at first.
pub(super) fn field(view: &view::Component, member: &Member) -> Field {
    let mut own = library::field(view, member);
    let ty = types::in_place(&member.ty, &|named| path(view, named));
    let is_plain = matches!(
        resolved(&member.ty),
        Type::Primitive(_) | Type::Text { .. } | Type::Array { .. }
    );
    let is_enum = matches!(resolved(&member.ty), Type::Named(named) if named.of == Declared::Enum);
    if member.optional || !(is_plain || is_enum) {
        "{}".clone_into(&mut own.default);
    }
    own.ty = if member.optional {
        format!("rc::Maybe<{ty}>")
    } else {
        ty
    };
    own
}
