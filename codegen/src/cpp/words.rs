//! Names of the IDSL that are words of C++ or names of the headers, and modules that hide the framework.

use super::names;
use rc_cdsl::Component;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::model::TypeDeclKind;
use rc_syntax::Name;

/// Namespaces of C++, of the framework and of Ice.
const NAMESPACES: [&str; 5] = ["abi", "Ice", "rc", "robocomp", "std"];

/// Whether no namespace of a component can have this name.
pub(super) fn is_namespace(name: &str) -> bool {
    NAMESPACES.contains(&name) || names::is_word(name)
}

/// Reports them.
pub(crate) fn check(component: &Component, found: &mut Diagnostics) {
    let library = &component.library;
    let mut word = |name: &Name| {
        let what = if names::is_word(&name.text) {
            Some("is a word of C++")
        } else {
            names::is_of_headers(&name.text)
                .then_some("begins as names of the framework's headers do")
        };
        if let Some(what) = what {
            let own = names::own(&name.text);
            let message = format!(
                "`{}` {what}: generated code calls it `{own}`, as Ice does",
                name.text
            );
            found.push(Diagnostic::warning("word-of-cpp", name.span, message));
        }
    };
    for module in &library.modules {
        for id in &module.types {
            let decl = library.ty(*id);
            word(&decl.name);
            match &decl.kind {
                TypeDeclKind::Enum(values) => values.iter().for_each(|value| word(&value.name)),
                TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
                    members.iter().for_each(|member| word(&member.name));
                }
                TypeDeclKind::Alias(_) => {}
            }
        }
        for id in &module.interfaces {
            for operation in &library.interface(*id).operations {
                word(&operation.name);
                let parameters = operation.inputs.iter().chain(&operation.outputs);
                parameters.for_each(|parameter| word(&parameter.name));
            }
        }
    }
    for module in &library.modules {
        let name = &module.name;
        if is_namespace(&name.text) {
            let message = format!(
                "C++ cannot have a module `{}`: the word is taken",
                name.text
            );
            let help = "give the module another name, or write the component in Rust or Python";
            found.push(Diagnostic::error("not-in-cpp", name.span, message).help(help));
        }
        let types = module.types.iter().map(|id| &library.ty(*id).name);
        for same in types.filter(|other| other.text == name.text) {
            let message = format!("C++ cannot have `{0}` in a module `{0}`", name.text);
            found.push(Diagnostic::error("not-in-cpp", same.span, message));
        }
        // A member has no name of its structure.
        for id in &module.types {
            let decl = library.ty(*id);
            if let TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) = &decl.kind {
                for same in members
                    .iter()
                    .filter(|member| member.name.text == decl.name.text)
                {
                    let message =
                        format!("C++ cannot have a member `{0}` in `{0}`", decl.name.text);
                    found.push(Diagnostic::error("not-in-cpp", same.name.span, message));
                }
            }
        }
    }
}
