//! Names and types of Python for interfaces: what `templates/python/interface.py.tera` prints.

use super::imports::Imports;
use super::{documentation, layout, library, names, types};
use crate::view;
use crate::view::library::{Interface, Operation};
use crate::view::types::Type;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

/// One interface that slots use: one file below `interfaces`.
#[derive(Debug, Serialize)]
pub(crate) struct InterfaceFile {
    pub(crate) name: String,
    pub(crate) module: String,
    /// The name of the file without its ending.
    pub(crate) stem: String,
    doc: String,
    answers: Vec<Answer>,
    /// The classes for slots that call and that publish; empty where there is none.
    client: String,
    publisher: String,
    /// The classes for subscribed slots with `fresh`, and for implemented ones with `serve latest`.
    samples: String,
    results: String,
    operations: Vec<Function>,
    imports: Imports,
    /// The names that it declares.
    pub(crate) exports: Vec<String>,
}

/// The reply of an operation that returns several values.
#[derive(Debug, Serialize)]
struct Answer {
    operation: String,
    name: String,
    fields: Vec<String>,
    /// Whether the first field is the result.
    #[serde(skip)]
    has_result: bool,
}

/// An operation as clients and publishers have it.
#[derive(Debug, Serialize)]
struct Function {
    index: usize,
    doc: String,
    /// Arguments for the port, each after a comma.
    arguments: String,
    /// The lines that call.
    calls: Vec<String>,
    /// `def name(…) -> …:` of a client and of a publisher.
    call: String,
    publish: String,
    /// Function that lends a sample in place, and its type; empty where there is none.
    loan: String,
    lent: String,
    /// Function that reads the reply in place, and its type; empty where there is none.
    in_place: String,
    seen: String,
    /// Function that returns the newest sample, and its type.
    newest: String,
    sample: String,
    /// Function that sets the result that answers queries; empty where there is none.
    set: String,
}

impl InterfaceFile {
    /// Whether the context has a slot of it: one that calls or publishes, or whose values it keeps.
    pub(crate) fn has_ends(&self) -> bool {
        let mut classes = [&self.client, &self.publisher, &self.samples, &self.results].into_iter();
        classes.any(|class| !class.is_empty())
    }

    /// The operations that reply with a result and `out` parameters, the classes of the replies,
    /// and their fields.
    pub(crate) fn replies(&self) -> impl Iterator<Item = (&str, &str, &[String])> {
        let answers = self.answers.iter().filter(|answer| answer.has_result);
        answers.map(|of| {
            (
                of.operation.as_str(),
                of.name.as_str(),
                of.fields.as_slice(),
            )
        })
    }

    /// The operations that reply with several values, and the classes of the replies.
    pub(crate) fn answers(&self) -> impl Iterator<Item = (&str, &str)> {
        self.answers
            .iter()
            .map(|answer| (answer.operation.as_str(), answer.name.as_str()))
    }
}

/// The file of an interface.
pub(crate) fn stem(view: &view::Component, module: &str, name: &str) -> String {
    let own = names::module(name);
    let interfaces = view.modules.iter().flat_map(|m| &m.interfaces);
    if interfaces.filter(|i| names::module(&i.name) == own).count() > 1 {
        format!("{}_{own}", names::module(module))
    } else {
        own
    }
}

/// The class of the reply of an operation with several values.
fn answer_name(operation: &str) -> String {
    let (first, rest) = operation.split_at(operation.chars().next().map_or(0, char::len_utf8));
    names::class(&format!("{}{rest}Answer", first.to_uppercase()))
}

/// Reports operations whose replies would have one class.
pub(super) fn check(library: &rc_idsl::Library, found: &mut Diagnostics) {
    let modules = library.modules.iter();
    for id in modules.flat_map(|module| &module.interfaces) {
        let mut seen: Vec<(&rc_syntax::Name, String)> = Vec::new();
        for of in &library.interface(*id).operations {
            if of.outputs.len() + usize::from(of.result.is_some()) < 2 {
                continue;
            }
            let (name, class) = (&of.name, answer_name(&of.name.text));
            if let Some((first, _)) = seen.iter().find(|(_, other)| *other == class) {
                let message = format!(
                    "the replies of `{}` and `{}` are both `{class}` in Python",
                    first.text, name.text
                );
                found.push(
                    Diagnostic::error("name-collision", name.span, message)
                        .label(first.span, "the other one"),
                );
            }
            seen.push((name, class));
        }
    }
}

