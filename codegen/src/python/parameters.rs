//! Classes of Python for the parameters of a component.

use super::{documentation, names};
use crate::type_names;
use crate::view;
use crate::view::parameters::ValueKind;
use rc_configuration::model::Type;
use serde::Serialize;
use std::collections::HashSet;

#[derive(Debug, Serialize)]
pub(crate) struct Parameters {
    /// The classes, the outermost last.
    classes: Vec<Class>,
    durations: bool,
    paths: bool,
}

#[derive(Debug, Serialize)]
struct Class {
    name: String,
    doc: String,
    fields: Vec<Field>,
}

#[derive(Debug, Serialize)]
struct Field {
    /// The name in the `.pdsl`, as a literal.
    key: String,
    name: String,
    doc: String,
    ty: String,
    secret: bool,
    /// The expression that makes it of `values`.
    read: String,
}

pub(crate) fn of(parameters: &view::Parameters) -> Parameters {
    let mut classes = Classes::default();
    let doc = if parameters.doc.is_empty() {
        vec![format!("The parameters `{}`.", parameters.name)]
    } else {
        parameters.doc.clone()
    };
    let name = type_names::group(&mut classes.names, "", "");
    classes.add(name, &doc, &parameters.members);
    let uses = |word: &str| {
        let mut fields = classes.done.iter().flat_map(|class| &class.fields);
        fields.any(|field| field.ty.contains(word))
    };
    Parameters {
        durations: uses("_datetime."),
        paths: uses("_pathlib."),
        classes: classes.done,
    }
}

#[derive(Default)]
struct Classes {
    done: Vec<Class>,
    /// The names of all of them, done or not.
    names: HashSet<String>,
}

impl Classes {
    fn add(&mut self, name: String, doc: &[String], parameters: &[view::Parameter]) {
        let fields = parameters.iter().map(|p| self.field(&name, p)).collect();
        self.done.push(Class {
            name,
            doc: documentation::docstring(4, doc),
            fields,
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
            self.add(group.clone(), &[doc], &parameter.members);
        }
        let ty = match parameter.kind {
            ValueKind::Values(Type::Bool) => "bool",
            ValueKind::Values(Type::Int | Type::Long) => "int",
            ValueKind::Values(Type::Float | Type::Double) => "float",
            ValueKind::Values(Type::String) => "str",
            ValueKind::Values(Type::Duration) => "_datetime.timedelta",
            ValueKind::Values(Type::Path) => "_pathlib.Path",
            ValueKind::Group | ValueKind::List => group.as_str(),
        };
        let literal = super::types::text(key);
        let value = format!("values[{literal}]");
        let make = match parameter.kind {
            ValueKind::Values(Type::Path) => "_pathlib.Path".to_owned(),
            ValueKind::Values(_) => String::new(),
            ValueKind::Group | ValueKind::List => format!("{group}.from_values"),
        };
        let many = parameter.array || parameter.kind == ValueKind::List;
        let read = match (make.as_str(), many) {
            ("", true) => format!("list({value})"),
            ("", false) => value,
            (make, true) => format!("[{make}(value) for value in {value}]"),
            (make, false) => format!("{make}({value})"),
        };
        let mut doc = parameter.doc.clone();
        if !doc.is_empty() {
            doc.push(String::new());
        }
        doc.push(format!("Allowed: {}.", parameter.allowed));
        Field {
            name: names::parameter_member(key),
            doc: documentation::docstring(4, &doc),
            ty: if many {
                format!("list[{ty}]")
            } else {
                ty.to_owned()
            },
            secret: parameter.secret,
            key: literal,
            read,
        }
    }
}
