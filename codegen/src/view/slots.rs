//! The slots of a component: traits that the user implements, ends that the user calls.

use super::exports::{Exports, trait_name};
use super::interfaces::{answer_type, operation_doc, owned, tuple, what_comes_back};
use super::operation_names::{
    answer_name, error_name, exception_constant, operation_constant, variant,
};
use super::{in_place, types};
use crate::{layout, names, ros};
use rc_cdsl::Component;
use rc_cdsl::model::{Backend, Qos, Role};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{Operation, Type, TypeId};
use serde::Serialize;
use std::time::Duration;

/// The types of the operations of a slot in ROS 2.
fn foreign(library: &Library, slot: &rc_cdsl::model::Slot) -> Vec<String> {
    let name = |operation: &Operation| match slot.role.is_topic() {
        true => ros::names::topic_type(library, slot.interface, operation),
        false => ros::names::service_type(library, slot.interface, operation),
    };
    let operations = &library.interface(slot.interface).operations;
    let names = operations.iter().map(|o| format!("\"{}\"", name(o)));
    names.collect()
}

/// One slot.
#[derive(Debug, Serialize)]
pub struct Slot {
    /// Its name in the CDSL.
    pub name: String,
    /// Its number.
    pub index: usize,
    /// The constant that describes it.
    pub constant: String,
    /// The field of the context.
    pub field: String,
    /// The module of its code, where it receives.
    pub module: String,
    /// Its trait, where it receives.
    pub type_name: String,
    /// `Implements`, `Requires`, `Publishes`, `SubscribesTo`.
    pub role: String,
    /// The word of the CDSL.
    pub role_word: String,
    /// Whether the user implements a trait for it.
    pub receives: bool,
    /// Whether it calls or publishes.
    pub sends: bool,
    /// The interface's name in the IDSL.
    pub interface: String,
    /// The module of its interface's code.
    pub interface_module: String,
    /// The type of its sending end, with the module.
    pub end: String,
    /// `Module::Interface`
    pub path: String,
    /// Hash over all operations, sixteen hexadecimal digits.
    pub type_hash: String,
    /// The middleware, where the file chooses it; else empty.
    pub backend: String,
    /// The quality of service, as an expression.
    pub qos: Vec<String>,
    /// The constant of what its middleware calls the types of its operations, and its declaration.
    pub foreign: (String, String),
    /// Modules that its code uses.
    pub uses: Vec<String>,
    /// Its operations.
    pub operations: Vec<Handler>,
    /// The signature of the function that serves it.
    pub serve_signature: String,
    /// The arm that calls this function.
    pub serve_call: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Whether a handler answers.
    pub queries: bool,
}

/// One operation of a slot that receives.
#[derive(Debug, Serialize)]
pub struct Handler {
    /// Its name in Rust.
    pub method: String,
    /// The constant that describes it.
    pub constant: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// `fn …(&mut self, ctx: &mut Context, …) -> …;` of the trait.
    pub signature: String,
    /// The same for the user's file, with the types by their bare names and the brace.
    pub user_signature: String,
    /// What the user's handler does at first.
    pub user_body: Vec<String>,
    /// The signature of the function that answers one request.
    pub serve_signature: String,
    /// The statement that reads its parameters.
    pub open: String,
    /// The statement that calls the worker.
    pub call: String,
    /// The function that answers one request.
    pub function: String,
    /// The statement that calls the worker with a value of a topic.
    pub take_call: String,
    /// The statement that reads a value of a topic.
    pub take: String,
    /// Whether an answer comes back.
    pub two_way: bool,
    /// Whether the worker writes the answer in place.
    pub in_place: bool,
    /// The variants of its error and the constants of their hashes.
    pub throws: Vec<(String, String)>,
    /// The path of its error.
    pub error: String,
    /// Statements that take the answer apart.
    pub parts: String,
    /// Statements that write the answer.
    pub write: Vec<String>,
    /// Names of the generated crate that the user's handler mentions without their module.
    #[serde(skip)]
    pub mentioned: Vec<String>,
}

