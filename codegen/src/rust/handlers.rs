//! Names and types of Rust for the handlers of a slot, in the trait and in the user's worker.

use super::exports::Exports;
use super::operation_names::{answer_name, error_name};
use super::shapes::reply_name;
use super::{in_place, names, types, worker};
use crate::view;
use crate::view::documentation;
use crate::view::library::{Interface, Operation};
use crate::view::members::Member;
use crate::view::types::{Named, Type};
use rc_vocabulary::Role;
use serde::Serialize;

/// One operation of a slot that receives.
#[derive(Debug, Serialize)]
pub(crate) struct Handler {
    pub(crate) method: String,
    doc: Vec<String>,
    /// The signature in the user's file, without its brace.
    pub(crate) user_signature: String,
    /// That signature on lines as rustfmt breaks them, with its brace.
    user_head: String,
    /// Unused parameters of an unwritten handler, in tuples of one line each.
    unused: Vec<Vec<String>>,
    /// `Ok(())`, `Default::default()` …: what an unwritten handler returns; else empty.
    placeholder: &'static str,
    /// Names that the user's handler mentions without their module.
    #[serde(skip)]
    pub(crate) mentioned: Vec<String>,
}

impl Handler {
    /// The function that guards transitions of the state machine.
    pub(super) fn guard(method: &str) -> Self {
        Self::of_machine(method, " -> bool", "true")
    }

    /// An action of the state machine.
    pub(super) fn action(method: &str) -> Self {
        Self::of_machine(method, " -> Result<(), WorkerError>", "Ok(())")
    }

    /// A function that a worker may leave out.
    pub(super) fn optional(method: String, user_signature: String) -> Self {
        Self {
            method,
            doc: Vec::new(),
            user_signature,
            user_head: String::new(),
            unused: Vec::new(),
            placeholder: "",
            mentioned: Vec::new(),
        }
    }

    /// A function that gets samples together.
    pub(super) fn collected(
        method: String,
        head: &str,
        arguments: &[String],
        unused: Vec<String>,
        mentioned: Vec<String>,
    ) -> Self {
        Self {
            method,
            doc: Vec::new(),
            user_signature: format!("{head}({})", arguments.join(", ")),
            user_head: worker::signature(head, arguments, ""),
            unused: lines_of_names(unused),
            placeholder: "",
            mentioned,
        }
    }

    fn of_machine(method: &str, returns: &str, placeholder: &'static str) -> Self {
        let arguments = ["&mut self".to_owned(), "ctx: &mut Context".to_owned()];
        let head = format!("fn {method}");
        Self {
            method: method.to_owned(),
            doc: Vec::new(),
            user_signature: format!("{head}({}){returns}", arguments.join(", ")),
            user_head: worker::signature(&head, &arguments, returns),
            unused: vec![vec!["ctx".to_owned()]],
            placeholder,
            mentioned: if returns.contains("WorkerError") {
                vec!["WorkerError".to_owned()]
            } else {
                Vec::new()
            },
        }
    }
}

/// Makes the handlers of one slot.
pub(super) struct Handlers<'a> {
    pub(super) slot: &'a view::Slot,
    /// The module of the interface below `interfaces`.
    pub(super) module: &'a str,
    pub(super) exports: &'a Exports<'a>,
}

