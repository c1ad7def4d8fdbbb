//! The code of an interface that all slots of it share: its operations, its sending end, its errors.

use super::operation_names::{
    answer_name, error_name, exception_constant, operation_constant, variant,
};
use super::{checks, in_place, types};
use crate::{layout, names};
use rc_cdsl::Component;
use rc_cdsl::model::Role;
use rc_diagnostics::Diagnostics;
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, Member, ModuleId, Operation, Type, TypeDeclKind, TypeId};
use rc_syntax::Name;
use serde::Serialize;

/// One interface: one file.
#[derive(Debug, Serialize)]
pub struct Interface {
    /// The module of Rust.
    pub module: String,
    /// Its name in the IDSL.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Whether a slot requires it.
    pub required: bool,
    /// Whether a slot publishes it.
    pub published: bool,
    /// Whether a slot implements or subscribes to it.
    pub received: bool,
    /// Modules of types that it uses.
    pub uses: Vec<String>,
    /// The name of the calling end.
    pub client: String,
    /// The name of the publishing end.
    pub publisher: String,
    /// Its operations.
    pub operations: Vec<OperationView>,
    /// The exceptions that its operations throw: constant and hash.
    pub exceptions: Vec<(String, i32)>,
    /// Whether an operation throws.
    pub throws: bool,
    /// What it imports of the runtime, in rustfmt's order.
    pub runtime_uses: Vec<String>,
    /// Whether the user sees anything of it.
    pub exports: bool,
    /// The constant with its operations.
    pub all: String,
}

/// One operation.
#[derive(Debug, Serialize)]
pub struct OperationView {
    /// Its name in Rust.
    pub method: String,
    /// Its name in the IDSL.
    pub name: String,
    /// The constant that describes it.
    pub constant: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The hash of its name.
    pub id: i32,
    /// The hash of its types, sixteen hexadecimal digits.
    pub type_hash: String,
    /// Whether an answer comes back.
    pub two_way: bool,
    /// What an answer may be, where it throws: an array.
    pub answers: String,
    /// `pub fn …(&mut self, …) -> … {` of the calling end.
    pub call_signature: String,
    /// `pub fn …(&mut self, …) -> … {` of the publishing end.
    pub publish_signature: String,
    /// Statements that write its parameters.
    pub write: Vec<String>,
    /// `fn read_…(reader) -> … {`
    pub read_signature: String,
    /// The name of the function that reads its parameters.
    pub read_function: String,
    /// Whether a handler needs this function.
    pub is_read: bool,
    /// Statements that read its parameters.
    pub read: Vec<String>,
    /// The expression of all parameters, `(a, b)`.
    pub read_value: String,
    /// Statements that read its answer.
    pub read_answer: Vec<String>,
    /// The expression of its answer.
    pub answer_value: String,
    /// The name of its error type; empty where it does not throw.
    pub error: String,
    /// `pub type …Answer = (…);` where several values come back; else empty.
    pub answer_alias: String,
    /// Its exceptions.
    pub throws: Vec<ExceptionView>,
    /// `pub fn loan_…(&mut self) -> … {` of the publishing end, where a value can be written in place; else empty.
    pub loan_signature: String,
    /// `pub fn …_in_place(&mut self, …) -> … {` of the calling end, where the answer can be read in place; else empty.
    pub in_place_signature: String,
    /// The expression that reads it.
    pub in_place_answer: String,
}

/// An exception of an operation.
#[derive(Debug, Serialize)]
pub struct ExceptionView {
    /// The variant of the error.
    pub name: String,
    /// Its type.
    pub path: String,
    /// The constant of its hash.
    pub constant: String,
}

pub(super) fn of(component: &Component, found: &mut Diagnostics) -> Vec<Interface> {
    let mut ids: Vec<InterfaceId> = component.slots.iter().map(|s| s.interface).collect();
    ids.sort();
    ids.dedup();
    let mut all: Vec<Interface> = ids
        .into_iter()
        .map(|id| interface(component, id, found))
        .collect();
    all.sort_by(|a, b| a.module.cmp(&b.module));
    all
}

