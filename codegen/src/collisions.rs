//! Two names of the IDSL that become one name of the generated language. Names that generated code
//! adds to them make room instead.

use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{Interface, TypeDeclKind, TypeId};
use rc_syntax::Name;
use std::collections::BTreeSet;

/// `wanted`, with a `_` at the end as long as the name is taken. Takes it.
pub(crate) fn free(wanted: String, taken: &mut BTreeSet<String>) -> String {
    let mut name = wanted;
    while !taken.insert(name.clone()) {
        name.push('_');
    }
    name
}

/// A name as a part of a longer one, without the `_` that keeps it apart from others.
pub(crate) fn bare(name: &str) -> &str {
    name.trim_end_matches('_')
}

/// The names of the declarations of the IDSL in a language.
pub(crate) struct Naming {
    /// The language, for people.
    pub(crate) language: &'static str,
    pub(crate) module: fn(&str) -> String,
    pub(crate) ty: fn(&str) -> String,
    pub(crate) enumerator: fn(&str) -> String,
    pub(crate) member: fn(&str) -> String,
    pub(crate) operation: fn(&str) -> String,
    pub(crate) parameter: fn(&str) -> String,
    pub(crate) exception: fn(&str) -> String,
}

/// Finds them in all modules of a library.
pub(crate) fn check(library: &Library, names: &Naming, found: &mut Diagnostics) {
    let modules = library.modules.iter().map(|module| &module.name);
    collisions(
        modules.map(|n| (n, (names.module)(&n.text))),
        "modules",
        names,
        found,
    );
    for module in &library.modules {
        let interfaces = module.interfaces.iter().map(|id| library.interface(*id));
        let interfaces: Vec<&Interface> = interfaces.collect();
        let all = interfaces
            .iter()
            .map(|i| (&i.name, (names.module)(&i.name.text)));
        collisions(all, "interfaces", names, found);
        let mut types = Vec::new();
        for id in &module.types {
            let name = &library.ty(*id).name;
            types.push((name, (names.ty)(&name.text)));
            inside(library, *id, names, found);
        }
        collisions(types.into_iter(), "types", names, found);
        for interface in interfaces {
            operations(library, interface, names, found);
        }
    }
}

/// Finds collisions among the names that a type declares.
fn inside(library: &Library, id: TypeId, names: &Naming, found: &mut Diagnostics) {
    let decl = library.ty(id);
    match &decl.kind {
        TypeDeclKind::Enum(values) => {
            let values = values
                .iter()
                .map(|v| (&v.name, (names.enumerator)(&v.name.text)));
            collisions(values, "enumerators", names, found);
        }
        TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
            let fields = members
                .iter()
                .map(|m| (&m.name, (names.member)(&m.name.text)));
            collisions(fields, "members", names, found);
        }
        TypeDeclKind::Alias(_) => {}
    }
}

fn operations(library: &Library, interface: &Interface, names: &Naming, found: &mut Diagnostics) {
    let operations = interface.operations.iter();
    let methods =
        operations.map(|operation| (&operation.name, (names.operation)(&operation.name.text)));
    collisions(methods, "operations", names, found);
    for operation in &interface.operations {
        let parameters = operation.inputs.iter().chain(&operation.outputs);
        let parameters = parameters.map(|m| (&m.name, (names.parameter)(&m.name.text)));
        collisions(parameters, "parameters", names, found);
        let exceptions = operation.throws.iter().map(|id| &library.ty(*id).name);
        let exceptions = exceptions.map(|name| (name, (names.exception)(&name.text)));
        collisions(exceptions, "exceptions", names, found);
    }
}

fn collisions<'a>(
    names: impl Iterator<Item = (&'a Name, String)>,
    what: &str,
    naming: &Naming,
    found: &mut Diagnostics,
) {
    let mut seen: Vec<(&Name, String)> = Vec::new();
    for (name, own) in names {
        if let Some((first, _)) = seen.iter().find(|(_, other)| *other == own) {
            let message = format!(
                "{what} `{}` and `{}` are both `{own}` in {}",
                first.text, name.text, naming.language
            );
            found.push(
                Diagnostic::error("name-collision", name.span, message)
                    .label(first.span, "the other one"),
            );
        }
        seen.push((name, own));
    }
}
