//! What the values of a component mean: the data prototypes that it imports.

use crate::model::Component;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_idsl::model::{Member, Type, TypeDeclKind, TypeId};
use rc_prototypes::model::{Library, Prototype};
use rc_syntax::{Loader, Name};
use std::sync::Arc;

/// Reads the `.dproto` files that a component imports, and checks the prototypes that its interfaces
/// name. `source` is the text of the component. A component whose files have errors has no
/// prototypes.
pub fn meanings(
    component: &mut Component,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> Diagnostics {
    if component.prototype_imports.is_empty() {
        return Diagnostics::new();
    }
    let path = sources.path(source).to_path_buf();
    let wanted = component.prototype_imports.iter();
    let wanted = wanted.map(|file| (path.as_path(), file));
    let (library, mut found) = rc_prototypes::import(sources, loader, wanted);
    if !found.has_errors() {
        named(component, &library, &mut found);
    }
    if !found.has_errors() {
        component.prototypes = Arc::new(library);
    }
    found
}

/// Reports names of `@dproto` that no prototype of the type of the member has.
fn named(component: &Component, prototypes: &Library, found: &mut Diagnostics) {
    let library = &component.library;
    let unknown = |name: &Name| {
        let message = format!("unknown prototype `{}`", name.text);
        let known = prototypes.prototypes.iter().map(|own| own.name.as_str());
        Diagnostic::error("unknown-prototype", name.span, message).suggest(&name.text, known)
    };
    let mut check = |name: &Name, of: &str, ty: Option<String>| {
        let is_own =
            |of: &Prototype| of.interface_type().is_some() && of.interface_type() == ty.as_deref();
        let Some(prototype) = prototypes.prototype(&name.text) else {
            // Interfaces are shared: a structure that this component does not import may be another
            // one's.
            if prototypes.prototypes.iter().any(is_own) {
                found.push(unknown(name));
            }
            return;
        };
        if !is_own(prototype) {
            let message = format!("`{}` is not a prototype of the type of `{of}`", name.text);
            let error = Diagnostic::error("wrong-type", name.span, message);
            let help = match ty {
                Some(ty) => format!("name one with `ddr = :: IDSL{{{ty}}}`"),
                None => "`@dproto` belongs to a structure, or to a sequence or an array of them"
                    .to_owned(),
            };
            found.push(error.help(help));
        }
    };
    for (at, ty) in library.types.iter().enumerate() {
        if let Some(name) = &ty.prototype {
            check(name, &ty.name.text, Some(library.type_path(TypeId(at))));
        }
    }
    let structures = library.types.iter().filter_map(|ty| match &ty.kind {
        TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => Some(members),
        TypeDeclKind::Enum(_) | TypeDeclKind::Alias(_) => None,
    });
    let operations = library.interfaces.iter().flat_map(|one| &one.operations);
    let parameters = operations.flat_map(|operation| [&operation.inputs, &operation.outputs]);
    for member in structures.chain(parameters).flatten() {
        if let Some(name) = &member.prototype {
            check(name, &member.name.text, named_type(component, member));
        }
    }
}

/// The path of the structure that a member holds: itself, or as elements.
fn named_type(component: &Component, member: &Member) -> Option<String> {
    let mut ty = component.library.resolved(&member.ty);
    loop {
        ty = match ty {
            Type::Named(id) => return Some(component.library.type_path(*id)),
            Type::Sequence { element, .. }
            | Type::Array { element, .. }
            | Type::Dictionary { value: element, .. } => component.library.resolved(element),
            Type::Primitive(_) | Type::Text { .. } => return None,
        };
    }
}
