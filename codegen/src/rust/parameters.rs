//! Structures of Rust for the parameters of a component.

use super::names;
use crate::type_names;
use crate::view;
use crate::view::parameters::ValueKind;
use rc_configuration::model::Type;
use serde::Serialize;
use std::collections::HashSet;

#[derive(Debug, Serialize)]
pub(crate) struct Parameters {
    /// Parameter model for the checker of configurations, as the content of a raw string.
    json: String,
    /// The structures, the outermost last.
    structs: Vec<Struct>,
}

#[derive(Debug, Serialize)]
struct Struct {
    name: String,
    doc: Vec<String>,
    fields: Vec<Field>,
    derives: &'static [&'static str],
    /// Whether a field is never shown.
    hides: bool,
}

#[derive(Debug, Serialize)]
struct Field {
    /// The name in the `.pdsl`.
    key: String,
    name: String,
    doc: Vec<String>,
    ty: String,
    /// The expression that reads the value from `values`.
    read: String,
    /// The expression whose value `Debug` shows.
    shown: String,
}

pub(crate) fn of(parameters: &view::Parameters) -> Parameters {
    let mut structs = Structs::default();
    let doc = if parameters.doc.is_empty() {
        vec![format!("The parameters `{}`.", parameters.name)]
    } else {
        parameters.doc.clone()
    };
    let name = type_names::group(&mut structs.names, "", "");
    structs.add(name, doc, &parameters.members);
    Parameters {
        // `"#` could end a raw string. In JSON it is always part of a text, where a `#` may be
        // written as an escape.
        json: parameters.json.replace("\"#", "\"\\u0023"),
        structs: structs.done,
    }
}

#[derive(Default)]
struct Structs {
    done: Vec<Struct>,
    /// The names of all of them, done or not.
    names: HashSet<String>,
}

impl Structs {
    fn add(&mut self, name: String, doc: Vec<String>, parameters: &[view::Parameter]) {
        let fields = parameters.iter().map(|p| self.field(&name, p)).collect();
        let hides = parameters.iter().any(|p| p.secret);
        self.done.push(Struct {
            name,
            doc,
            fields,
            derives: if hides {
                &["Clone", "PartialEq"]
            } else {
                &["Clone", "Debug", "PartialEq"]
            },
            hides,
        });
    }

    fn field(&mut self, owner: &str, parameter: &view::Parameter) -> Field {
        let key = &parameter.name;
        let mut group = String::new();
        if parameter.kind.has_members() {
            group = type_names::group(&mut self.names, owner, key);
            let doc = if parameter.kind == ValueKind::List {
                format!("One element of `{key}`.")
            } else {
                format!("The group `{key}`.")
            };
            self.add(group.clone(), vec![doc], &parameter.members);
        }
        let (ty, read, cast) = match parameter.kind {
            ValueKind::Values(Type::Bool) => ("bool", "bool", ""),
            ValueKind::Values(Type::Int) => ("i32", "int", "i32"),
            ValueKind::Values(Type::Long) => ("i64", "int", ""),
            ValueKind::Values(Type::Float) => ("f32", "float", "f32"),
            ValueKind::Values(Type::Double) => ("f64", "float", ""),
            ValueKind::Values(Type::String) => ("String", "text", ""),
            ValueKind::Values(Type::Duration) => ("std::time::Duration", "duration", ""),
            ValueKind::Values(Type::Path) => ("std::path::PathBuf", "path", ""),
            ValueKind::Group | ValueKind::List => (group.as_str(), "", ""),
        };
        let read = match (parameter.kind, parameter.array, cast) {
            (ValueKind::List, ..) => {
                format!("values.list({key:?}).iter().map({group}::from_values).collect()")
            }
            (ValueKind::Group, ..) => format!("{group}::from_values(values.group({key:?}))"),
            (_, true, "") => format!("values.{read}s({key:?})"),
            (_, true, cast) => {
                format!("values.{read}s({key:?}).iter().map(|v| *v as {cast}).collect()")
            }
            (_, false, "") => format!("values.{read}({key:?})"),
            (_, false, cast) => format!("values.{read}({key:?}) as {cast}"),
        };
        let ty = if parameter.array || parameter.kind == ValueKind::List {
            format!("Vec<{ty}>")
        } else {
            ty.to_owned()
        };
        let name = names::snake(key);
        let shown = if parameter.secret {
            r#"&"***""#.to_owned()
        } else {
            format!("&self.{name}")
        };
        let mut doc = parameter.doc.clone();
        if !doc.is_empty() {
            doc.push(String::new());
        }
        doc.push(format!("Allowed: {}.", parameter.allowed));
        Field {
            key: key.clone(),
            name,
            doc,
            ty,
            read,
            shown,
        }
    }
}
