//! Names and types of Rust for an operation: its codecs, and the functions of its client and its
//! publisher.

use super::checks::{self, Place, READS, ValuePlace, WRITES};
use super::codecs::{Codecs, placed};
use super::members::{Input, input};
use super::operation_names::{
    answer_name, error_name, exception_constant, operation_constant, plain, variant,
};
use super::{names, types};
use crate::collisions::{self, bare};
use crate::view::documentation;
use crate::view::library as view;
use crate::view::types::{Named, Type};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The most parts of a tuple that `rc_middleware::typed` reads and writes.
const MOST_PARTS: usize = 12;

/// An operation.
#[derive(Debug, Serialize)]
pub(super) struct Operation<'a> {
    pub(super) name: &'a str,
    method: String,
    /// The functions that lend a sample, and that read a reply in place.
    loan: String,
    read_in_place: String,
    pub(super) constant: String,
    pub(super) doc: Vec<String>,
    two_way: bool,
    /// The parameters of a function of a client or a publisher, each after a comma, and their
    /// names, each before one.
    borrowed: String,
    named: String,
    /// The inputs as a tuple of variables, of types, and as a client sends them: those with bounds
    /// are checked while they are written.
    pattern: String,
    pub(super) arguments: String,
    sent: String,
    /// The statements that read the inputs.
    gets: Vec<String>,
    #[serde(flatten)]
    pub(super) codecs: Codecs,
    /// The function that writes a reply has its pattern and its statements; that which reads one
    /// has other statements.
    returned: String,
    puts_reply: Vec<String>,
    gets_reply: Vec<String>,
    pub(super) result: String,
    /// The name of the tuple, and its types; empty where it is none.
    pub(super) answer: String,
    answer_types: String,
    /// The error of its functions.
    error: String,
    #[serde(skip)]
    pub(super) throws: Vec<Exception>,
    /// The structure of a sample, and of a result, in shared memory; else empty.
    sample_in_place: String,
    result_in_place: String,
    /// The names of a fake's call and its setter, and the type of its answer.
    #[serde(skip)]
    pub(super) fake: String,
}

impl Operation<'_> {
    /// Whether its codecs name the module `typed`. Those of a sample in place do not.
    pub(super) fn names_typed(&self) -> bool {
        self.two_way || !self.codecs.own_read || self.codecs.own_write
    }

    /// Whether it throws exceptions.
    pub(super) fn throws(&self) -> bool {
        !self.throws.is_empty()
    }

    /// The error of its functions.
    pub(super) fn error(&self) -> &str {
        &self.error
    }
}

/// An exception of an operation.
#[derive(Debug)]
pub(super) struct Exception {
    pub(super) variant: String,
    pub(super) ty: String,
    pub(super) constant: String,
}

/// The constant with the discriminator of an exception.
pub(super) fn constant(interface: &view::Interface, exception: &view::Exception) -> String {
    let operations = interface.operations.iter().map(|o| o.name.as_str());
    exception_constant(operations, type_name(&exception.ty))
}

fn type_name(ty: &Type) -> &str {
    match ty {
        Type::Named(Named { name, .. }) => name,
        Type::Primitive(_)
        | Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. } => "",
    }
}

/// The operations of an interface with the types of another crate, whose paths `path` writes.
pub(super) fn all<'a>(interface: &'a view::Interface, path: types::Path) -> Vec<Operation<'a>> {
    let (mut functions, mut variants) = (BTreeSet::new(), BTreeSet::new());
    let all = interface.operations.iter();
    all.map(|o| of(interface, o, path, &mut functions, &mut variants))
        .collect()
}

/// A tuple of Rust, which has a comma after its only part.
fn tuple<'a>(parts: impl Iterator<Item = &'a str>) -> String {
    match parts.collect::<Vec<_>>().as_slice() {
        [one] => format!("({one},)"),
        all => format!("({})", all.join(", ")),
    }
}

/// A tuple of tuples if there are more parts than one may have, for a value that a receiver in the
/// same process takes.
fn nested<'a>(parts: impl Iterator<Item = &'a str>) -> String {
    let parts: Vec<&str> = parts.collect();
    if parts.len() <= MOST_PARTS {
        return tuple(parts.into_iter());
    }
    let inner = parts.chunks(MOST_PARTS);
    let inner: Vec<String> = inner.map(|part| tuple(part.iter().copied())).collect();
    nested(inner.iter().map(String::as_str))
}