pub(super) fn of(
    component: &Component,
    middleware: Backend,
    exports: &Exports,
    found: &mut Diagnostics,
) -> Vec<Slot> {
    const OWN: [&str; 3] = ["core", "params", "deref"];
    let library = &component.library;
    let mut seen: Vec<(String, String)> = Vec::new();
    let mut slots = Vec::new();
    for (index, slot) in component.slots.iter().enumerate() {
        let view = one(library, index, slot, middleware, exports);
        let taken = seen
            .iter()
            .find(|(_, field)| *field == view.field)
            .map(|(name, _)| name.clone());
        if let Some(other) = taken {
            let message = format!(
                "slots `{other}` and `{}` are both `{}` in Rust",
                slot.name, view.field
            );
            let help = format!(
                "name one of them: `{} as other`",
                library.interface(slot.interface).name.text
            );
            found.push(Diagnostic::error("name-collision", slot.span, message).help(help));
        } else if OWN.contains(&view.field.as_str()) {
            let message = format!(
                "a slot cannot be called `{}`: generated code uses the name itself",
                slot.name
            );
            found.push(
                Diagnostic::error("name-collision", slot.span, message).help("name it with `as`"),
            );
        }
        seen.push((slot.name.clone(), view.field.clone()));
        slots.push(view);
    }
    slots
}

fn one(
    library: &Library,
    index: usize,
    slot: &rc_cdsl::model::Slot,
    middleware: Backend,
    exports: &Exports,
) -> Slot {
    let interface = library.interface(slot.interface);
    let module = super::interface_module(library, slot.interface);
    // An interface without operations is a connection, and nothing that anybody could handle or publish.
    let any = !interface.operations.is_empty();
    let receives = any && matches!(slot.role, Role::Implements | Role::SubscribesTo);
    let sends = slot.role == Role::Requires || (any && slot.role == Role::Publishes);
    let base = names::camel(&interface.name.text);
    let same = library
        .interfaces
        .iter()
        .filter(|i| names::camel(&i.name.text) == base)
        .count();
    let path = if same > 1 {
        format!("{module}::")
    } else {
        String::new()
    };
    let end = match slot.role {
        Role::Publishes => format!("{path}{base}Publisher"),
        _ => format!("{path}{base}Client"),
    };
    let field = names::snake(&slot.name);
    let type_name = trait_name(&slot.name);
    let operations: Vec<Handler> = interface
        .operations
        .iter()
        .map(|o| handler(library, slot, &module, &type_name, exports, o))
        .collect();
    let mut uses = super::interfaces::uses(library, &interface.operations);
    uses.retain(|path| {
        let module = format!("{}::", path.trim_start_matches("crate::types::"));
        operations.iter().any(|o| o.signature.contains(&module))
    });
    let in_place = |o| in_place(library, slot, o, super::two_way(slot.role, o));
    let foreign = match slot.backend.unwrap_or(middleware) {
        Backend::Ros2 => foreign(library, slot),
        _ => Vec::new(),
    };
    let types = format!("TYPES_{}", names::shout(&slot.name));
    let declared = layout::constant(&format!("pub(crate) const {types}: &[&str]"), &foreign);
    if slot.role == Role::Implements || !interface.operations.iter().all(|o| in_place(o).is_some())
    {
        uses.push(format!("crate::interfaces::{module}"));
    }
    uses.push("crate::context::Context".to_owned());
    uses.sort_by(|a, b| layout::order(a, b));
    let role = slot.role;
    let (last, function, arguments) = match role {
        Role::SubscribesTo => (
            vec![
                "operation: usize".to_owned(),
                "reader: &mut Reader<'_>".to_owned(),
            ],
            "receive",
            "operation, reader",
        ),
        _ => (
            vec!["request: &mut Request<'_>".to_owned()],
            "serve",
            "request",
        ),
    };
    let first = ["worker: &mut W".to_owned(), "ctx: &mut Context".to_owned()];
    let parameters: Vec<String> = first.into_iter().chain(last).collect();
    let head = format!("pub(crate) fn {function}<W: {type_name}>");
    let call: Vec<String> = ["&mut self.worker", "&mut self.ctx"]
        .into_iter()
        .chain(arguments.split(", "))
        .map(str::to_owned)
        .collect();
    Slot {
        constant: format!("SLOT_{}", names::shout(&slot.name)),
        serve_signature: layout::signature(0, &head, &parameters, " -> Result<(), HandlerError> {"),
        serve_call: layout::call(
            12,
            &format!("{index} => slots::{field}::{function}"),
            &call,
            ",",
        ),
        name: slot.name.clone(),
        index,
        module: field.clone(),
        field,
        type_name,
        role: format!("{role:?}"),
        role_word: role.word().to_owned(),
        receives,
        sends,
        interface: interface.name.text.clone(),
        interface_module: module,
        end,
        path: library.interface_path(slot.interface),
        type_hash: format!(
            "{:016x}",
            rc_idsl::canonical::interface_hash(library, slot.interface)
        ),
        backend: slot
            .backend
            .filter(|b| *b != middleware)
            .map(|b| b.word().to_owned())
            .unwrap_or_default(),
        qos: qos(role, &slot.qos),
        foreign: (types, declared),
        uses,
        doc: interface.doc.clone(),
        queries: operations.iter().any(|o| o.two_way),
        operations,
    }
}

