//! Names and types of Rust for IDSL modules: what `templates/rust/module.rs.tera` prints.

use super::in_place::{self, InPlaceType};
use super::names;
use super::operation_names::{
    answer_name, bare, error_name, exception_constant, operation_constant, plain, variant,
};
use super::types;
use crate::view::checks::Check;
use crate::view::documentation;
use crate::view::library as view;
use crate::view::members;
use crate::view::types::Type;
use serde::Serialize;
use std::collections::BTreeSet;

/// One IDSL module: one file.
#[derive(Debug, Serialize)]
pub(crate) struct Module<'a> {
    pub(crate) name: &'a str,
    pub(crate) stem: String,
    doc: &'a [String],
    constants: Vec<Constant<'a>>,
    types: Vec<TypeDecl<'a>>,
    interfaces: Vec<Interface<'a>>,
    /// The description as a literal of Rust.
    description: String,
    /// Whether a type has an encoding of its own, which an alias has not.
    encodes: bool,
}

#[derive(Debug, Serialize)]
struct Constant<'a> {
    name: String,
    doc: &'a [String],
    ty: String,
    value: String,
}

#[derive(Debug, Serialize)]
struct TypeDecl<'a> {
    kind: &'static str,
    name: String,
    doc: &'a [String],
    values: Vec<Enumerator<'a>>,
    members: Vec<Member<'a>>,
    /// The type that an alias stands for.
    target: String,
    /// Whether a default differs from the one that Rust derives.
    own_default: bool,
    /// Whether a reader checks something.
    checked: bool,
    in_place: Vec<InPlaceType<'a>>,
}

#[derive(Debug, Serialize)]
struct Enumerator<'a> {
    name: String,
    doc: &'a [String],
    number: i32,
}

/// A member, or a parameter as a variable.
#[derive(Debug, Serialize)]
struct Member<'a> {
    /// The name in the IDSL, for messages.
    idsl: &'a str,
    name: String,
    doc: Vec<String>,
    ty: String,
    default: String,
    optional: bool,
    checks: &'a [Check],
    /// How a client or a publisher takes it.
    borrowed: String,
    /// `value`, `text`, `sequence` or `reference`: what is to be written then.
    write: &'static str,
}

#[derive(Debug, Serialize)]
struct Interface<'a> {
    name: &'a str,
    module: String,
    doc: &'a [String],
    client: String,
    publisher: String,
    calls: bool,
    topics: bool,
    queries: bool,
    throws: bool,
    operations: Vec<Operation<'a>>,
    exceptions: Vec<(String, i32)>,
}

#[derive(Debug, Serialize)]
struct Operation<'a> {
    name: &'a str,
    method: String,
    /// The functions that lend a sample, and that read a reply in place.
    loan: String,
    read_in_place: String,
    /// The operation as a part of the name of a function.
    plain: String,
    constant: String,
    doc: Vec<String>,
    id: i32,
    type_hash: &'a str,
    two_way: bool,
    inputs: Vec<Member<'a>>,
    /// Members of the reply, in the order of the wire.
    replies: Vec<Member<'a>>,
    /// Their variables in the order of the returned tuple, whose first is the value of the
    /// operation.
    returned: Vec<String>,
    result: String,
    /// The name of the tuple, and its types; empty where it is none.
    answer: String,
    answer_types: Vec<String>,
    error: String,
    throws: Vec<Exception>,
    /// The structure of a sample, and of a result, in shared memory; else empty.
    sample_in_place: String,
    result_in_place: String,
}

#[derive(Debug, Serialize)]
struct Exception {
    variant: String,
    ty: String,
    constant: String,
}

pub(crate) fn module(module: &view::Module) -> Module<'_> {
    let types: Vec<TypeDecl> = module
        .types
        .iter()
        .map(|decl| type_decl(&module.name, decl))
        .collect();
    let path = types::in_module(&module.name);
    let constants = module.constants.iter().map(|constant| Constant {
        name: names::shout(&constant.name),
        doc: &constant.doc,
        ty: match constant.ty.resolved() {
            Type::Text { .. } => "&str".to_owned(),
            ty => types::owned(ty, &path),
        },
        value: match constant.ty.resolved() {
            Type::Text { .. } => format!("{:?}", constant.value.text),
            _ => types::value(&constant.value, &path),
        },
    });
    Module {
        name: &module.name,
        stem: names::module(&module.name),
        doc: &module.doc,
        constants: constants.collect(),
        encodes: types.iter().any(|decl| decl.kind != "alias"),
        types,
        interfaces: module.interfaces.iter().map(interface).collect(),
        description: raw(&module.description),
    }
}

/// A text as a raw string of Rust.
fn raw(text: &str) -> String {
    let mut marks = "#".to_owned();
    while text.contains(&format!("\"{marks}")) {
        marks.push('#');
    }
    format!("r{marks}\"{text}\"{marks}")
}

fn type_decl<'a>(home: &str, decl: &'a view::TypeDecl) -> TypeDecl<'a> {
    let path = types::in_module(home);
    let mut out = TypeDecl {
        kind: "",
        name: names::ty(&decl.name),
        doc: &decl.doc,
        values: Vec::new(),
        members: Vec::new(),
        target: String::new(),
        own_default: false,
        checked: false,
        in_place: in_place::of(home, &decl.in_place),
    };
    match &decl.kind {
        view::Kind::Enum { values } => {
            out.kind = "enum";
            let one = |value: &'a view::Enumerator| Enumerator {
                name: names::camel(&value.name),
                doc: &value.doc,
                number: value.number,
            };
            out.values = values.iter().map(one).collect();
        }
        view::Kind::Alias { target } => {
            out.kind = "alias";
            out.target = types::owned(target, &path);
        }
        view::Kind::Struct { members } | view::Kind::Exception { members } => {
            let exception = matches!(decl.kind, view::Kind::Exception { .. });
            out.kind = if exception { "exception" } else { "struct" };
            out.own_default = members
                .iter()
                .any(|m| m.default.is_some() || is_long_array(&m.ty));
            out.checked = members.iter().any(|m| !m.checks.is_empty());
            let one = |m: &'a members::Member| member(m, names::snake(&m.name), &path);
            out.members = members.iter().map(one).collect();
        }
    }
    out
}

