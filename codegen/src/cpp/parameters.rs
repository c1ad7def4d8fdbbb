//! Structures of C++ for the parameters of a component.

use super::names;
use crate::type_names;
use crate::view;
use crate::view::parameters::ValueKind;
use rc_configuration::model::Type;
use serde::Serialize;
use std::collections::HashSet;

/// The structures, the outermost last.
#[derive(Debug, Serialize)]
pub(crate) struct Parameters {
    structs: Vec<Struct>,
}

#[derive(Debug, Serialize)]
struct Struct {
    name: String,
    doc: String,
    members: Vec<Member>,
}

#[derive(Debug, Serialize)]
struct Member {
    ty: String,
    name: String,
    doc: Vec<String>,
}

pub(crate) fn of(parameters: &view::Parameters) -> Parameters {
    let mut structs = Structs::default();
    let name = type_names::group(&mut structs.names, "", "");
    let doc = match parameters.doc.as_slice() {
        [] => format!("The parameters `{}`.", parameters.name),
        lines => lines.join(" "),
    };
    structs.add(name, doc, &parameters.members);
    Parameters {
        structs: structs.done,
    }
}

/// The type of one value.
fn scalar(ty: Type) -> &'static str {
    match ty {
        Type::Bool => "bool",
        Type::Int => "std::int32_t",
        Type::Long => "std::int64_t",
        Type::Float => "float",
        Type::Double => "double",
        Type::String => "std::string",
        Type::Duration => "std::chrono::nanoseconds",
        Type::Path => "std::filesystem::path",
    }
}

#[derive(Default)]
struct Structs {
    done: Vec<Struct>,
    /// The names of all of them, done or not.
    names: HashSet<String>,
}

impl Structs {
    fn add(&mut self, name: String, doc: String, parameters: &[view::Parameter]) {
        let members = parameters.iter().map(|p| self.member(&name, p)).collect();
        self.done.push(Struct { name, doc, members });
    }

    fn member(&mut self, owner: &str, parameter: &view::Parameter) -> Member {
        let ty = match parameter.kind {
            ValueKind::Values(ty) => scalar(ty).to_owned(),
            ValueKind::Group | ValueKind::List => {
                let group = type_names::group(&mut self.names, owner, &parameter.name);
                let doc = if parameter.kind == ValueKind::List {
                    format!("One element of `{}`.", parameter.name)
                } else {
                    format!("The group `{}`.", parameter.name)
                };
                self.add(group.clone(), doc, &parameter.members);
                group
            }
        };
        let many = parameter.array || parameter.kind == ValueKind::List;
        let mut doc = parameter.doc.clone();
        doc.push(format!("Allowed: {}.", parameter.allowed));
        Member {
            ty: if many {
                format!("std::vector<{ty}>")
            } else {
                ty
            },
            name: names::own(&parameter.name),
            doc,
        }
    }
}
