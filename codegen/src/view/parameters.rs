//! The parameters of a component as Rust structures.

use crate::{layout, names};
use heck::ToUpperCamelCase;
use rc_configuration::model::{self, Kind, Parameter, Type};
use serde::Serialize;
use std::collections::HashSet;

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
    /// What shows it without what is secret; none where nothing is.
    pub debug: Option<String>,
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
    let mut structs = Structs::default();
    let doc = if parameters.doc.is_empty() {
        vec![format!("The parameters `{}`.", parameters.name)]
    } else {
        parameters.doc.clone()
    };
    let name = structs.name("", "");
    structs.add(name, &doc, &parameters.parameters);
    // `"#` could end a raw string. In JSON it is always part of a text, where a `#` may be written as an escape.
    let json = parameters.to_json().replace("\"#", "\"\\u0023");
    Parameters {
        json,
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
    /// `laser` becomes `LaserParams`, so that it cannot be taken for the trait or the type `Laser`. The names of the
    /// groups around it come first; where `a` in `b` and `b_a` would be one name, the second gets a number.
    fn name(&mut self, owner: &str, parameter: &str) -> String {
        let owner = owner.strip_suffix("Params").unwrap_or(owner);
        let mut base = format!("{owner}{}", parameter.to_upper_camel_case());
        if base.starts_with(|c: char| c.is_ascii_digit()) {
            base.insert(0, 'N');
        }
        let numbered = (2..).map(|n| format!("{base}{n}Params"));
        let mut all = std::iter::once(format!("{base}Params")).chain(numbered);
        let name = all.find(|name| !self.names.contains(name));
        let name = name.unwrap_or(base);
        self.names.insert(name.clone());
        name
    }

    fn add(&mut self, name: String, doc: &[String], parameters: &[Parameter]) {
        let fields = parameters.iter().map(|p| field(&name, p, self)).collect();
        let hides = parameters.iter().any(|p| p.secret);
        self.done.push(Struct {
            debug: hides.then(|| debug(&name, parameters)),
            name,
            doc: crate::layout::doc(doc),
            fields,
        });
    }
}

/// The body of `fmt`.
fn debug(name: &str, parameters: &[Parameter]) -> String {
    let field = |parameter: &Parameter| {
        let field = names::snake(&parameter.name);
        let value = if parameter.secret {
            "&\"***\"".to_owned()
        } else {
            format!("&self.{field}")
        };
        layout::call(12, ".field", &[format!("{:?}", parameter.name), value], "")
    };
    let mut calls: Vec<String> = parameters.iter().map(field).collect();
    calls.push(".finish()".to_owned());
    let calls: Vec<&str> = calls.iter().map(String::as_str).collect();
    layout::chain(8, 0, &format!("f.debug_struct({name:?})"), &calls)
}

fn field(owner: &str, parameter: &Parameter, out: &mut Structs) -> Field {
    let name = &parameter.name;
    let (ty, value) = match &parameter.kind {
        Kind::Scalar { ty, array } => scalar(*ty, array.is_some(), name),
        Kind::Group(members) => {
            let inner = out.name(owner, name);
            out.add(inner.clone(), &[format!("The group `{name}`.")], members);
            let value = format!("{inner}::from_values(values.group({name:?}))");
            (inner, value)
        }
        Kind::List { parameters, .. } => {
            let inner = out.name(owner, name);
            let doc = [format!("One element of `{name}`.")];
            out.add(inner.clone(), &doc, parameters);
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
