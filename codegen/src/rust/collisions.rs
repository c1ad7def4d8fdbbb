//! Two names of the IDSL that become one name of Rust. Names that generated code adds to them make room instead, see
//! [`super::names::free`].

use super::names;
use super::operation_names::variant;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{Interface, TypeDeclKind, TypeId};
use rc_syntax::Name;

/// Finds them in all modules of a library.
pub(crate) fn check(library: &Library, found: &mut Diagnostics) {
    let modules = library.modules.iter().map(|module| &module.name);
    collisions(
        modules.map(|n| (n, names::module(&n.text))),
        "modules",
        found,
    );
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
        }
        TypeDeclKind::Alias(_) => {}
    }
}

fn operations(library: &Library, interface: &Interface, found: &mut Diagnostics) {
    let operations = interface.operations.iter();
    let methods =
        operations.map(|operation| (&operation.name, names::method(&operation.name.text)));
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