fn interface(component: &Component, id: InterfaceId, found: &mut Diagnostics) -> Interface {
    let library = &component.library;
    let interface = library.interface(id);
    let used = |role: Role| {
        component
            .slots
            .iter()
            .any(|s| s.interface == id && s.role == role)
    };
    let role = if used(Role::Publishes) || used(Role::SubscribesTo) {
        Role::Publishes
    } else {
        Role::Requires
    };
    let methods = interface.operations.iter().flat_map(|o| {
        let method = names::method(&o.name.text);
        let loan = o.topic_in_place(library).filter(|_| used(Role::Publishes));
        let in_place = o.result_in_place(library).filter(|_| used(Role::Requires));
        let more = [
            loan.map(|_| format!("loan_{}", bare(&method))),
            in_place.map(|_| format!("{}_in_place", bare(&method))),
        ];
        let all = std::iter::once(method).chain(more.into_iter().flatten());
        all.map(|method| (&o.name, method)).collect::<Vec<_>>()
    });
    super::collisions(methods, "operations", found);
    let operations: Vec<OperationView> = interface
        .operations
        .iter()
        .map(|o| OperationView {
            is_read: is_read(component, id, o),
            ..operation(library, id, o, role, found)
        })
        .collect();
    let mut exceptions: Vec<(String, i32)> = interface
        .operations
        .iter()
        .flat_map(|o| &o.throws)
        .map(|t| {
            (
                exception_constant(interface, &library.ty(*t).name.text),
                super::rpc_hash(&library.ty(*t).name.text),
            )
        })
        .collect();
    exceptions.sort();
    exceptions.dedup();
    let name = names::camel(&interface.name.text);
    let any = !operations.is_empty();
    let required = used(Role::Requires);
    let published = any && used(Role::Publishes);
    let received = any && (used(Role::Implements) || used(Role::SubscribesTo));
    let throws = operations.iter().any(|o| !o.throws.is_empty());
    let queries = operations.iter().any(|o| o.two_way);
    let by_reference = operations
        .iter()
        .any(|o| o.write.iter().any(|line| line.starts_with("cdr::")));
    let read = operations.iter().any(|o| o.is_read);
    let loans = published && operations.iter().any(|o| !o.loan_signature.is_empty());
    let listed = |wanted: &[(&'static str, bool)]| -> Vec<&'static str> {
        wanted
            .iter()
            .filter(|(_, used)| *used)
            .map(|(name, _)| *name)
            .collect()
    };
    let typed = listed(&[
        ("Operation", true),
        ("ReplyVariant", throws),
        ("TypedClient", required),
        ("TypedPublisher", published),
        ("expect_result", required && queries),
    ]);
    let middleware = listed(&[
        ("CallError", (required && any) || throws),
        ("DecodeError", read || (required && throws)),
        ("OpenError", published),
        ("Reader", read),
        ("SendError", published),
        ("in_place", loans),
        ("cdr", (required || published) && by_reference),
    ]);
    let runtime_uses = runtime_uses(&typed, &middleware, published);
    Interface {
        module: super::interface_module(library, id),
        name: interface.name.text.clone(),
        doc: interface.doc.clone(),
        required,
        published,
        received,
        uses: uses(library, &interface.operations)
            .into_iter()
            .filter(|path| mentions(&operations, path, required, published, received))
            .collect(),
        client: format!("{name}Client"),
        publisher: format!("{name}Publisher"),
        runtime_uses,
        exports: required
            || published
            || throws
            || operations.iter().any(|o| !o.answer_alias.is_empty()),
        all: layout::constant(
            "pub(crate) const OPERATIONS: &[Operation]",
            &operations
                .iter()
                .map(|o| o.constant.clone())
                .collect::<Vec<_>>(),
        ),
        throws,
        operations,
        exceptions,
    }
}

/// Whether a handler takes the parameters of an operation one by one, and not in place.
fn is_read(component: &Component, id: InterfaceId, operation: &Operation) -> bool {
    let library = &component.library;
    component
        .slots
        .iter()
        .filter(|s| s.interface == id)
        .any(|slot| match slot.role {
            Role::Implements => true,
            Role::SubscribesTo => super::slots::in_place(library, slot, operation, false).is_none(),
            Role::Requires | Role::Publishes => false,
        })
}

/// The imports of the runtime: a list in braces stands after longer paths, a single name before them.
fn runtime_uses(typed: &[&str], middleware: &[&str], published: bool) -> Vec<String> {
    let single = middleware.len() == 1;
    let mut uses = Vec::new();
    if published {
        uses.push("Ports".to_owned());
    }
    let typed = format!("middleware::typed::{}", braced(typed));
    let middleware = Some(braced(middleware)).filter(|names| !names.is_empty());
    let middleware = middleware.map(|names| format!("middleware::{names}"));
    if single {
        uses.extend(middleware.into_iter().chain([typed]));
    } else {
        uses.extend([typed].into_iter().chain(middleware));
    }
    uses
}

/// The names of one `use`, as rustfmt has them.
fn braced(names: &[&str]) -> String {
    match names {
        [one] => (*one).to_owned(),
        [] => String::new(),
        many => format!("{{{}}}", many.join(", ")),
    }
}

/// Whether what is printed for an interface mentions a module of types.
fn mentions(
    operations: &[OperationView],
    path: &str,
    required: bool,
    published: bool,
    received: bool,
) -> bool {
    let module = format!("{}::", path.trim_start_matches("crate::types::"));
    operations.iter().any(|operation| {
        let mut texts: Vec<&str> = operation.throws.iter().map(|t| t.path.as_str()).collect();
        texts.push(&operation.answers);
        texts.push(&operation.answer_alias);
        if required {
            texts.push(&operation.call_signature);
            texts.push(&operation.in_place_signature);
            texts.extend(operation.read_answer.iter().map(String::as_str));
        }
        if published {
            texts.push(&operation.publish_signature);
            texts.push(&operation.loan_signature);
        }
        if received && operation.is_read {
            texts.push(&operation.read_signature);
            texts.extend(operation.read.iter().map(String::as_str));
        }
        texts.iter().any(|text| text.contains(&module))
    })
}

/// The modules of types that stand in signatures, as paths.
pub(super) fn uses(library: &Library, operations: &[Operation]) -> Vec<String> {
    let mut modules: Vec<ModuleId> = Vec::new();
    for operation in operations {
        let members = operation
            .inputs
            .iter()
            .chain(&operation.outputs)
            .map(|m| &m.ty);
        members
            .chain(&operation.result)
            .flat_map(Type::named)
            .for_each(|id| modules.push(library.ty(id).module));
        modules.extend(operation.throws.iter().map(|t| library.ty(*t).module));
    }
    let mut uses: Vec<String> = modules
        .iter()
        .map(|m| format!("crate::types::{}", super::type_module(library, *m)))
        .collect();
    uses.sort_by(|a, b| layout::order(a, b));
    uses.dedup();
    uses
}

/// A type outside of its own module: with its module's name.
pub(super) fn outside(library: &Library, ty: &Type) -> String {
    types::rust_with(ty, &|id| path(library, id))
}

pub(super) fn path(library: &Library, id: TypeId) -> String {
    let decl = library.ty(id);
    format!(
        "{}::{}",
        super::type_module(library, decl.module),
        names::ty(&decl.name.text)
    )
}

pub(super) fn owned(library: &Library, member: &Member) -> String {
    let ty = outside(library, &member.ty);
    if member.optional {
        format!("Option<{ty}>")
    } else {
        ty
    }
}

/// How a parameter is taken by the sending end: small values as they are, the rest by reference.
fn borrowed(library: &Library, member: &Member) -> String {
    if member.optional {
        return format!("&{}", owned(library, member));
    }
    match library.resolved(&member.ty) {
        Type::Primitive(_) => outside(library, &member.ty),
        Type::String(_) => "&str".to_owned(),
        Type::Sequence(element, _) => format!("&[{}]", outside(library, element)),
        Type::Named(id) if matches!(library.ty(*id).kind, TypeDeclKind::Enum(_)) => {
            outside(library, &member.ty)
        }
        _ => format!("&{}", outside(library, &member.ty)),
    }
}

/// The statement that writes a parameter that was taken so.
fn write(library: &Library, member: &Member) -> String {
    let name = names::local(&member.name.text);
    if member.optional {
        return format!("writer.put({name});");
    }
    match library.resolved(&member.ty) {
        Type::Primitive(_) => format!("writer.put(&{name});"),
        Type::String(_) => format!("cdr::text({name}, writer);"),
        Type::Sequence(..) => format!("cdr::sequence({name}, writer);"),
        Type::Named(id) if matches!(library.ty(*id).kind, TypeDeclKind::Enum(_)) => {
            format!("writer.put(&{name});")
        }
        _ => format!("writer.put({name});"),
    }
}

/// The types of what an operation returns: its value, then its `out` parameters.
fn results(library: &Library, operation: &Operation) -> Vec<String> {
    let result = operation.result.iter().map(|ty| outside(library, ty));
    let outputs = operation.outputs.iter().map(|m| owned(library, m));
    result.chain(outputs).collect()
}

/// The type of what an operation returns; several values are one tuple, which has a name of its own in the
/// interface's module, `prefix`.
pub(super) fn answer_type(library: &Library, operation: &Operation, prefix: &str) -> String {
    match results(library, operation).as_slice() {
        [] => "()".to_owned(),
        [one] => one.clone(),
        _ => format!("{prefix}{}", answer_name(operation)),
    }
}

fn answer_alias(library: &Library, operation: &Operation) -> String {
    let results = results(library, operation);
    if results.len() < 2 {
        return String::new();
    }
    layout::tuple_alias(&format!("pub type {}", answer_name(operation)), &results)
}

pub(super) fn tuple(parts: &[String]) -> String {
    match parts {
        [one] => one.clone(),
        all => format!("({})", all.join(", ")),
    }
}

/// The same, as rustfmt breaks it inside of a call or behind `let`.
pub(super) fn tuple_at(indent: usize, parts: &[String]) -> String {
    match parts {
        [one] => one.clone(),
        all => layout::call(indent, "", all, ""),
    }
}

/// What an operation answers, in the order of the wire, with the names of its variables: the `out` parameters,
/// then the value.
pub(super) fn what_comes_back(operation: &Operation) -> Vec<(String, Member)> {
    let mut members = with_names(&operation.outputs);
    let value = operation.result.iter().map(|ty| Member {
        name: Name::new("result", operation.name.span),
        doc: Vec::new(),
        ty: ty.clone(),
        optional: false,
        unit: None,
        range: None,
        default: None,
    });
    members.extend(value.map(|member| ("result".to_owned(), member)));
    members
}

/// A name as a part of a longer one.
pub(super) fn bare(name: &str) -> &str {
    name.trim_end_matches('_')
}

fn with_names(members: &[Member]) -> Vec<(String, Member)> {
    let members = members.iter();
    members
        .map(|m| (names::local(&m.name.text), m.clone()))
        .collect()
}

/// The statements that read members one after the other; the second part names the variables. A single one may have
/// been sent `in_place`.
fn read(
    library: &Library,
    interface: &str,
    members: &[(String, Member)],
    in_place: Option<TypeId>,
    indent: usize,
) -> (Vec<String>, Vec<String>) {
    let (mut lines, mut names) = (Vec::new(), Vec::new());
    for (name, member) in members {
        match in_place.map(|id| in_place::path(library, id)) {
            Some(path) => {
                let head = format!("reader.value::<{path}>");
                let names = std::slice::from_ref(name);
                let text = layout::binding(indent, names, &head, &[], "?;");
                lines.extend(text.lines().map(|line| {
                    let pad = " ".repeat(indent);
                    line.strip_prefix(&pad).unwrap_or(line).to_owned()
                }));
            }
            None => lines.push(format!(
                "let {name}: {} = reader.get()?;",
                owned(library, member)
            )),
        }
        let what = format!("{interface}.{}", member.name.text);
        lines.extend(checks::lines_at(
            library,
            member,
            &what,
            name,
            checks::Side::Read,
            indent,
        ));
        names.push(name.clone());
    }
    (lines, names)
}

fn operation(
    library: &Library,
    id: InterfaceId,
    operation: &Operation,
    role: Role,
    found: &mut Diagnostics,
) -> OperationView {
    let interface = library.interface(id).name.text.as_str();
    let params = operation.inputs.iter().chain(&operation.outputs);
    super::collisions(
        params.map(|m| (&m.name, names::local(&m.name.text))),
        "parameters",
        found,
    );
    let method = names::method(&operation.name.text);
    super::collisions(
        operation
            .throws
            .iter()
            .map(|t| (&library.ty(*t).name, variant(&library.ty(*t).name.text))),
        "exceptions",
        found,
    );
    let what = format!("{interface}.{}", operation.name.text);
    let two_way = super::two_way(role, operation);
    let args = |first: &str| -> Vec<String> {
        let rest = operation.inputs.iter();
        let rest =
            rest.map(|m| format!("{}: {}", names::local(&m.name.text), borrowed(library, m)));
        std::iter::once(first.to_owned()).chain(rest).collect()
    };
    let error = if operation.throws.is_empty() {
        String::new()
    } else {
        error_name(operation)
    };
    let result = answer_type(library, operation, "");
    let call_error = if error.is_empty() {
        "CallError"
    } else {
        &error
    };
    let head = format!("pub fn {method}");
    let mut statements = Vec::new();
    for member in &operation.inputs {
        let name = names::local(&member.name.text);
        let lines = checks::lines(
            library,
            member,
            &format!("{what}.{}", member.name.text),
            &name,
            checks::Side::Write,
        );
        // What is taken by reference needs no other one.
        statements.extend(lines.into_iter().map(|line| {
            line.replace("for item in &", "for item in ")
                .replace("if let Some(item) = &", "if let Some(item) = ")
        }));
        statements.push(write(library, member));
    }
    if statements.is_empty() {
        statements.push("writer.put(&0_u8);".to_owned());
    }
    // An answer in place is for a call, a parameter in place for a topic.
    let topic = operation
        .topic_in_place(library)
        .filter(|_| role.is_topic());
    let result_in_place = operation.result_in_place(library).filter(|_| two_way);
    let inputs = with_names(&operation.inputs);
    let (mut read_lines, names) = read(library, &what, &inputs, topic, 4);
    if names.is_empty() {
        read_lines.push("reader.get::<u8>()?;".to_owned());
    }
    let (mut answer_lines, mut outs) = read(
        library,
        &what,
        &what_comes_back(operation),
        result_in_place,
        8,
    );
    if operation.result.is_some() {
        outs.rotate_right(1);
    }
    if outs.is_empty() && operation.throws.is_empty() {
        answer_lines.push("reader.get::<u8>()?;".to_owned());
    }
    let inputs: Vec<String> = operation.inputs.iter().map(|m| owned(library, m)).collect();
    let read_function = format!("read_{}", names::shout(&operation.name.text).to_lowercase());
    let in_place_path = |id: Option<TypeId>| id.map(|id| in_place::path(library, id));
    let in_place_signature = in_place_path(result_in_place).map(|path| {
        let mut args = args("&mut self");
        args.push(format!("read: impl FnOnce(&{path}) -> T"));
        let returns = format!(" -> Result<T, {call_error}> {{");
        layout::signature(
            4,
            &format!("pub fn {}_in_place<T>", bare(&method)),
            &args,
            &returns,
        )
    });
    let loan_signature = in_place_path(topic).map(|path| {
        let returns = format!(" -> Result<in_place::Loan<'_, {path}>, SendError> {{");
        let head = format!("pub fn loan_{}", bare(&method));
        layout::signature(4, &head, &["&mut self".to_owned()], &returns)
    });
    let answer = ["answer".to_owned()];
    let in_place_answer = in_place_path(result_in_place).map(|path| {
        layout::binding(
            12,
            &answer,
            &format!("reader.in_place::<{path}>"),
            &[],
            "?;",
        )
    });
    OperationView {
        loan_signature: loan_signature.unwrap_or_default(),
        in_place_signature: in_place_signature.unwrap_or_default(),
        in_place_answer: in_place_answer.unwrap_or_default(),
        name: operation.name.text.clone(),
        constant: operation_constant(operation),
        doc: super::doc(&operation_doc(operation), None, None),
        id: super::rpc_hash(&operation.name.text),
        type_hash: format!(
            "{:016x}",
            rc_idsl::canonical::operation_hash(library, id, operation)
        ),
        two_way,
        answers: answers(library, id, operation),
        call_signature: layout::signature(
            4,
            &head,
            &args("&mut self"),
            &format!(" -> Result<{result}, {call_error}> {{"),
        ),
        publish_signature: layout::signature(
            4,
            &head,
            &args("&mut self"),
            " -> Result<(), SendError> {",
        ),
        write: statements,
        read_signature: layout::tuple_result(
            &format!("pub(crate) fn {read_function}"),
            "reader: &mut Reader<'_>",
            &inputs,
            "DecodeError",
        ),
        read_function,
        is_read: true,
        read: read_lines,
        read_value: tuple_at(4, &names),
        answer_alias: answer_alias(library, operation),
        read_answer: answer_lines,
        answer_value: tuple_at(8, &outs),
        throws: operation
            .throws
            .iter()
            .map(|t| ExceptionView {
                name: variant(&library.ty(*t).name.text),
                path: path(library, *t),
                constant: exception_constant(library.interface(id), &library.ty(*t).name.text),
            })
            .collect(),
        method,
        error,
    }
}

/// What an answer of an operation that throws may be, as an array.
fn answers(library: &Library, id: InterfaceId, operation: &Operation) -> String {
    let of = |ty: &str, case: String| {
        let head = format!("ReplyVariant::of::<{ty}>");
        let item = layout::call(8, &head, &[case], ",");
        item.trim_end_matches(',').to_owned()
    };
    let mut lines = Vec::new();
    for thrown in &operation.throws {
        let name = &library.ty(*thrown).name.text;
        let constant = exception_constant(library.interface(id), name);
        lines.push(of(&path(library, *thrown), constant));
    }
    if !lines.is_empty() {
        let results = what_comes_back(operation);
        let results = results.iter().map(|(_, member)| owned(library, member));
        lines.extend(results.map(|ty| of(&ty, "0".to_owned())));
    }
    layout::array_in(4, &lines)
}

/// The documentation of an operation with the units and ranges of its parameters.
pub(super) fn operation_doc(operation: &Operation) -> Vec<String> {
    let mut doc = operation.doc.clone();
    let mut facts = Vec::new();
    for member in operation.inputs.iter().chain(&operation.outputs) {
        let unit = member.unit.as_ref().map(|u| format!("in {u}"));
        let range = checks::range_text(member);
        let about: Vec<String> = unit.into_iter().chain(range).collect();
        if !about.is_empty() {
            facts.push(format!(
                "- `{}`: {}",
                names::local(&member.name.text),
                about.join(", ")
            ));
        }
    }
    if !facts.is_empty() && !doc.is_empty() {
        doc.push(String::new());
    }
    doc.extend(facts);
    doc
}
