//! The settings of a slot: quality of service, timeouts, wake-up.

use crate::ast::Setting;
use crate::model::{Qos, Role, SPIN};
use crate::resolver::Resolver;
use rc_diagnostics::Diagnostic;
use rc_idsl::model::InterfaceId;
use rc_syntax::{Literal, LiteralKind};
use rc_vocabulary::duration;
use std::collections::HashMap;
use std::time::Duration;

/// The setting of a slot whose handlers receive or write values in shared memory.
const IN_PLACE: &str = "in_place";

impl Resolver<'_> {
    /// Reads the settings of a slot. Reports invalid ones.
    pub(crate) fn qos(&mut self, role: Role, interface: InterfaceId, settings: &[Setting]) -> Qos {
        const TOPIC: [&str; 8] = [
            "reliability",
            "depth",
            "durability",
            "deadline",
            "lifespan",
            "liveliness",
            "wake",
            IN_PLACE,
        ];
        const CALL: [&str; 3] = ["timeout", "wake", IN_PLACE];
        // Publishers and clients choose `in_place` at each call. Publishers never wait, so they
        // have no `wake`.
        let allowed = match role {
            Role::SubscribesTo => &TOPIC[..],
            Role::Publishes => &TOPIC[..6],
            Role::Implements => &CALL[..],
            Role::Requires => &CALL[..2],
        };
        let mut qos = Qos::default();
        let mut seen = HashMap::new();
        for Setting { name, value, spin } in settings {
            self.check_unique(&mut seen, name, "setting");
            if !allowed.contains(&name.text.as_str()) {
                let message = format!("`{}` has no setting `{}`", role.word(), name.text);
                let diagnostic = Diagnostic::error("unknown-qos", name.span, message);
                self.found
                    .push(diagnostic.suggest(&name.text, allowed.iter().copied()));
                continue;
            }
            let word = match &value.kind {
                LiteralKind::Name(word) => word.as_str(),
                _ => "",
            };
            let wakes = name.text == "wake";
            let time = value
                .as_nanoseconds()
                .filter(|ns| *ns > 0)
                .map(Duration::from_nanos);
            let is_valid = match name.text.as_str() {
                _ if *spin != wakes => false,
                "wake" => assign(&mut qos.spin, time.filter(|time| SPIN.contains(time))),
                "reliability" => {
                    qos.reliable = parse_choice(word, "best_effort", "reliable");
                    qos.reliable.is_some()
                }
                "durability" => {
                    qos.transient_local = parse_choice(word, "volatile", "transient_local");
                    qos.transient_local.is_some()
                }
                "depth" => {
                    qos.depth = value
                        .as_i64()
                        .filter(|d| (1..=1000).contains(d))
                        .map(|d| d as u32);
                    qos.depth.is_some()
                }
                IN_PLACE => {
                    let choice = match value.kind {
                        LiteralKind::Bool(choice) => Some(choice),
                        _ => None,
                    };
                    qos.in_place = choice == Some(true);
                    if qos.in_place {
                        self.check_in_place(role, interface, value);
                    }
                    choice.is_some()
                }
                "timeout" => assign(&mut qos.timeout, time),
                "deadline" => assign(&mut qos.deadline, time),
                "lifespan" => assign(&mut qos.lifespan, time),
                _ => assign(&mut qos.liveliness, time),
            };
            if !is_valid {
                let allowed = match name.text.as_str() {
                    "reliability" => "`reliable` or `best_effort`",
                    "durability" => "`volatile` or `transient_local`",
                    "depth" => "an integer from 1 to 1000",
                    "wake" => "`spin` and a duration from 1us to 10ms",
                    IN_PLACE => "`true` or `false`",
                    _ => "a duration such as `500ms`",
                };
                let written = match value.as_nanoseconds() {
                    Some(ns) if *spin => format!("`spin {}`", duration::text(ns)),
                    _ if *spin => format!("`spin` with {}", value.described()),
                    _ => value.described(),
                };
                let message = format!(
                    "invalid value of `{}`: expected {allowed}, found {written}",
                    name.text
                );
                self.found
                    .push(Diagnostic::error("bad-qos", value.span, message));
            }
        }
        qos
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

fn assign(field: &mut Option<Duration>, value: Option<Duration>) -> bool {
    *field = value;
    value.is_some()
}

fn parse_choice(word: &str, no: &str, yes: &str) -> Option<bool> {
    if word == yes {
        Some(true)
    } else {
        (word == no).then_some(false)
    }
}
