//! Two names of the IDSL that become one name of Rust.

use super::in_place;
use super::names;
use super::operation_names::{bare, variant};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{Interface, Member, Type, TypeDeclKind, TypeId};
use rc_syntax::Name;
use std::collections::HashMap;

/// Finds them in all modules of a library.
pub(crate) fn check(library: &Library, found: &mut Diagnostics) {
    let modules = library.modules.iter().map(|module| &module.name);
    collisions(
        modules.map(|n| (n, names::module(&n.text))),
        "modules",
        found,
    );
    let mut known = HashMap::new();
    for module in &library.modules {
        let interfaces = module.interfaces.iter().map(|id| library.interface(*id));
        let interfaces: Vec<&Interface> = interfaces.collect();
        let all = interfaces
            .iter()
            .map(|i| (&i.name, names::module(&i.name.text)));
        collisions(all, "interfaces", found);
        let mut types = Vec::new();
        for id in &module.types {
            let name = &library.ty(*id).name;
            types.push((name, names::ty(&name.text)));
            inside(library, *id, found);
        }
        // Only now: a type is told before the structure of another one.
        for id in &module.types {
            let name = &library.ty(*id).name;
            let structures = crate::view::in_place::of(library, *id, &mut known);
            let structures = structures.iter();
            types.extend(structures.map(|s| (name, in_place::structure_name(&s.path))));
        }
        collisions(types.into_iter(), "types", found);
        for interface in interfaces {
            operations(library, interface, found);
        }
    }
}

/// What is declared in a type.
fn inside(library: &Library, id: TypeId, found: &mut Diagnostics) {
    let decl = library.ty(id);
    match &decl.kind {
        TypeDeclKind::Enum(values) => {
            let values = values.iter().map(|v| (&v.name, names::camel(&v.name.text)));
            collisions(values, "enumerators", found);
        }
        TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
            let fields = members
                .iter()
                .map(|m| (&m.name, names::snake(&m.name.text)));
            collisions(fields, "members", found);
            if decl.image.is_some() && matches!(decl.kind, TypeDeclKind::Struct(_)) {
                let methods = members.iter().flat_map(|m| accessors(library, m));
                collisions(methods, "members", found);
            }
        }
        TypeDeclKind::Alias(_) => {}
    }
}

/// The functions that a structure in shared memory has for a member.
fn accessors<'a>(library: &Library, member: &'a Member) -> Vec<(&'a Name, String)> {
    let name = names::snake(&member.name.text);
    let short = bare(&name).to_owned();
    let all = match library.resolved(&member.ty) {
        ty if member.optional || matches!(ty, Type::Sequence(..)) => {
            vec![name, format!("{short}_mut"), format!("resize_{short}")]
        }
        Type::String(_) => vec![name, format!("set_{short}")],
        _ => Vec::new(),
    };
    all.into_iter().map(|name| (&member.name, name)).collect()
}

fn operations(library: &Library, interface: &Interface, found: &mut Diagnostics) {
    let methods = interface.operations.iter().flat_map(|operation| {
        let method = names::method(&operation.name.text);
        let loan = operation.topic_in_place(library);
        let in_place = operation.result_in_place(library);
        let more = [
            loan.map(|_| format!("loan_{}", bare(&method))),
            in_place.map(|_| format!("{}_in_place", bare(&method))),
        ];
        let all = std::iter::once(method).chain(more.into_iter().flatten());
        all.map(|method| (&operation.name, method))
            .collect::<Vec<_>>()
    });
    collisions(methods, "operations", found);
    for operation in &interface.operations {
        let parameters = operation.inputs.iter().chain(&operation.outputs);
        let parameters = parameters.map(|m| (&m.name, names::local(&m.name.text)));
        collisions(parameters, "parameters", found);
        let exceptions = operation.throws.iter().map(|id| &library.ty(*id).name);
        let exceptions = exceptions.map(|name| (name, variant(&name.text)));
        collisions(exceptions, "exceptions", found);
    }
}

fn collisions<'a>(
    names: impl Iterator<Item = (&'a Name, String)>,
    what: &str,
    found: &mut Diagnostics,
) {
    let mut seen: Vec<(&Name, String)> = Vec::new();
    for (name, rust) in names {
        if let Some((first, _)) = seen.iter().find(|(_, other)| *other == rust) {
            let message = format!(
                "{what} `{}` and `{}` are both `{rust}` in Rust",
                first.text, name.text
            );
            found.push(
                Diagnostic::error("name-collision", name.span, message)
                    .label(first.span, "the other one"),
            );
        }
        seen.push((name, rust));
    }
}
