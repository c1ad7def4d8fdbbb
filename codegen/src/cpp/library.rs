//! Types and interfaces of IDSL modules in C++.

use super::{in_place, names, types};
use crate::collisions;
use crate::view;
use crate::view::documentation;
use crate::view::library::{self, Kind, Module};
use crate::view::members::Member;
use crate::view::types::{Declared, Named, Type, resolved};
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

/// The header of a module.
#[derive(Debug, Serialize)]
pub(crate) struct Header {
    /// The namespace, which is also the name of the file.
    pub(crate) name: String,
    doc: Vec<String>,
    constants: Vec<Constant>,
    types: Vec<TypeDecl>,
    clients: Vec<Ends>,
    publishers: Vec<Ends>,
    /// Clients of slots whose queries can be started.
    asynchronous: Vec<Ends>,
    /// The newest samples of slots with `fresh`, and the results of those with `serve latest`.
    samples: Vec<Ends>,
    results: Vec<Ends>,
    /// The other headers that it needs.
    imports: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Constant {
    doc: Vec<String>,
    ty: String,
    name: String,
    value: String,
}

#[derive(Debug, Serialize)]
struct TypeDecl {
    name: String,
    /// The name in the IDSL, with its module.
    scoped: String,
    doc: Vec<String>,
    /// `enum`, `struct`, `exception` or `alias`.
    kind: &'static str,
    enumerators: Vec<Enumerator>,
    members: Vec<Field>,
    /// The macro that names the members.
    declaration: String,
    target: String,
    /// The hash of an exception.
    id: i32,
    /// The structure of its values in place; empty where the component has none.
    placed: String,
    places: Vec<Field>,
}

#[derive(Debug, Serialize)]
struct Enumerator {
    name: String,
    number: i32,
    doc: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct Field {
    pub(super) ty: String,
    name: String,
    /// The default, in braces.
    pub(super) default: String,
    doc: Vec<String>,
}

/// The client or the publisher of an interface.
#[derive(Debug, Serialize)]
pub(super) struct Ends {
    pub(super) interface: String,
    doc: Vec<String>,
    operations: Vec<Operation>,
    /// The function that takes the result of a started call.
    take: String,
    /// The operation whose sample `loan` begins, the only one that has samples in place; empty otherwise.
    loan: String,
}

#[derive(Debug, Serialize)]
struct Operation {
    index: usize,
    /// The name of the IDSL, and that of the modern form.
    name: String,
    snake: String,
    doc: Vec<String>,
    /// `const A& a, float b`
    inputs: String,
    /// `, a, b`
    arguments: String,
    /// `a, b`
    forwarded: String,
    /// Whether RoboComp's form is another function than the modern one.
    has_own_form: bool,
    /// RoboComp's form: its return type, its parameters, its body.
    result: String,
    parameters: String,
    body: String,
    /// The type of all parts of the reply.
    reply: String,
    /// `, rc::detail::Throws<…>`; empty without exceptions.
    throws: String,
    /// The type of a sample: of its only value, or a tuple.
    sample: String,
    /// The type of the result that can be set before; empty where there is none.
    set: String,
    /// `set_` and the name.
    setter: String,
    /// Whether it has a reply.
    two_way: bool,
    /// `start_` and the name.
    start: String,
    /// The structure of samples in place, and the function that begins one; empty where there is none.
    placed: String,
    loan: String,
    /// The functions of a fake server that set its answer and return its calls, or of a fake subscriber
    /// that returns its samples.
    on: String,
    calls: String,
    samples: String,
}

/// The headers of a component's modules.
pub(crate) fn of(view: &view::Component) -> Vec<Header> {
    view.modules
        .iter()
        .map(|module| header(view, module))
        .collect()
}

fn header(view: &view::Component, module: &Module) -> Header {
    let constants = module.constants.iter().map(|constant| Constant {
        doc: constant.doc.clone(),
        ty: match resolved(&constant.ty) {
            Type::Primitive(name) => types::primitive(*name),
            Type::Text { .. }
            | Type::Named(_)
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. } => "std::string_view".to_owned(),
        },
        name: names::own(&constant.name),
        value: types::value(&constant.value),
    });
    let ends = |has: &dyn Fn(&view::Slot) -> bool| {
        let interfaces = module.interfaces.iter().filter(|interface| {
            let mut slots = view.slots.iter();
            slots.any(|slot| {
                has(slot) && slot.module == module.name && slot.interface == interface.name
            })
        });
        interfaces
            .map(|of| self::ends(view, of))
            .collect::<Vec<Ends>>()
    };
    let placed = in_place::all(view);
    let mut uses = BTreeSet::new();
    for decl in &module.types {
        uses.extend(named(decl).into_iter().map(|ty| ty.module.clone()));
    }
    for operation in module
        .interfaces
        .iter()
        .flat_map(|interface| &interface.operations)
    {
        let members = operation.inputs.iter().chain(&operation.outputs);
        let all = members.map(|member| &member.ty).chain(&operation.result);
        let all = all.chain(operation.throws.iter().map(|thrown| &thrown.ty));
        let names = all.flat_map(|ty| ty.names());
        uses.extend(names.map(|ty| ty.module.clone()));
    }
    uses.remove(&module.name);
    Header {
        name: names::own(&module.name),
        doc: module.doc.clone(),
        constants: constants.collect(),
        types: ordered(module)
            .into_iter()
            .map(|decl| type_decl(view, module, decl, &placed))
            .collect(),
        clients: ends(&|slot| slot.role == Role::Requires),
        publishers: ends(&|slot| slot.role == Role::Publishes),
        asynchronous: ends(&|slot| slot.asynchronous),
        samples: ends(&view::Slot::keeps_newest),
        results: ends(&view::Slot::serves_latest),
        imports: uses.iter().map(|name| names::own(name)).collect(),
    }
}

/// The named types in a declaration.
pub(super) fn named(decl: &library::TypeDecl) -> Vec<&Named> {
    match &decl.kind {
        Kind::Enum { .. } => Vec::new(),
        Kind::Struct { members } | Kind::Exception { members } => members
            .iter()
            .flat_map(|member| member.ty.names())
            .collect(),
        Kind::Alias { target } => target.names(),
    }
}

/// The types of a module, each after those that it contains.
fn ordered(module: &Module) -> Vec<&library::TypeDecl> {
    let mut done: Vec<&library::TypeDecl> = Vec::new();
    let mut left: Vec<&library::TypeDecl> = module.types.iter().collect();
    while !left.is_empty() {
        let (ready, waiting): (Vec<_>, Vec<_>) = left.iter().partition(|decl| {
            let mut needed = named(decl)
                .into_iter()
                .filter(|ty| ty.module == module.name);
            needed.all(|ty| done.iter().any(|other| other.name == ty.name))
        });
        if ready.is_empty() {
            // Types that contain each other were reported.
            done.extend(waiting);
            break;
        }
        // Only the first one, so that the order of the text stays where it can.
        done.push(ready[0]);
        left.retain(|decl| decl.name != ready[0].name);
    }
    done
}

fn type_decl(
    view: &view::Component,
    module: &Module,
    decl: &library::TypeDecl,
    in_place: &BTreeSet<(&str, &str)>,
) -> TypeDecl {
    let mut out = TypeDecl {
        name: names::own(&decl.name),
        scoped: format!("{}::{}", module.name, decl.name),
        doc: decl.doc.clone(),
        kind: "",
        enumerators: Vec::new(),
        members: Vec::new(),
        declaration: String::new(),
        target: String::new(),
        id: view::rpc_hash::of(&decl.name),
        placed: String::new(),
        places: Vec::new(),
    };
    let fields = |members: &[Member]| members.iter().map(|member| field(view, member)).collect();
    match &decl.kind {
        Kind::Enum { values } => {
            out.kind = "enum";
            out.enumerators = values
                .iter()
                .map(|value| Enumerator {
                    name: names::own(&value.name),
                    number: value.number,
                    doc: value.doc.clone(),
                })
                .collect();
        }
        Kind::Struct { members } => {
            out.kind = "struct";
            out.members = fields(members);
            if in_place.contains(&(&*module.name, &*decl.name)) {
                out.placed = in_place::name(view, &module.name, &decl.name);
                out.places = members
                    .iter()
                    .map(|member| in_place::field(view, member))
                    .collect();
            }
        }
        Kind::Exception { members } => {
            out.kind = "exception";
            out.members = fields(members);
        }
        Kind::Alias { target } => {
            out.kind = "alias";
            out.target = types::of(target);
        }
    }
    out.declaration = declaration(&out);
    out
}

fn declaration(of: &TypeDecl) -> String {
    if of.members.is_empty() {
        return format!("RC_EMPTY_STRUCT({})", of.name);
    }
    let members = of.members.iter().map(|member| member.name.as_str());
    let all: Vec<&str> = std::iter::once(of.name.as_str()).chain(members).collect();
    format!("RC_STRUCT({})", all.join(", "))
}

pub(super) fn field(view: &view::Component, member: &Member) -> Field {
    let default = match (&member.default, resolved(&member.ty)) {
        (Some(value), _) => types::value(value),
        _ if member.optional => String::new(),
        // Zero need not be the number of an enumerator.
        (
            None,
            Type::Named(Named {
                module, name, of, ..
            }),
        ) if *of == Declared::Enum => first(view, module, name).unwrap_or_default(),
        (None, Type::Array { element, length }) => match resolved(element) {
            Type::Named(Named {
                module, name, of, ..
            }) if *of == Declared::Enum => {
                let first = first(view, module, name).unwrap_or_default();
                format!("rc::filled<{length}>({first})")
            }
            Type::Primitive(_)
            | Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }
            | Type::Named(_) => String::new(),
        },
        (None, _) => String::new(),
    };
    Field {
        ty: types::of_member(member),
        name: names::own(&member.name),
        default: format!("{{{default}}}"),
        doc: documentation::of_member(member),
    }
}