/// The fields of `Qos` that differ from the default of the role.
fn qos(role: Role, qos: &Qos) -> Vec<String> {
    let base = match role {
        Role::Publishes => "Qos::PUBLISHER",
        Role::SubscribesTo => "Qos::SUBSCRIBER",
        Role::Implements | Role::Requires => "Qos::CALL",
    };
    let choose = |choice: bool, yes: &str, no: &str| {
        if choice {
            yes.to_owned()
        } else {
            no.to_owned()
        }
    };
    let mut fields = Vec::new();
    if let Some(reliable) = qos.reliable {
        fields.push(format!(
            "reliability: {},",
            choose(reliable, "Reliability::Reliable", "Reliability::BestEffort")
        ));
    }
    if let Some(local) = qos.transient_local {
        fields.push(format!(
            "durability: {},",
            choose(local, "Durability::TransientLocal", "Durability::Volatile")
        ));
    }
    if let Some(depth) = qos.depth {
        fields.push(format!("depth: {depth},"));
    }
    let time =
        |time: Duration| format!("Duration::new({}, {})", time.as_secs(), time.subsec_nanos());
    for (name, limit) in [
        ("deadline", qos.deadline),
        ("lifespan", qos.lifespan),
        ("liveliness", qos.liveliness),
    ] {
        fields.extend(limit.map(|limit| format!("{name}: Some({}),", time(limit))));
    }
    fields.extend(
        qos.timeout
            .map(|limit| format!("timeout: {},", time(limit))),
    );
    fields.extend(qos.spin.map(|limit| format!("spin: {},", time(limit))));
    if fields.is_empty() {
        return vec![base.to_owned()];
    }
    let mut lines = vec!["Qos {".to_owned()];
    lines.extend(fields.into_iter().map(|field| format!("    {field}")));
    lines.push(format!("    ..{base}"));
    lines.push("}".to_owned());
    lines
}

/// What the user's handler mentions; `result` is the type of its answer, as it is written there, `in_place` what comes
/// or goes in place.
fn mentioned(
    library: &Library,
    exports: &Exports,
    operation: &Operation,
    result: &str,
    in_place: Option<TypeId>,
    two_way: bool,
) -> Vec<String> {
    let comes = in_place.is_some() && !two_way;
    let mut names = Vec::new();
    names.extend(in_place.map(|id| in_place::name(library, id)));
    if !comes {
        let inputs = operation.inputs.iter().map(|m| &m.ty);
        inputs.for_each(|ty| named(library, ty, &mut names));
    }
    let alias = answer_name(operation);
    if result == alias {
        names.push(alias);
    } else if in_place.is_none() {
        let outputs = operation.outputs.iter().map(|m| &m.ty);
        let outputs = outputs.chain(&operation.result);
        outputs.for_each(|ty| named(library, ty, &mut names));
    }
    if !operation.throws.is_empty() {
        names.push(error_name(operation));
    }
    names.retain(|name| exports.is_unique(name));
    names
}

fn named(library: &Library, ty: &Type, out: &mut Vec<String>) {
    let named = ty.named().into_iter();
    out.extend(named.map(|id| names::ty(&library.ty(id).name.text)));
}

/// A type by its bare name, as the user's file has it.
fn bare(library: &Library, exports: &Exports, ty: &Type) -> String {
    types::rust_with(ty, &|id| exports.ty(library, id))
}

