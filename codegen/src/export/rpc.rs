//! Exports interfaces: a struct for each topic, and for calls the types of the basic service
//! mapping of OMG DDS-RPC 1.0 (formal/16-12-04, 7.5.1.1), which `rc_middleware::rpc` encodes.

use super::idl::Writer;
use super::rpc_names::exception_hash;
use super::scope::{Scope, escaped};
use super::uses::{is_call, is_topic};
use crate::view::rpc_hash;
use rc_idsl::model::{Interface, Member, Operation, Type};
use rc_syntax::Name;

/// All types of an interface.
pub(super) fn interface(writer: &mut Writer<'_>, interface: &Interface) {
    let own = &interface.name.text;
    let topics = interface
        .operations
        .iter()
        .filter(|o| is_topic(interface, o));
    for operation in topics {
        let name = format!("{own}_{}", operation.name.text);
        let mut doc = operation.doc.clone();
        doc.push(format!("Topic: ADDRESS/{}", operation.name.text));
        writer.structure_or(&name, &doc, &operation.inputs, "octet");
    }
    let calls = interface
        .operations
        .iter()
        .filter(|o| is_call(interface, o));
    let calls: Vec<&Operation> = calls.collect();
    if calls.is_empty() {
        return;
    }
    for operation in &calls {
        call(writer, own, operation);
    }
    let module = &writer.library.module(interface.module).name.text;
    let module = escaped(module);
    for (union, end) in [("Call", "In"), ("Return", "Result")] {
        let cases: Vec<Case> = calls
            .iter()
            .map(|operation| {
                let base = format!("{own}_{}", operation.name.text);
                Case {
                    label: escaped(&format!("{base}_Hash")),
                    ty: escaped(&format!("{base}_{end}")),
                    name: operation.name.text.clone(),
                }
            })
            .collect();
        let unknown = ("::dds::rpc::UnknownOperation", "unknownOp");
        switch(writer, &format!("{own}_{union}"), unknown, &cases);
    }
    for (message, data, doc) in [
        ("Request", "Call", interface.doc.clone()),
        ("Reply", "Return", Vec::new()),
    ] {
        writer.text.gap();
        writer.text.doc(&doc);
        writer.text.doc(&[format!("Topic: ADDRESS_{message}")]);
        writer.text.line("@final");
        writer
            .text
            .open(&format!("struct {}", escaped(&format!("{own}_{message}"))));
        writer
            .text
            .line(&format!("::dds::rpc::{message}Header header;"));
        let data = escaped(&format!("{own}_{data}"));
        writer.text.line(&format!("::{module}::{data} data;"));
        writer.text.close();
    }
}

/// Writes the types of a call: inputs, outputs, and a union of outputs and exceptions.
fn call(writer: &mut Writer<'_>, interface: &str, operation: &Operation) {
    let base = format!("{interface}_{}", operation.name.text);
    let hash = rpc_hash::of(&operation.name.text);
    writer.text.gap();
    let constant = escaped(&format!("{base}_Hash"));
    writer
        .text
        .line(&format!("const int32 {constant} = {hash};"));
    let mut out = operation.outputs.clone();
    out.extend(operation.result.as_ref().map(|ty| returned(operation, ty)));
    for (end, doc, members) in [
        ("In", operation.doc.as_slice(), &operation.inputs),
        ("Out", &[], &out),
    ] {
        let nothing = "::dds::rpc::UnusedMember";
        writer.structure_or(&format!("{base}_{end}"), doc, members, nothing);
    }
    let mut cases = vec![Case {
        label: "0".to_owned(),
        ty: escaped(&format!("{base}_Out")),
        name: "result".to_owned(),
    }];
    for exception in &operation.throws {
        let decl = writer.library.ty(*exception);
        let module = escaped(&writer.library.module(decl.module).name.text);
        let hash = escaped(&exception_hash(&writer.names.types[exception]));
        cases.push(Case {
            label: format!("::{module}::{hash}"),
            ty: writer.names.path(writer.library, *exception),
            name: format!("{}_ex", decl.name.text.to_lowercase()),
        });
    }
    let unknown = ("::dds::rpc::UnknownException", "unknownEx");
    switch(writer, &format!("{base}_Result"), unknown, &cases);
}

/// The member for the return value of an operation.
fn returned(operation: &Operation, ty: &Type) -> Member {
    Member::plain(Name::new("return_", operation.name.span), ty.clone())
}

struct Case {
    label: String,
    ty: String,
    name: String,
}

/// Writes a union that is discriminated by hashes of names.
fn switch(writer: &mut Writer<'_>, name: &str, (unknown, member): (&str, &str), cases: &[Case]) {
    let mut scope = Scope::new(name);
    writer.text.gap();
    writer.text.line("@final");
    writer
        .text
        .open(&format!("union {} switch (int32)", escaped(name)));
    writer.text.line(&format!(
        "default: {unknown} {};",
        scope.unique_name(member)
    ));
    for case in cases {
        let name = escaped(&scope.unique_name(&case.name));
        writer
            .text
            .line(&format!("case {}: {} {name};", case.label, case.ty));
    }
    writer.text.close();
}