fn parts(operation: &Operation) -> usize {
    operation.outputs.len() + usize::from(operation.result.is_some())
}

/// Result of a call.
pub(crate) fn reply(
    operation: &Operation,
    path: types::Path,
    answer: &dyn Fn(&str) -> String,
) -> String {
    match (
        parts(operation),
        &operation.result,
        operation.outputs.first(),
    ) {
        (0, ..) => "None".to_owned(),
        (1, Some(ty), _) => types::annotation(ty, path),
        (1, None, Some(output)) => types::member(output, path),
        _ => answer(&answer_name(&operation.name)),
    }
}

/// The interfaces of the slots.
pub(crate) fn of(view: &view::Component) -> Vec<InterfaceFile> {
    let all = view.modules.iter().flat_map(|module| &module.interfaces);
    let used = all.filter_map(|interface| {
        let slots = view.slots.iter();
        let slots = slots.filter(|s| s.module == interface.module && s.interface == interface.name);
        let slots: Vec<&view::Slot> = slots.collect();
        (!slots.is_empty()).then(|| file(view, interface, &slots))
    });
    let mut files: Vec<InterfaceFile> = used.collect();
    files.sort_by(|a, b| a.stem.cmp(&b.stem));
    files
}

fn file(view: &view::Component, interface: &Interface, slots: &[&view::Slot]) -> InterfaceFile {
    let path =
        |module: &str, name: &str| format!("_{}.{}", names::module(module), names::class(name));
    let class = names::class(&interface.name);
    let has = |role: Role| slots.iter().any(|slot| slot.role == role && slot.sends);
    let (calls, publishes) = (has(Role::Requires), has(Role::Publishes));
    let keeps = slots.iter().any(|slot| slot.keeps_newest());
    let serves = slots.iter().any(|slot| slot.serves_latest());
    let answers = interface.operations.iter().filter(|o| parts(o) > 1);
    let answers: Vec<Answer> = answers.map(|of| answer(of, &path)).collect();
    let operations = interface.operations.iter().enumerate();
    let operations = operations
        .filter(|_| calls || publishes || keeps || serves)
        .map(|(index, of)| call(view, index, of, &path))
        .collect::<Vec<Function>>();
    let mut texts: Vec<&str> = answers
        .iter()
        .flat_map(|answer| &answer.fields)
        .map(String::as_str)
        .collect();
    for operation in &operations {
        if calls {
            texts.extend([&*operation.call, &operation.seen]);
        }
        if publishes {
            texts.extend([&*operation.publish, &operation.lent]);
        }
        if keeps {
            texts.push(&operation.sample);
        }
        if serves {
            texts.push(&operation.set);
        }
    }
    let modules = view
        .modules
        .iter()
        .map(|module| names::module(&module.name));
    let modules = modules.filter(|stem| layout::mentions(&texts, &format!("_{stem}.")));
    let mut modules: Vec<String> = modules.collect();
    modules.sort();
    let modules = modules.into_iter();
    let modules = modules.map(|stem| format!("from ..types import {stem} as _{stem}"));
    let words = [
        ("_typing.", !answers.is_empty()),
        ("_robocomp.", calls || publishes || keeps || serves),
    ];
    let imports = Imports::of(&texts, &words, modules.collect());
    let class = |there: bool, word: &str| {
        if there {
            format!("{class}{word}")
        } else {
            String::new()
        }
    };
    let (client, publisher) = (class(calls, "Client"), class(publishes, "Publisher"));
    let (samples, results) = (class(keeps, "Samples"), class(serves, "Results"));
    let ends = [&client, &publisher, &samples, &results]
        .into_iter()
        .filter(|end| !end.is_empty());
    let exports = ends.cloned().chain(answers.iter().map(|a| a.name.clone()));
    InterfaceFile {
        stem: stem(view, &interface.module, &interface.name),
        name: interface.name.clone(),
        module: interface.module.clone(),
        doc: documentation::docstring_or(
            0,
            &interface.doc,
            format!("The interface `{}::{}`.", interface.module, interface.name),
        ),
        exports: exports.collect(),
        answers,
        client,
        publisher,
        samples,
        results,
        operations,
        imports,
    }
}