fn handler(
    library: &Library,
    slot: &rc_cdsl::model::Slot,
    module: &str,
    type_name: &str,
    exports: &Exports,
    operation: &Operation,
) -> Handler {
    let method = names::method(&operation.name.text);
    let plain = names::shout(&operation.name.text).to_lowercase();
    let function = format!("answer_{plain}");
    let constant = format!("{module}::{}", operation_constant(operation));
    let two_way = super::two_way(slot.role, operation);
    let throws = !operation.throws.is_empty();
    let error = format!("{module}::{}", error_name(operation));
    let in_place = in_place(library, slot, operation, two_way);
    // A value of a topic comes in place, or the answer goes so.
    let comes = in_place.filter(|_| !two_way);
    let goes = in_place.filter(|_| two_way);
    let result = what_comes_back(operation).pop().map(|(name, _)| name);
    let result = result.filter(|_| goes.is_some()).map(|mut name| {
        // A parameter may have this name, too.
        let mut inputs = operation.inputs.iter();
        if inputs.any(|m| names::local(&m.name.text) == name) {
            name.push('_');
        }
        name
    });
    let params = |ty: &dyn Fn(&rc_idsl::model::Member) -> String, placed: &str| -> Vec<String> {
        let own = ["&mut self".to_owned(), "ctx: &mut Context".to_owned()];
        let rest = operation.inputs.iter().map(|m| {
            let name = names::local(&m.name.text);
            if comes.is_some() {
                format!("{name}: &{placed}")
            } else {
                format!("{name}: {}", ty(m))
            }
        });
        let result = result.iter().map(|name| format!("{name}: &mut {placed}"));
        own.into_iter().chain(rest).chain(result).collect()
    };
    let returns = |result: String, error: String| match (two_way, throws) {
        (true, true) => format!(" -> Result<{result}, {error}>"),
        (true, false) if result != "()" => format!(" -> {result}"),
        _ => String::new(),
    };
    let names: Vec<String> = operation
        .inputs
        .iter()
        .map(|m| names::local(&m.name.text))
        .collect();
    let borrow = if comes.is_some() { "&" } else { "" };
    let worker_args: Vec<String> = std::iter::once("ctx".to_owned())
        .chain(names.iter().map(|name| format!("{borrow}{name}")))
        .chain(result.clone())
        .collect();
    let bare_result: Vec<String> = operation
        .result
        .iter()
        .map(|ty| bare(library, exports, ty))
        .chain(operation.outputs.iter().map(|m| {
            let ty = bare(library, exports, &m.ty);
            if m.optional {
                format!("Option<{ty}>")
            } else {
                ty
            }
        }))
        .collect();
    let bare_result = if goes.is_some() {
        Vec::new()
    } else {
        bare_result
    };
    let bare_tuple = tuple(&bare_result);
    // rustfmt breaks a tuple that is longer than a call may be; the type has a name for that.
    let user_result = if bare_result.len() > 1 && bare_tuple.len() > 62 {
        exports.of_interface(module, &answer_name(operation))
    } else {
        bare_tuple
    };
    let mentioned = mentioned(library, exports, operation, &user_result, in_place, two_way);
    let user_returns = returns(
        user_result,
        exports.of_interface(module, &error_name(operation)),
    );
    let bound = |indent: usize, head: &str, args: &[String]| match names.as_slice() {
        [] => layout::call(indent, head, args, "?;"),
        many => layout::binding(indent, many, head, args, "?;"),
    };
    let read = format!("{module}::read_{plain}");
    let answers = two_way && (throws || !bare_result.is_empty());
    let mut parts: Vec<String> = Vec::new();
    let mut write = Vec::new();
    if goes.is_none() {
        if operation.result.is_some() {
            parts.push("result".to_owned());
        }
        parts.extend(operation.outputs.iter().map(|m| names::local(&m.name.text)));
        write = write_answer(library, operation, module);
    }
    if two_way && write.is_empty() {
        write.push("writer.put(&0_u8);".to_owned());
    }
    let trait_result = match goes {
        Some(_) => "()".to_owned(),
        None => answer_type(library, operation, &format!("{module}::")),
    };
    let trait_returns = returns(trait_result, error.clone());
    let placed = in_place
        .map(|id| in_place::path(library, id))
        .unwrap_or_default();
    let bare_placed = in_place
        .map(|id| exports.in_place(library, id))
        .unwrap_or_default();
    let mut user_names = names.clone();
    user_names.extend(result.clone());
    let call = if let Some(result) = &result {
        answer_in_place(result, &placed, &method, &worker_args, throws)
    } else if answers {
        let answer = ["answer".to_owned()];
        layout::binding(4, &answer, &format!("worker.{method}"), &worker_args, ";")
    } else {
        layout::call(4, &format!("worker.{method}"), &worker_args, ";")
    };
    let take = match comes {
        Some(_) => layout::binding(
            12,
            &names,
            &format!("reader.in_place::<{placed}>"),
            &[],
            "?;",
        ),
        None => bound(12, &read, &["reader".to_owned()]),
    };
    Handler {
        doc: super::doc(&operation_doc(operation), None, None),
        signature: layout::signature(
            4,
            &format!("fn {method}"),
            &params(&|m| owned(library, m), &placed),
            &format!("{trait_returns};"),
        ),
        user_signature: layout::signature(
            4,
            &format!("fn {method}"),
            &params(
                &|m| {
                    let ty = bare(library, exports, &m.ty);
                    if m.optional {
                        format!("Option<{ty}>")
                    } else {
                        ty
                    }
                },
                &bare_placed,
            ),
            &format!("{user_returns} {{"),
        ),
        user_body: user_body(&user_names, two_way, throws, &bare_result),
        serve_signature: layout::signature(
            0,
            &format!("fn {function}<W: {type_name}>"),
            &[
                "worker: &mut W".to_owned(),
                "ctx: &mut Context".to_owned(),
                "request: &mut Request<'_>".to_owned(),
            ],
            " -> Result<(), HandlerError> {",
        ),
        open: bound(
            4,
            "request.arguments",
            &[format!("&{constant}"), read.clone()],
        ),
        call,
        in_place: goes.is_some(),
        take_call: layout::call(12, &format!("worker.{method}"), &worker_args, ";"),
        take,
        two_way,
        throws: operation
            .throws
            .iter()
            .map(|t| {
                let name = &library.ty(*t).name.text;
                let interface = library.interface(slot.interface);
                (
                    format!("{error}::{}", variant(name)),
                    format!("{module}::{}", exception_constant(interface, name)),
                )
            })
            .collect(),
        error,
        parts: if parts.is_empty() || !two_way {
            String::new()
        } else {
            format!("let {} = answer;", tuple(&parts))
        },
        write,
        mentioned,
        constant,
        function,
        method,
    }
}

