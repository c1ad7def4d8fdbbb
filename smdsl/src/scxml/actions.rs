//! Executable content and conditions.

use super::ScxmlReader;
use crate::model::{Action, Condition};
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::Name;
use roxmltree::Node;
use std::time::Duration;

/// The longest delay of a `send`.
const MAX_DELAY: Duration = Duration::from_hours(365 * 24);

/// The form of the name of a worker's function.
const FUNCTION_HELP: &str = "name a function, such as `battery_low`, and write it in the worker";

impl ScxmlReader<'_> {
    /// The actions in an element.
    pub(super) fn actions(&mut self, node: Node<'_, '_>) -> Vec<Action> {
        let mut actions = Vec::new();
        for (name, child) in self.children(node) {
            self.children(child);
            actions.extend(match name {
                "log" => Some(Action::Log {
                    label: self.text.attribute(child, "label"),
                    expr: self.text.attribute(child, "expr"),
                }),
                "send" => self.send(child),
                "cancel" => self.needed(child, "sendid").map(Action::Cancel),
                "script" => self.call(child),
                _ => self.event(child).map(Action::Raise),
            });
        }
        actions
    }

    /// An attribute without which the element has no meaning.
    fn needed(&mut self, node: Node<'_, '_>, attribute: &str) -> Option<Name> {
        let found = self.text.attribute(node, attribute);
        if found.is_none() {
            let element = node.tag_name().name();
            let message = format!("`{element}` has no `{attribute}`");
            self.missing(self.text.tag(node), &message);
        }
        found
    }

    /// The event of a `raise` or a `send`.
    fn event(&mut self, node: Node<'_, '_>) -> Option<Name> {
        let event = self.needed(node, "event")?;
        let names = self.names(&event, "an event");
        let wrong = names.len() > 1 || names.iter().any(|name| name.text.contains('*'));
        if wrong {
            let message = "expected the name of one event";
            self.builder.error("bad-attribute", event.span, message);
        }
        names.into_iter().next().filter(|_| !wrong)
    }

    fn send(&mut self, node: Node<'_, '_>) -> Option<Action> {
        let event = self.event(node)?;
        let delay = self.text.attribute(node, "delay");
        let id = self.text.attribute(node, "id");
        let written = delay.as_ref().map(|delay| delay.span);
        let delay = match delay.map(|delay| (seconds(&delay.text), delay.span)) {
            None => Duration::ZERO,
            Some((Some(delay), _)) => delay,
            Some((None, span)) => {
                let message = "expected a time such as `1.5s` or `200ms`, at most a year";
                self.builder.error("bad-attribute", span, message);
                Duration::ZERO
            }
        };
        match self.text.attribute(node, "target") {
            None => Some(Action::Send { event, delay, id }),
            Some(target) if target.text == "#_internal" => {
                if let Some(span) = written.filter(|_| !delay.is_zero()) {
                    let message = "an internal event cannot be delayed";
                    self.builder.error("bad-attribute", span, message);
                }
                Some(Action::Raise(event))
            }
            Some(target) => {
                let message = format!("events for `{}` are not supported", target.text);
                let diagnostic = Diagnostic::error("scxml-not-supported", target.span, message);
                let help = "remove `target`, so that the machine sends the event to itself; \
                            call other components in a function of the worker";
                self.builder.found.push(diagnostic.help(help));
                None
            }
        }
    }

    /// `<script>name</script>`
    fn call(&mut self, node: Node<'_, '_>) -> Option<Action> {
        let text = node.text().unwrap_or_default();
        let place = node.children().find(Node::is_text);
        let span = place.and_then(|text| self.text.words(text));
        let span = span.unwrap_or_else(|| self.text.tag(node));
        self.function(text.trim(), span).map(Action::Call)
    }

    fn function(&mut self, text: &str, span: Span) -> Option<Name> {
        if is_function(text) {
            return Some(Name::new(text, span));
        }
        let message = "expected the name of a function; scripts are not evaluated";
        let diagnostic = Diagnostic::error("scxml-expression", span, message);
        self.builder.found.push(diagnostic.help(FUNCTION_HELP));
        None
    }

    /// The condition of a transition: the name of a function, or `In('state')`.
    pub(super) fn condition(&mut self, cond: Name) -> Option<Condition> {
        let text = cond.text.trim();
        let state = text
            .strip_prefix("In(")
            .and_then(|rest| rest.strip_suffix(')'));
        if let Some(state) = state.map(str::trim).and_then(quoted) {
            let name = Name::new(state, cond.span);
            let id = self.builder.find(&name)?;
            return Some(Condition::In(id, cond));
        }
        if is_function(text) {
            return Some(Condition::Guard(Name::new(text, cond.span)));
        }
        let message = format!("`{text}` is neither a function nor `In('state')`");
        let diagnostic = Diagnostic::error("scxml-expression", cond.span, message);
        let help = if matches!(text, "true" | "false") {
            "remove `cond`, or the transition".to_owned()
        } else {
            format!("expressions are not evaluated: {FUNCTION_HELP}")
        };
        self.builder.found.push(diagnostic.help(help));
        None
    }
}

/// Whether a text is a name that a function can have.
fn is_function(text: &str) -> bool {
    let follows = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(follows)
        && !matches!(text, "true" | "false")
}

/// The text between quotes.
fn quoted(text: &str) -> Option<&str> {
    let inside = |quote: char| text.strip_prefix(quote)?.strip_suffix(quote);
    inside('\'').or_else(|| inside('"'))
}

/// A time of CSS 2, which SCXML uses: `1.5s`, `.5s`, `200ms`.
fn seconds(text: &str) -> Option<Duration> {
    let (number, unit) = match text.strip_suffix("ms") {
        Some(number) => (number, 1e-3),
        None => (text.strip_suffix('s')?, 1.0),
    };
    if !number.chars().all(|c| c.is_ascii_digit() || c == '.') {
        return None;
    }
    let delay = Duration::try_from_secs_f64(number.parse::<f64>().ok()? * unit).ok()?;
    (delay <= MAX_DELAY).then_some(delay)
}