/// The first enumerator of an enum.
fn first(view: &view::Component, module: &str, name: &str) -> Option<String> {
    let home = view.modules.iter().find(|other| other.name == module)?;
    let decl = home.types.iter().find(|decl| decl.name == name)?;
    let Kind::Enum { values } = &decl.kind else {
        return None;
    };
    let value = names::own(&values.first()?.name);
    Some(format!(
        "{}::{}::{value}",
        names::own(module),
        names::own(name)
    ))
}

pub(super) fn ends(view: &view::Component, interface: &library::Interface) -> Ends {
    let operations = interface.operations.iter().enumerate();
    let mut operations: Vec<Operation> = operations
        .map(|(index, of)| Operation {
            placed: in_place::sample(view, of).unwrap_or_default(),
            ..operation(index, of)
        })
        .collect();
    // Names of the IDSL stay.
    let own = operations.iter().flat_map(|of| [&of.name, &of.snake]);
    let mut taken: BTreeSet<String> = own.cloned().collect();
    let take = collisions::free("take".to_owned(), &mut taken);
    let mut fake = BTreeSet::new();
    for of in &mut operations {
        let bare = collisions::bare(&of.snake);
        of.start = collisions::free(format!("start_{bare}"), &mut taken);
        of.loan = collisions::free(format!("loan_{bare}"), &mut taken);
        of.on = collisions::free(format!("on_{bare}"), &mut fake);
        of.calls = collisions::free(format!("{bare}_calls"), &mut fake);
        of.samples = collisions::free(format!("{bare}_samples"), &mut fake);
    }
    let mut placed = operations.iter().filter(|of| !of.placed.is_empty());
    let loan = match (placed.next(), placed.next()) {
        (Some(only), None) if !taken.contains("loan") => only.loan.clone(),
        _ => String::new(),
    };
    Ends {
        interface: names::own(&interface.name),
        doc: interface.doc.clone(),
        operations,
        take,
        loan,
    }
}