/// The structure in which a slot with `in_place true` gets its value or gives its answer.
pub(super) fn in_place(
    library: &Library,
    slot: &rc_cdsl::model::Slot,
    operation: &Operation,
    two_way: bool,
) -> Option<TypeId> {
    match slot.role {
        _ if !slot.qos.in_place => None,
        Role::SubscribesTo => operation.topic_in_place(library),
        _ if two_way => operation.result_in_place(library),
        _ => None,
    }
}

/// The statement that lets the worker write its answer in place.
fn answer_in_place(
    result: &str,
    placed: &str,
    method: &str,
    args: &[String],
    throws: bool,
) -> String {
    let (binding, end) = if throws {
        ("let answer = ", "")
    } else {
        ("", ";")
    };
    let call = layout::call(8, &format!("worker.{method}"), args, end);
    format!(
        "{binding}request.in_place(|{result}| {{\n        let {result}: &mut {placed} = {result};\n        {call}\n    }})?;"
    )
}

fn write_answer(library: &Library, operation: &Operation, module: &str) -> Vec<String> {
    let mut lines = Vec::new();
    for (name, member) in what_comes_back(operation) {
        let what = format!("{module}.{}.{}", operation.name.text, member.name.text);
        lines.extend(super::checks::lines_at(
            library,
            &member,
            &what,
            &name,
            super::checks::Side::Write,
            4,
        ));
        lines.push(format!("writer.put(&{name});"));
    }
    lines
}

/// What a handler does before its user has written it: nothing, and the default answer.
fn user_body(names: &[String], two_way: bool, throws: bool, result: &[String]) -> Vec<String> {
    let mut unused = vec!["ctx".to_owned()];
    unused.extend(names.iter().cloned());
    // As many in one tuple as rustfmt leaves on one line.
    let mut tuples: Vec<Vec<String>> = vec![Vec::new()];
    for name in unused {
        let width = |names: &[String]| names.iter().map(|n| n.len() + 2).sum::<usize>();
        match tuples.last_mut() {
            Some(last) if last.is_empty() || width(last) + name.len() <= 58 => last.push(name),
            _ => tuples.push(vec![name]),
        }
    }
    let mut lines: Vec<String> = tuples
        .iter()
        .map(|names| format!("let _ = {};", tuple(names)))
        .collect();
    if two_way {
        match (result, throws) {
            ([], true) => lines.push("Ok(())".to_owned()),
            ([], false) => {}
            (_, true) => lines.push("Ok(Default::default())".to_owned()),
            (_, false) => lines.push("Default::default()".to_owned()),
        }
    }
    lines
}