fn member<'a>(of: &'a members::Member, name: String, path: types::Path) -> Member<'a> {
    let default = match &of.default {
        Some(value) if of.optional => format!("Some({})", types::value(value, path)),
        Some(value) => types::value(value, path),
        None if is_long_array(&of.ty) && !of.optional => {
            "std::array::from_fn(|_| Default::default())".to_owned()
        }
        None => "Default::default()".to_owned(),
    };
    Member {
        idsl: &of.name,
        doc: documentation::of_member(of),
        ty: types::member(of, path),
        default,
        optional: of.optional,
        checks: &of.checks,
        borrowed: types::borrowed(of, path),
        write: match of.ty.resolved() {
            _ if of.optional => "reference",
            Type::Text { .. } => "text",
            Type::Sequence { .. } => "sequence",
            ty if types::is_small(ty) => "value",
            _ => "reference",
        },
        name,
    }
}

/// The standard library has defaults of arrays of at most 32 elements.
fn is_long_array(ty: &Type) -> bool {
    match ty.resolved() {
        Type::Array { element, length } => *length > 32 || is_long_array(element),
        _ => false,
    }
}

fn interface(interface: &view::Interface) -> Interface<'_> {
    let name = names::camel(&interface.name);
    let mut exceptions: Vec<(String, i32)> = interface
        .operations
        .iter()
        .flat_map(|operation| &operation.throws)
        .map(|exception| (constant(interface, exception), exception.id))
        .collect();
    exceptions.sort();
    exceptions.dedup();
    let operations = interface.operations.iter();
    let methods = operations.clone().map(|o| names::method(&o.name));
    let mut functions: BTreeSet<String> = methods.collect();
    Interface {
        name: &interface.name,
        module: names::module(&interface.name),
        doc: &interface.doc,
        client: format!("{name}Client"),
        publisher: format!("{name}Publisher"),
        calls: interface.calls,
        topics: interface.topics,
        queries: interface.operations.iter().any(|o| o.two_way),
        throws: !exceptions.is_empty(),
        operations: operations
            .map(|o| operation(interface, o, &mut functions))
            .collect(),
        exceptions,
    }
}

fn constant(interface: &view::Interface, exception: &view::Exception) -> String {
    let operations = interface.operations.iter().map(|o| o.name.as_str());
    exception_constant(operations, type_name(&exception.ty))
}

fn type_name(ty: &Type) -> &str {
    match ty {
        Type::Named { name, .. } => name,
        _ => "",
    }
}

/// `functions` are those that the client or the publisher has by now.
fn operation<'a>(
    interface: &'a view::Interface,
    of: &'a view::Operation,
    functions: &mut BTreeSet<String>,
) -> Operation<'a> {
    let path = types::in_interface(&interface.module);
    let parameters = |members: &'a [members::Member]| -> Vec<Member<'a>> {
        let members = members.iter();
        members
            .map(|m| member(m, names::local(&m.name), &path))
            .collect()
    };
    let mut replies = parameters(&of.outputs);
    let mut returned: Vec<String> = replies.iter().map(|m| m.name.clone()).collect();
    let mut answer_types: Vec<String> = replies.iter().map(|m| m.ty.clone()).collect();
    if let Some(result) = &of.result {
        let ty = types::owned(result, &path);
        returned.insert(0, "result".to_owned());
        answer_types.insert(0, ty.clone());
        replies.push(Member {
            idsl: "result",
            name: "result".to_owned(),
            doc: Vec::new(),
            ty,
            default: String::new(),
            optional: false,
            checks: &of.result_checks,
            borrowed: String::new(),
            write: "reference",
        });
    }
    let (answer, result) = match answer_types.as_slice() {
        [] => (String::new(), "()".to_owned()),
        [one] => (String::new(), one.clone()),
        _ => (answer_name(&of.name), answer_name(&of.name)),
    };
    let method = names::method(&of.name);
    let mut function = |there: bool, wanted: String| {
        let name = there.then(|| names::free(wanted, functions));
        name.unwrap_or_default()
    };
    let loan = function(
        of.sample_in_place.is_some(),
        format!("loan_{}", bare(&method)),
    );
    let read_in_place = function(
        of.result_in_place.is_some(),
        format!("{}_in_place", bare(&method)),
    );
    let placed = |ty: &Option<Type>| match ty {
        Some(Type::Named { module, name, .. }) => in_place::path(&path(module, name)),
        _ => String::new(),
    };
    let throws = of.throws.iter().map(|exception| Exception {
        variant: variant(type_name(&exception.ty)),
        ty: types::owned(&exception.ty, &path),
        constant: constant(interface, exception),
    });
    Operation {
        name: &of.name,
        loan,
        read_in_place,
        plain: plain(&of.name),
        constant: operation_constant(&of.name),
        doc: documentation::of_operation(of, names::local),
        id: of.id,
        type_hash: &of.type_hash,
        two_way: of.two_way,
        inputs: parameters(&of.inputs),
        replies,
        returned,
        result,
        answer,
        answer_types,
        error: if of.throws.is_empty() {
            String::new()
        } else {
            error_name(&of.name)
        },
        throws: throws.collect(),
        sample_in_place: placed(&of.sample_in_place),
        result_in_place: placed(&of.result_in_place),
        method,
    }
}