fn operation(index: usize, of: &library::Operation) -> Operation {
    let listed = |all: Vec<String>| all.join(", ");
    let inputs = of
        .inputs
        .iter()
        .map(|member| format!("{} {}", types::input(member), names::own(&member.name)));
    let inputs = listed(inputs.collect());
    let forwarded = listed(
        of.inputs
            .iter()
            .map(|member| names::own(&member.name))
            .collect(),
    );
    let parts = of
        .outputs
        .iter()
        .map(types::of_member)
        .chain(of.result.as_ref().map(types::of));
    let parts: Vec<String> = parts.collect();
    let reply = match parts.as_slice() {
        [] => "void".to_owned(),
        [only] => only.clone(),
        many => format!("std::tuple<{}>", many.join(", ")),
    };
    let outs: Vec<String> = of
        .outputs
        .iter()
        .map(|member| names::own(&member.name))
        .collect();
    let out_parameters = of.outputs.iter().zip(&outs);
    let out_parameters =
        out_parameters.map(|(member, name)| format!("{}& {name}", types::of_member(member)));
    let mut parameters: Vec<String> = Vec::new();
    parameters.extend(Some(inputs.clone()).filter(|inputs| !inputs.is_empty()));
    parameters.extend(out_parameters);
    let snake = names::snake(&of.name);
    let call = format!("{snake}({forwarded})");
    let (result, body) = match (outs.as_slice(), &of.result) {
        ([], None) => ("void".to_owned(), format!("{call};")),
        ([], Some(result)) => (types::of(result), format!("return {call};")),
        ([only], None) => ("void".to_owned(), format!("{only} = {call};")),
        (many, None) => (
            "void".to_owned(),
            format!("std::tie({}) = {call};", many.join(", ")),
        ),
        (many, Some(result)) => {
            let result = types::of(result);
            // No parameter of the IDSL begins so.
            let body = format!(
                "{result} rc_result{{}};\n    std::tie({}, rc_result) = {call};\n    return rc_result;",
                many.join(", ")
            );
            (result, body)
        }
    };
    let throws = of
        .throws
        .iter()
        .map(|thrown| types::of(&thrown.ty))
        .collect::<Vec<_>>();
    let is_set = of.two_way && of.inputs.is_empty() && reply != "void";
    let (name, parameters) = (names::own(&of.name), parameters.join(", "));
    Operation {
        has_own_form: name != snake || parameters != inputs,
        sample: sample(of),
        set: if is_set { reply.clone() } else { String::new() },
        setter: format!("set_{}", collisions::bare(&snake)),
        two_way: of.two_way,
        start: String::new(),
        placed: String::new(),
        loan: String::new(),
        on: String::new(),
        calls: String::new(),
        samples: String::new(),
        index,
        name,
        doc: documentation::of_operation(of, names::own),
        arguments: of
            .inputs
            .iter()
            .map(|member| format!(", {}", names::own(&member.name)))
            .collect(),
        forwarded,
        inputs,
        result,
        parameters,
        body,
        throws: if throws.is_empty() {
            String::new()
        } else {
            format!(", rc::detail::Throws<{}>", throws.join(", "))
        },
        snake,
        reply,
    }
}