impl Handlers<'_> {
    pub(super) fn all(&self, interface: &Interface) -> Vec<Handler> {
        let operations = interface.operations.iter();
        operations
            .map(|operation| self.handler(operation))
            .collect()
    }

    fn handler(&self, of: &Operation) -> Handler {
        let exports = self.exports;
        let throws = !of.throws.is_empty();
        let in_place = match self.slot.role {
            _ if !self.slot.in_place => None,
            Role::SubscribesTo => of.sample_in_place.as_ref(),
            Role::Implements | Role::Requires | Role::Publishes => of.result_in_place.as_ref(),
        };
        let sample = in_place.filter(|_| !of.two_way);
        let reply = in_place.filter(|_| of.two_way);
        let inputs = of.inputs.iter().map(|member| names::local(&member.name));
        let inputs: Vec<String> = inputs.collect();
        let result_name = reply.map(|_| reply_name(of, &inputs)).unwrap_or_default();
        let member = if self.slot.is_array {
            member_name(&inputs, &result_name)
        } else {
            String::new()
        };
        // Reply values, the returned one first, as the user's file writes them.
        let bare = |module: &str, name: &str| exports.ty(module, name);
        let mut bare_results: Vec<String> = Vec::new();
        if reply.is_none() {
            bare_results.extend(of.result.iter().map(|ty| types::owned(ty, &bare)));
            bare_results.extend(of.outputs.iter().map(|m| types::member(m, &bare)));
        }
        let answer = answer_name(&of.name);
        let tuple = match bare_results.as_slice() {
            [one] => one.clone(),
            all => format!("({})", all.join(", ")),
        };
        // rustfmt breaks a longer tuple; its name is easier to read.
        let user_result = if bare_results.len() > 1 && tuple.len() > 62 {
            exports.of_interface(self.module, &answer)
        } else {
            tuple
        };
        let error = error_name(&of.name);
        let user_error = exports.of_interface(self.module, &error);
        let returns = match (of.two_way, throws) {
            (true, true) => format!(" -> Result<{user_result}, {user_error}>"),
            (true, false) if user_result != "()" => format!(" -> {user_result}"),
            _ => String::new(),
        };
        let mut arguments = vec!["&mut self".to_owned(), "ctx: &mut Context".to_owned()];
        if self.slot.is_array {
            arguments.push(format!("{member}: &Member"));
        }
        let bare_place = |ty: &Type| match ty {
            Type::Named(Named { module, name, .. }) => exports.in_place(module, name),
            Type::Primitive(_)
            | Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. } => String::new(),
        };
        for (member, input) in of.inputs.iter().zip(&inputs) {
            let ty = match sample {
                Some(ty) => format!("&{}", bare_place(ty)),
                None => types::member(member, &bare),
            };
            arguments.push(format!("{input}: {ty}"));
        }
        arguments.extend(reply.map(|ty| format!("{result_name}: &mut {}", bare_place(ty))));
        let method = names::method(&of.name);
        let head = format!("fn {method}");
        let mut unused = vec!["ctx".to_owned()];
        unused.extend(self.slot.is_array.then(|| member.clone()));
        unused.extend(inputs.iter().cloned());
        unused.extend(reply.map(|_| result_name.clone()));
        Handler {
            doc: documentation::of_operation(of, names::local),
            mentioned: self.mentioned(of, &user_result, sample.is_some(), in_place),
            user_signature: format!("{head}({}){returns}", arguments.join(", ")),
            user_head: worker::signature(&head, &arguments, &returns),
            unused: lines_of_names(unused),
            placeholder: match (of.two_way, throws, bare_results.is_empty()) {
                (true, true, true) => "Ok(())",
                (true, true, false) => "Ok(Default::default())",
                (true, false, false) => "Default::default()",
                _ => "",
            },
            method,
        }
    }

    /// Names of the generated crate that the user's handler mentions.
    fn mentioned(
        &self,
        of: &Operation,
        result: &str,
        sample_in_place: bool,
        in_place: Option<&Type>,
    ) -> Vec<String> {
        let mut found = Vec::new();
        let mut named = |ty: &Type| {
            let named = ty.names().into_iter();
            found.extend(named.map(|ty| names::ty(&ty.name)));
        };
        if !sample_in_place {
            of.inputs.iter().for_each(|m| named(&m.ty));
        }
        let answer = answer_name(&of.name);
        let has_name = result == answer;
        if !has_name && in_place.is_none() {
            of.outputs.iter().for_each(|m: &Member| named(&m.ty));
            of.result.iter().for_each(named);
        }
        if has_name {
            found.push(answer);
        }
        if let Some(Type::Named(Named { name, .. })) = in_place {
            found.push(in_place::path(&names::ty(name)));
        }
        if !of.throws.is_empty() {
            found.push(error_name(&of.name));
        }
        found.retain(|name| self.exports.is_unique(name));
        found.extend(self.slot.is_array.then(|| "Member".to_owned()));
        found
    }
}

/// The variable of the member of a slot array that is asked. A parameter may have this name, too.
fn member_name(inputs: &[String], result_name: &str) -> String {
    let mut name = "member".to_owned();
    while inputs.contains(&name) || result_name == name {
        name.push('_');
    }
    name
}

/// As many names in one tuple as rustfmt leaves on one line.
fn lines_of_names(names: Vec<String>) -> Vec<Vec<String>> {
    let mut tuples: Vec<Vec<String>> = vec![Vec::new()];
    for name in names {
        let width = |names: &[String]| names.iter().map(|n| n.len() + 2).sum::<usize>();
        match tuples.last_mut() {
            Some(last) if last.is_empty() || width(last) + name.len() <= 58 => last.push(name),
            _ => tuples.push(vec![name]),
        }
    }
    tuples
}