/// The type of a sample with its age.
pub(crate) fn sample_type(of: &Operation, path: types::Path) -> String {
    let types = of.inputs.iter().map(|input| types::member(input, path));
    let types: Vec<String> = types.collect();
    match types.as_slice() {
        [] => "_robocomp.Fresh[tuple[()]]".to_owned(),
        [one] => format!("_robocomp.Fresh[{one}]"),
        all => format!("_robocomp.Fresh[tuple[{}]]", all.join(", ")),
    }
}

/// Result first, then the `out` parameters, as the IDSL writes them.
fn answer(of: &Operation, path: types::Path) -> Answer {
    let mut taken = BTreeSet::new();
    let outputs = of.outputs.iter().map(|output| {
        let name = names::tuple_member(&output.name);
        taken.insert(name.clone());
        format!("{name}: {}", types::member(output, path))
    });
    let mut fields: Vec<String> = outputs.collect();
    if let Some(ty) = &of.result {
        let mut name = "result".to_owned();
        while taken.contains(&name) {
            name.push('_');
        }
        fields.insert(0, format!("{name}: {}", types::annotation(ty, path)));
    }
    Answer {
        operation: of.name.clone(),
        name: answer_name(&of.name),
        fields,
        has_result: of.result.is_some(),
    }
}

fn call(view: &view::Component, index: usize, of: &Operation, path: types::Path) -> Function {
    let method = names::method(&of.name);
    let mut arguments = vec!["self".to_owned()];
    let mut passed = String::new();
    for input in &of.inputs {
        let name = names::parameter(&input.name);
        arguments.push(format!("{name}: {}", types::member(input, path)));
        passed.push_str(", ");
        passed.push_str(&name);
    }
    let result = reply(of, path, &str::to_owned);
    let head = format!("def {method}");
    let bare = method.trim_end_matches('_');
    let text = |there: bool, text: String| if there { text } else { String::new() };
    let in_place = |ty: &Option<Type>, word: &str| {
        let ty = ty.as_ref();
        ty.map(|ty| library::in_place(view, ty, path, word))
    };
    let sample = in_place(&of.sample_in_place, "Loan");
    let seen = in_place(&of.result_in_place, "View");
    let calls = match (of.two_way, result.as_str()) {
        (false, _) => vec![format!("self._command({index}{passed})")],
        (true, "None") => vec![format!("self._query({index}{passed})")],
        (true, result) => vec![
            format!("reply: {result} = self._query({index}{passed})"),
            "return reply".to_owned(),
        ],
    };
    let sample_type = sample_type(of, path);
    let is_set = of.two_way && of.inputs.is_empty() && result != "None";
    let set = ["self".to_owned(), format!("result: {result}")];
    Function {
        index,
        newest: format!("def {method}(self) -> {sample_type}:"),
        sample: sample_type,
        set: text(
            is_set,
            layout::call(4, &format!("def set_{bare}"), &set, " -> None:"),
        ),
        doc: documentation::of_operation(of),
        arguments: passed,
        calls,
        call: layout::call(4, &head, &arguments, &format!(" -> {result}:")),
        publish: layout::call(4, &head, &arguments, " -> None:"),
        loan: text(sample.is_some(), format!("loan_{bare}")),
        lent: sample.unwrap_or_default(),
        in_place: text(
            seen.is_some(),
            layout::call(
                4,
                &format!("def {bare}_in_place"),
                &arguments,
                &format!(" -> {}:", seen.as_deref().unwrap_or_default()),
            ),
        ),
        seen: seen.unwrap_or_default(),
    }
}