/// The statement that returns the value that a sender in the same process has sent. The range of
/// the sender may differ, so `checks` check it with those of the receiver, for which the type has
/// to be known.
fn get_itself((value, ty): (&str, &str), checks: &str, returned: &str) -> String {
    let ty = if checks.is_empty() {
        String::new()
    } else {
        format!("::<{ty}>")
    };
    format!(
        "if let Some({value}) = reader.value_itself{ty}() {{\n{checks}\nreturn Ok({returned});\n}}"
    )
}

/// All statements that check, one in a line.
fn joined<'a>(checks: impl Iterator<Item = &'a str>) -> String {
    let checks: Vec<&str> = checks.filter(|check| !check.is_empty()).collect();
    checks.join("\n")
}

/// A variable of a reply.
struct Reply {
    name: String,
    ty: String,
    /// The statements that check it through a reference, and as a variable that was read.
    written: String,
    read: String,
}

/// The variables of a reply, in the order of the wire.
fn replies(interface: &view::Interface, of: &view::Operation, path: types::Path) -> Vec<Reply> {
    let module = names::module(&interface.name);
    let one = |idsl: &str, name: String, ty: String, check: Check| {
        let check = |owner: &str, held, side| {
            let what = format!("{owner}.{}.{idsl}", of.name);
            let place = Place {
                what: &what,
                name: &name,
                held,
            };
            check(place, side)
        };
        Reply {
            written: check(&module, ValuePlace::Behind, WRITES),
            read: check(&interface.name, ValuePlace::Owned, READS),
            name,
            ty,
        }
    };
    let outputs = of.outputs.iter().map(|member| {
        let name = names::local(&member.name);
        let check = |place: Place, side| checks::of_member(member, place, side);
        one(&member.name, name, types::member(member, path), &check)
    });
    let result = of.result.iter().map(|ty| {
        let check = |place: Place, side| checks::of(&of.result_checks, place, side);
        one("result", RESULT.to_owned(), types::owned(ty, path), &check)
    });
    outputs.chain(result).collect()
}

/// The variable with the value of an operation.
const RESULT: &str = "result";

type Check<'a> = &'a dyn Fn(Place, checks::Side) -> String;

/// The statements that read a variable, which may be the only one and in shared memory.
fn get(name: &str, ty: &str, checks: &str, placed: &str) -> String {
    let value = if placed.is_empty() {
        format!("let {name}: {ty} = reader.get()?;")
    } else {
        format!("let {name} = reader.value::<{placed}>()?;")
    };
    format!("{value}\n{checks}")
}

