//! The parameters of a component as Rust structures.

use crate::{layout, names};
use heck::ToUpperCamelCase;
use rc_pdsl::model::{self, Kind, Parameter, Type};
use serde::Serialize;

/// All parameters.
#[derive(Debug, Serialize)]
pub struct Parameters {
    /// The schema as JSON, as the content of a Rust raw string.
    pub json: String,
    /// The structures, the outermost last.
    pub structs: Vec<Struct>,
}

/// One structure.
#[derive(Debug, Serialize)]
pub struct Struct {
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its fields.
    pub fields: Vec<Field>,
}

/// One field.
#[derive(Debug, Serialize)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its type.
    pub ty: String,
    /// The expression that takes it from `values`.
    pub value: String,
}

pub(super) fn of(parameters: &model::Parameters) -> Parameters {
    let mut structs = Vec::new();
    let doc = if parameters.doc.is_empty() {
        vec![format!("The parameters `{}`.", parameters.name)]
    } else {
        parameters.doc.clone()
    };
    structure("Params", &doc, &parameters.parameters, &mut structs);
    Parameters {
        json: parameters.to_json(),
        structs,
    }
}

fn structure(name: &str, doc: &[String], parameters: &[Parameter], out: &mut Vec<Struct>) {
    let fields = parameters.iter().map(|p| field(name, p, out)).collect();
    out.push(Struct {
        name: name.to_owned(),
        doc: crate::layout::doc(doc),
        fields,
    });
}

fn field(owner: &str, parameter: &Parameter, out: &mut Vec<Struct>) -> Field {
    let name = &parameter.name;
    // `laser` becomes `LaserParams`, so that it cannot be taken for the trait or the type `Laser`.
    let inner = format!(
        "{}{}Params",
        owner.trim_end_matches("Params"),
        name.to_upper_camel_case()
    );
    let (ty, value) = match &parameter.kind {
        Kind::Scalar { ty, array } => scalar(*ty, array.is_some(), name),
        Kind::Group(members) => {
            structure(&inner, &[format!("The group `{name}`.")], members, out);
            (
                inner.clone(),
                format!("{inner}::from_values(values.group({name:?}))"),
            )
        }
        Kind::List { parameters, .. } => {
            structure(
                &inner,
                &[format!("One element of `{name}`.")],
                parameters,
                out,
            );
            let value = layout::chain(
                12,
                names::snake(name).len() + 2,
                "values",
                &[
                    &format!(".list({name:?})"),
                    ".iter()",
                    &format!(".map({inner}::from_values)"),
                    ".collect()",
                ],
            );
            (format!("Vec<{inner}>"), value)
        }
    };
    let facts = format!("Allowed: {}.", parameter.allowed());
    let mut doc = parameter.doc.clone();
    if !doc.is_empty() {
        doc.push(String::new());
    }
    doc.push(facts);
    Field {
        name: names::snake(name),
        doc: crate::layout::doc(&doc),
        ty,
        value,
    }
}

fn scalar(ty: Type, array: bool, name: &str) -> (String, String) {
    let (rust, method, cast) = match ty {
        Type::Bool => ("bool", "bool", ""),
        Type::Int => ("i32", "int", " as i32"),
        Type::Long => ("i64", "int", ""),
        Type::Float => ("f32", "float", " as f32"),
        Type::Double => ("f64", "float", ""),
        Type::String => ("String", "text", ""),
        Type::Duration => ("std::time::Duration", "duration", ""),
        Type::Path => ("std::path::PathBuf", "path", ""),
    };
    if !array {
        return (rust.to_owned(), format!("values.{method}({name:?}){cast}"));
    }
    let value = match cast {
        "" => format!("values.{method}s({name:?})"),
        _ => layout::chain(
            12,
            names::snake(name).len() + 2,
            "values",
            &[
                &format!(".{method}s({name:?})"),
                ".iter()",
                &format!(".map(|v| *v{cast})"),
                ".collect()",
            ],
        ),
    };
    (format!("Vec<{rust}>"), value)
}
