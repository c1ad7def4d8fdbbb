//! The settings of a slot: quality of service, timeouts, wake-up.

use crate::ast::Setting;
use crate::model::Role;
use crate::resolver::Resolver;
use rc_diagnostics::Diagnostic;
use rc_idsl::model::{InterfaceId, Operation};
use rc_syntax::{Literal, LiteralKind};
use rc_vocabulary::qos::{Policies, PolicyName, Values};
use rc_vocabulary::{Scalar, duration};
use std::collections::HashMap;

/// The setting of a slot whose handlers receive or write values in shared memory.
const IN_PLACE: &str = "in_place";
/// The setting of a slot whose queries can also be started, and end later.
const ASYNCHRONOUS: &str = "asynchronous";
/// The setting of how an end waits, whose value begins with `spin`.
const WAKE: &str = "wake";
/// The setting of how a query is served, whose value begins with `latest`.
const SERVE: &str = "serve";

/// The word for a policy as a setting of a slot.
fn setting(policy: PolicyName) -> &'static str {
    match policy {
        PolicyName::Spin => WAKE,
        PolicyName::Latest => SERVE,
        other @ (PolicyName::Reliability
        | PolicyName::Durability
        | PolicyName::Depth
        | PolicyName::Deadline
        | PolicyName::Lifespan
        | PolicyName::Liveliness
        | PolicyName::Timeout
        | PolicyName::Fresh
        | PolicyName::Stale
        | PolicyName::Cache) => other.word(),
    }
}

/// The word before the value of a setting.
fn mode(policy: PolicyName) -> Option<&'static str> {
    matches!(policy, PolicyName::Spin | PolicyName::Latest).then(|| policy.word())
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
        Values::Limit if policy == PolicyName::Latest => {
            "`latest` and a duration such as `200ms`".to_owned()
        }
        Values::Limit | Values::Time => "a duration such as `500ms`".to_owned(),
        Values::Within(range) => {
            let (least, most) = (time(*range.start()), time(*range.end()));
            format!("`spin` and a duration from {least} to {most}")
        }
    }
}

/// The setting of a role that is `true` or `false`.
fn choice(role: Role) -> Option<&'static str> {
    match role {
        Role::Implements | Role::SubscribesTo => Some(IN_PLACE),
        Role::Requires => Some(ASYNCHRONOUS),
        // Publishers choose values in shared memory at each call, as clients do.
        Role::Publishes => None,
    }
}

/// The settings that a slot of this role may have: the word, the allowed values for people, and the
/// values; without values, `true` or `false`.
pub fn settings(role: Role) -> Vec<(&'static str, String, Option<Values>)> {
    let policies = PolicyName::ALL.into_iter().filter(|name| name.is_of(role));
    let policies = policies.map(|policy| (setting(policy), allowed(policy), Some(policy.values())));
    let choice = choice(role).map(|word| (word, "`true` or `false`".to_owned(), None));
    policies.chain(choice).collect()
}

/// A literal as a value of a policy. The language cannot express "no limit", which is the default.
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

/// The settings of a slot.
#[derive(Default)]
pub(crate) struct SlotSettings {
    pub(crate) qos: Policies,
    /// Whether values travel in place.
    pub(crate) in_place: bool,
    /// Whether queries can be started, and end later.
    pub(crate) asynchronous: bool,
}

