//! The settings of a slot: quality of service, timeouts, wake-up.

use crate::ast::Setting;
use crate::model::Role;
use crate::resolver::Resolver;
use rc_diagnostics::Diagnostic;
use rc_idsl::model::InterfaceId;
use rc_syntax::{Literal, LiteralKind};
use rc_vocabulary::qos::{Policies, PolicyName, Values};
use rc_vocabulary::{Scalar, duration};
use std::collections::HashMap;

/// The setting of a slot whose handlers receive or write values in shared memory.
const IN_PLACE: &str = "in_place";
/// The setting of how an end waits, whose value begins with `spin`.
const WAKE: &str = "wake";

/// The word for a policy as a setting of a slot.
fn setting(policy: PolicyName) -> &'static str {
    match policy {
        PolicyName::Spin => WAKE,
        other => other.word(),
    }
}

/// The allowed values of a setting, for messages.
fn allowed(policy: PolicyName) -> String {
    let time = duration::text_of;
    match policy.values() {
        Values::Words(words) => {
            let words: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
            words.join(" or ")
        }
        Values::Count(range) => format!("an integer from {} to {}", range.start(), range.end()),
        Values::Limit | Values::Time => "a duration such as `500ms`".to_owned(),
        Values::Within(range) => {
            let (least, most) = (time(*range.start()), time(*range.end()));
            format!("`spin` and a duration from {least} to {most}")
        }
    }
}

/// The setting of values in shared memory, for a role whose handlers choose it.
fn in_place(role: Role) -> Option<&'static str> {
    match role {
        Role::Implements | Role::SubscribesTo => Some(IN_PLACE),
        // Publishers and clients choose `in_place` at each call.
        Role::Requires | Role::Publishes => None,
    }
}

/// The settings that a slot of this role may have: the word, the allowed values for people, and the
/// values; without values, `true` or `false`.
pub fn settings(role: Role) -> Vec<(&'static str, String, Option<Values>)> {
    let policies = PolicyName::ALL.into_iter().filter(|name| name.is_of(role));
    let policies = policies.map(|policy| (setting(policy), allowed(policy), Some(policy.values())));
    let in_place = in_place(role).map(|word| (word, "`true` or `false`".to_owned(), None));
    policies.chain(in_place).collect()
}

/// A literal as a value of a policy. The language has no word for no limit: it is the default.
fn scalar(value: &Literal) -> Scalar<'_> {
    match &value.kind {
        LiteralKind::Name(word) if word != "none" => Scalar::Text(word),
        // Every limit is far below 64 bits, so it refuses the nearest number, too.
        LiteralKind::Int(number) => {
            Scalar::Int((*number).clamp(i64::MIN.into(), i64::MAX.into()) as i64)
        }
        LiteralKind::Bool(choice) => Scalar::Bool(*choice),
        LiteralKind::Duration(nanoseconds) => Scalar::Duration(*nanoseconds),
        LiteralKind::Name(_) | LiteralKind::Float(_) | LiteralKind::String(_) => Scalar::Other,
    }
}

impl Resolver<'_> {
    /// Reads the settings of a slot: the quality of service, and whether values travel in place.
    /// Reports invalid ones.
    pub(crate) fn qos(
        &mut self,
        role: Role,
        interface: InterfaceId,
        settings: &[Setting],
    ) -> (Policies, bool) {
        let policies = PolicyName::ALL.into_iter().filter(|name| name.is_of(role));
        let in_place = in_place(role);
        let (mut qos, mut is_in_place) = (Policies::default(), false);
        let mut seen = HashMap::new();
        for Setting { name, value, spin } in settings {
            self.check_unique(&mut seen, name, "setting");
            let word = name.text.as_str();
            let (is_valid, allowed) = if in_place == Some(word) {
                let choice = match value.kind {
                    LiteralKind::Bool(choice) => Some(choice),
                    _ => None,
                };
                is_in_place = choice == Some(true);
                if is_in_place {
                    self.check_in_place(role, interface, value);
                }
                (choice.is_some(), "`true` or `false`".to_owned())
            } else if let Some(policy) = policies.clone().find(|policy| setting(*policy) == word) {
                let read = policy.read(scalar(value));
                let read = read.filter(|_| *spin == (word == WAKE));
                let is_valid = read.is_some();
                qos.extend(read);
                (is_valid, allowed(policy))
            } else {
                let message = format!("`{}` has no setting `{word}`", role.word());
                let diagnostic = Diagnostic::error("unknown-qos", name.span, message);
                let words = policies.clone().map(setting).chain(in_place);
                self.found.push(diagnostic.suggest(word, words));
                continue;
            };
            if !is_valid {
                let written = match value.as_nanoseconds() {
                    Some(ns) if *spin => format!("`spin {}`", duration::text(ns)),
                    _ if *spin => format!("`spin` with {}", value.described()),
                    _ => value.described(),
                };
                let message =
                    format!("invalid value of `{word}`: expected {allowed}, found {written}");
                self.found
                    .push(Diagnostic::error("bad-qos", value.span, message));
            }
        }
        (qos, is_in_place)
    }

    /// Reports an interface without any operation whose values can travel in place.
    fn check_in_place(&mut self, role: Role, interface: InterfaceId, value: &Literal) {
        let interface = self.library.interface(interface);
        let mut operations = interface.operations.iter();
        let any = operations.any(|operation| {
            let in_place = match role {
                Role::SubscribesTo => operation.topic_in_place(&self.library),
                _ => operation.result_in_place(&self.library),
            };
            in_place.is_some()
        });
        if !any {
            let what = match role {
                Role::SubscribesTo => "parameter",
                _ => "result",
            };
            let message = format!(
                "no operation of `{}` has a plain struct with a bounded sequence as its only {what}",
                interface.name.text
            );
            let help = "use only numbers, enums, `string<N>`, `sequence<T, N>`, arrays and structs of them";
            self.found
                .push(Diagnostic::error("bad-qos", value.span, message).help(help));
        }
    }
}