/// `functions` are those that the client or the publisher has by now, `variants` those of the
/// calls that fakes keep.
pub(super) fn of<'a>(
    interface: &'a view::Interface,
    of: &'a view::Operation,
    path: types::Path,
    functions: &mut BTreeSet<String>,
    variants: &mut BTreeSet<String>,
) -> Operation<'a> {
    let owner = format!("{}.{}", interface.name, of.name);
    let inputs = of.inputs.iter();
    let inputs = inputs.map(|m| input(m, &owner, names::local(&m.name), path));
    let inputs: Vec<Input> = inputs.collect();
    let replies = replies(interface, of, path);
    // The result is the first part in Rust, and the last one on the wire.
    let has_result = usize::from(of.result.is_some());
    let mut returned: Vec<&Reply> = replies.iter().collect();
    returned.rotate_right(has_result);
    let (answer, result) = match returned.as_slice() {
        [] => (String::new(), "()".to_owned()),
        [one] => (String::new(), one.ty.clone()),
        _ => (answer_name(&of.name), answer_name(&of.name)),
    };
    let method = names::method(&of.name);
    let mut function = |there: bool, wanted: String| {
        let name = there.then(|| collisions::free(wanted, functions));
        name.unwrap_or_default()
    };
    let sample_in_place = placed(of.sample_in_place.as_ref(), path);
    let result_in_place = placed(of.result_in_place.as_ref(), path);
    let loan = function(
        !sample_in_place.is_empty(),
        format!("loan_{}", bare(&method)),
    );
    let read_in_place = function(
        !result_in_place.is_empty(),
        format!("{}_in_place", bare(&method)),
    );
    let throws = of.throws.iter().map(|exception| Exception {
        variant: variant(type_name(&exception.ty)),
        ty: types::owned(&exception.ty, path),
        constant: constant(interface, exception),
    });
    let throws: Vec<Exception> = throws.collect();
    let own_write = inputs.iter().any(|i| !i.written.is_empty());
    let own_read = own_write || inputs.len() > MOST_PARTS || !sample_in_place.is_empty();
    let turned = has_result == 1 && !of.outputs.is_empty();
    let own_reply =
        turned || replies.iter().any(|r| !r.written.is_empty()) || replies.len() > MOST_PARTS;
    let own_result = own_reply || !result_in_place.is_empty();
    let plain = plain(&of.name);
    let codec = |own: bool, name: &str| {
        if own {
            format!("{name}_{plain}")
        } else {
            format!("typed::{name}")
        }
    };
    let mut sent = nested(inputs.iter().map(|i| i.sent.as_str()));
    if own_write {
        let puts = inputs
            .iter()
            .map(|i| format!("{}\ntyped::Put::put({}, writer);\n", i.written, i.sent));
        let puts: String = puts.collect();
        sent = format!("typed::Checked::new({sent}, |writer| {{\n{puts}}})");
    }
    let (mut borrowed, mut named) = (String::new(), String::new());
    for Input {
        name, borrowed: ty, ..
    } in &inputs
    {
        let _ = write!(borrowed, ", {name}: {ty}");
        let _ = write!(named, "{name}, ");
    }
    let names: Vec<&str> = returned.iter().map(|r| r.name.as_str()).collect();
    let returned_pattern = match names.as_slice() {
        [one] => (*one).to_owned(),
        all => format!("({})", all.join(", ")),
    };
    let types: Vec<&str> = returned.iter().map(|r| r.ty.as_str()).collect();
    let variables = || inputs.iter().map(|i| i.name.as_str());
    let pattern = tuple(variables());
    let owned = nested(inputs.iter().map(|i| i.ty.as_str()));
    let checks = joined(inputs.iter().map(|i| i.read.as_str()));
    let itself = get_itself((&nested(variables()), &owned), &checks, &pattern);
    let gets = inputs
        .iter()
        .map(|i| get(&i.name, &i.ty, &i.read, &sample_in_place));
    let gets = std::iter::once(itself).chain(gets).collect();
    // A longer tuple cannot be cloned.
    let itself = (replies.len() <= MOST_PARTS).then(|| {
        let checks = joined(replies.iter().map(|r| r.read.as_str()));
        let returned: &str = if checks.is_empty() {
            RESULT
        } else {
            &returned_pattern
        };
        get_itself((returned, &result), &checks, returned)
    });
    Operation {
        name: &of.name,
        loan,
        read_in_place,
        constant: operation_constant(&of.name),
        doc: documentation::of_operation(of, names::local),
        two_way: of.two_way,
        borrowed,
        named,
        pattern,
        arguments: tuple(inputs.iter().map(|i| i.ty.as_str())),
        gets,
        sent,
        codecs: Codecs {
            read: codec(own_read, "read"),
            reply: codec(own_reply, "reply"),
            take: codec(own_result, "result"),
            own_read,
            own_write,
            own_reply: own_reply && of.two_way,
            own_result: own_result && of.two_way,
        },
        returned: returned_pattern,
        puts_reply: replies
            .iter()
            .map(|r| format!("{}\nwriter.put({});", r.written, r.name))
            .collect(),
        gets_reply: itself
            .into_iter()
            .chain(
                replies
                    .iter()
                    .map(|r| get(&r.name, &r.ty, &r.read, &result_in_place)),
            )
            .collect(),
        result,
        answer_types: if answer.is_empty() {
            String::new()
        } else {
            types.join(", ")
        },
        answer,
        error: if throws.is_empty() {
            "rc_middleware::CallError".to_owned()
        } else {
            error_name(&of.name)
        },
        fake: fake(of, &method, &throws, &replies, variants),
        throws,
        sample_in_place,
        result_in_place,
        method,
    }
}

/// The names of a fake's call and its setter, and the type of its answer.
fn fake(
    of: &view::Operation,
    method: &str,
    throws: &[Exception],
    replies: &[Reply],
    variants: &mut BTreeSet<String>,
) -> String {
    let variant = collisions::free(names::camel(&of.name), variants);
    let call = format!("\"{}\", {}, 0x{}", of.name, of.id, of.type_hash);
    let answer = if of.two_way {
        let thrown = throws.iter().map(|e| (&e.ty, e.constant.as_str()));
        let all = thrown.chain(replies.iter().map(|r| (&r.ty, "0")));
        let all = all.map(|(ty, id)| format!("typed::ReplyVariant::of::<{ty}>({id})"));
        // A reply without exceptions has no discriminator.
        let all: Vec<String> = all.filter(|_| !throws.is_empty()).collect();
        format!("query({call}, &[{}])", all.join(", "))
    } else {
        format!("one_way({call})")
    };
    format!("{variant} on_{} {answer}", bare(method))
}