/// The exceptions of an operation as arguments of a template, or nothing.
pub(super) fn exceptions(of: &library::Operation) -> String {
    let throws = of
        .throws
        .iter()
        .map(|thrown| types::of(&thrown.ty))
        .collect::<Vec<_>>();
    if throws.is_empty() {
        String::new()
    } else {
        format!("<{}>", throws.join(", "))
    }
}

/// The type of a sample: of its only value, or a tuple.
pub(super) fn sample(of: &library::Operation) -> String {
    let types: Vec<String> = of.inputs.iter().map(types::of_member).collect();
    match types.as_slice() {
        [only] => only.clone(),
        many => format!("std::tuple<{}>", many.join(", ")),
    }
}

/// The return type of the handler of an operation, and its parameters.
pub(super) fn signature(
    view: &view::Component,
    slot: &view::Slot,
    of: &library::Operation,
) -> (String, String) {
    let operation = operation(0, of);
    let mut parameters = operation.parameters;
    if slot.role == Role::SubscribesTo
        && slot.in_place
        && let (Some(placed), Some(input)) = (in_place::sample(view, of), of.inputs.first())
    {
        parameters = format!("rc::View<{placed}> {}", names::own(&input.name));
    }
    (operation.result, with_member(slot, &of.inputs, parameters))
}

/// Parameters of a handler of a slot: those of an array begin with the member.
fn with_member(slot: &view::Slot, inputs: &[Member], parameters: String) -> String {
    if !slot.is_array {
        return parameters;
    }
    let mut taken = inputs.iter().map(|input| names::own(&input.name)).collect();
    let member = collisions::free("member".to_owned(), &mut taken);
    match parameters.as_str() {
        "" => format!("const rc::Member& {member}"),
        rest => format!("const rc::Member& {member}, {rest}"),
    }
}

/// The function that handles the end of a started call of an operation.
#[derive(Debug, Serialize)]
pub(super) struct Ended {
    pub(super) slot: usize,
    operation: usize,
    name: String,
    parameters: String,
    /// The arguments of `rc::ended`.
    types: String,
}

/// Those of a slot.
pub(super) fn ended(index: usize, slot: &view::Slot, of: &library::Interface) -> Vec<Ended> {
    let all = of.operations.iter().enumerate();
    let queries = all.filter(|(_, of)| of.two_way && slot.asynchronous);
    queries
        .map(|(number, of)| {
            let Operation { reply, throws, .. } = operation(number, of);
            let member = if slot.is_array {
                "const rc::Member& /*member*/, "
            } else {
                ""
            };
            let parameters = format!("{member}rc::CallId /*call*/, rc::Result<{reply}> /*result*/");
            let throws = match throws.as_str() {
                "" => ", rc::detail::Throws<>",
                some => some,
            };
            Ended {
                slot: index,
                operation: number,
                name: format!("{}_done", names::handler(&slot.name, &of.name)),
                parameters,
                types: format!("{reply}{throws}"),
            }
        })
        .collect()
}