impl Resolver<'_> {
    /// Reads the settings of a slot. Reports invalid ones.
    pub(crate) fn qos(
        &mut self,
        role: Role,
        interface: InterfaceId,
        settings: &[Setting],
    ) -> SlotSettings {
        let policies = PolicyName::ALL.into_iter().filter(|name| name.is_of(role));
        let choice = choice(role);
        let mut read_settings = SlotSettings::default();
        let mut seen = HashMap::new();
        for Setting {
            name,
            value,
            mode: written,
        } in settings
        {
            self.check_unique(&mut seen, name, "setting");
            let word = name.text.as_str();
            let (is_valid, allowed) = if choice == Some(word) {
                let choice = match value.kind {
                    LiteralKind::Bool(choice) => Some(choice),
                    LiteralKind::Int(_)
                    | LiteralKind::Float(_)
                    | LiteralKind::String(_)
                    | LiteralKind::Duration(_)
                    | LiteralKind::Name(_) => None,
                };
                let is_chosen = choice == Some(true);
                if role == Role::Requires {
                    read_settings.asynchronous = is_chosen;
                } else {
                    read_settings.in_place = is_chosen;
                }
                if is_chosen && role == Role::Requires {
                    self.check_asynchronous(interface, value);
                } else if is_chosen {
                    self.check_in_place(role, interface, value);
                }
                (choice.is_some(), "`true` or `false`".to_owned())
            } else if let Some(policy) = policies.clone().find(|policy| setting(*policy) == word) {
                let read = policy.read(scalar(value));
                let read = read.filter(|_| written.as_deref() == mode(policy));
                let is_valid = read.is_some();
                read_settings.qos.extend(read);
                (is_valid, allowed(policy))
            } else {
                let message = format!("`{}` has no setting `{word}`", role.word());
                let diagnostic = Diagnostic::error("unknown-qos", name.span, message);
                let words = policies.clone().map(setting).chain(choice);
                self.found.push(diagnostic.suggest(word, words));
                continue;
            };
            if !is_valid {
                let written = match (value.as_nanoseconds(), written) {
                    (Some(ns), Some(mode)) => format!("`{mode} {}`", duration::text(ns)),
                    (None, Some(mode)) => format!("`{mode}` with {}", value.described()),
                    (_, None) => value.described(),
                };
                let message =
                    format!("invalid value of `{word}`: expected {allowed}, found {written}");
                self.found
                    .push(Diagnostic::error("bad-qos", value.span, message));
            }
        }
        self.check_freshness(role, interface, settings, &read_settings);
        read_settings
    }

    /// Reports settings of fresh values that do not fit together.
    fn check_freshness(
        &mut self,
        role: Role,
        interface: InterfaceId,
        settings: &[Setting],
        read: &SlotSettings,
    ) {
        let qos = read.qos.over(rc_vocabulary::qos::Qos::of(role));
        let span = |word: &str| {
            let named = settings.iter().find(|setting| setting.name.text == word);
            named.map(|setting| setting.name.span)
        };
        let mut report = |diagnostic: Diagnostic, help: &str| {
            self.found.push(diagnostic.help(help.to_owned()));
        };
        if let (Some(at), None) = (span("stale"), qos.fresh) {
            let message = "`stale` says what is done with a value that is not fresh";
            let help = "add the age up to which it is: `fresh 100ms;`";
            report(Diagnostic::error("bad-qos", at, message), help);
        }
        if let (Some(at), true) = (span("fresh"), read.in_place) {
            let message = "a value in place is not kept, so that it has no age";
            let help = "remove `fresh` or `in_place`";
            report(Diagnostic::error("bad-qos", at, message), help);
        }
        if let (Some(at), Some(cache), Some(fresh)) = (span("cache"), qos.cache, qos.fresh)
            && cache > fresh
        {
            let message = format!(
                "a reply may be {} old, and counts as fresh for {}",
                duration::text_of(cache),
                duration::text_of(fresh)
            );
            let help = "shorten `cache`, or lengthen `fresh`";
            report(Diagnostic::warning("cache-over-fresh", at, message), help);
        }
        let library = &self.library;
        let operations = &library.interface(interface).operations;
        let returns = |o: &&Operation| o.result.is_some() || !o.outputs.is_empty();
        let mut queries = operations.iter().filter(returns);
        if let (Some(at), None, Role::Requires) = (span("cache"), queries.clone().next(), role) {
            let message = format!(
                "`{}` has no query, whose reply could be kept",
                library.interface(interface).name.text
            );
            report(Diagnostic::error("bad-qos", at, message), "remove `cache`");
        }
        if let (Some(at), Role::Implements) = (span(SERVE), role)
            && !queries.any(|o| o.inputs.is_empty())
        {
            let message = format!(
                "`{}` has no query without parameters, whose last result could answer",
                library.interface(interface).name.text
            );
            report(Diagnostic::error("bad-qos", at, message), "remove `serve`");
        }
    }

    /// Reports an interface without any query.
    fn check_asynchronous(&mut self, interface: InterfaceId, value: &Literal) {
        let interface = self.library.interface(interface);
        if !interface.operations.iter().any(Operation::has_result) {
            let message = format!(
                "`{}` has no query, whose end could come later",
                interface.name.text
            );
            let help = "remove this setting: a command never waits for its server";
            self.found
                .push(Diagnostic::error("bad-qos", value.span, message).help(help));
        }
    }

    /// Reports an interface without any operation whose values can travel in place.
    fn check_in_place(&mut self, role: Role, interface: InterfaceId, value: &Literal) {
        let interface = self.library.interface(interface);
        let mut operations = interface.operations.iter();
        let any = operations.any(|operation| {
            let in_place = match role {
                Role::SubscribesTo => operation.topic_in_place(&self.library),
                Role::Implements | Role::Requires | Role::Publishes => {
                    operation.result_in_place(&self.library)
                }
            };
            in_place.is_some()
        });
        if !any {
            let what = match role {
                Role::SubscribesTo => "parameter",
                Role::Implements | Role::Requires | Role::Publishes => "result",
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
