//! `rcdeploy call` and `send`.

use super::look::look;
use super::messages::{interrupts, is_interrupted};
use super::output::{Failure, json_text, print_data, print_line, print_note};
use rc_deploy_client::Format;
use rc_diagnostics::{SourceMap, Span, stray_character};
use rc_observe::{Answer, Sender};
use rc_values::{Struct, Style, Value, from_json};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Reads the JSON of a command line.
fn parameters(ty: &Arc<Struct>, text: &str) -> Result<Value, Failure> {
    // The error says at which line and column.
    let json = rc_values::json_of_person(text).map_err(|error| {
        let reason = stray(text).unwrap_or_else(|| error.to_string());
        Failure(1, format!("the value is not JSON: {reason}"))
    })?;
    from_json(ty, &json).map_err(|error| Failure(1, error.to_string()))
}

/// The first character outside the strings of a text that a reader does not see or takes for
/// another one, with its place.
fn stray(text: &str) -> Option<String> {
    let mut sources = SourceMap::new();
    let source = sources.add("", text);
    let (mut in_string, mut is_escaped) = (false, false);
    for (at, c) in text.char_indices() {
        let ends = c == '"' && !is_escaped;
        is_escaped = in_string && c == '\\' && !is_escaped;
        in_string ^= ends;
        let span = Span::new(source, at, at + c.len_utf8());
        if let Some(found) = stray_character(c, span).filter(|_| !in_string) {
            let place = sources.position(source, at);
            let help = found.help.unwrap_or_default();
            let (message, line, column) = (found.message, place.line, place.column);
            return Some(format!("{message} at line {line} column {column}; {help}"));
        }
    }
    None
}

/// `rcdeploy call`.
pub(super) fn call(
    network: &str,
    wanted: &str,
    json: &str,
    timeout: f64,
    format: Format,
) -> Result<u8, Failure> {
    let network = look(network)?;
    let operation = network.operation(wanted)?;
    let parameters = parameters(&operation.operation.request, json)?;
    let limit = Duration::from_secs_f64(timeout);
    let answer = rc_observe::call(&network.name, &operation, &parameters, limit)?;
    match (&answer, format) {
        (Answer::Result(value), Format::Json) => {
            print_data(&format!("{{\"result\":{}}}\n", json_text(value)?));
        }
        (Answer::Result(Value::Struct(_, members)), Format::Human) if members.is_empty() => {}
        (Answer::Result(value), Format::Human) => {
            print_line(format_args!("{}", value.text(&whole()).trim_end()));
        }
        (Answer::Exception(value), Format::Json) => {
            let name = json_text(&name(value))?;
            let value = json_text(value)?;
            print_data(&format!("{{\"exception\":{name},\"value\":{value}}}\n"));
        }
        (Answer::Exception(value), Format::Human) => {
            print_line(format_args!("exception {}", name(value)));
            print_line(format_args!("{}", value.text(&whole()).trim_end()));
        }
    }
    Ok(match answer {
        Answer::Result(_) => 0,
        Answer::Exception(_) => 1,
    })
}

fn whole() -> Style {
    Style {
        elements: 64,
        ..Style::default()
    }
}

/// The type of an exception.
fn name(value: &Value) -> String {
    let Value::Struct(ty, _) = value else {
        return String::new();
    };
    rc_diagnostics::foreign::clean(&ty.name)
}

/// `rcdeploy send`.
pub(super) fn send(
    network: &str,
    wanted: &str,
    json: &str,
    rate: Option<f64>,
    count: Option<u64>,
) -> Result<u8, Failure> {
    let interrupts = interrupts()?;
    let network = look(network)?;
    let topic = network.topic(wanted)?;
    let value = parameters(&topic.operation.request, json)?;
    let mut sender = Sender::open(&network, &topic)?;
    if sender.subscribers() == 0 {
        print_note(&format!("no component subscribes to {}", topic.address));
    }
    let count = count.or(rate.is_none().then_some(1));
    let pause = Duration::from_secs_f64(rate.map_or(0.0, |rate| 1.0 / rate));
    let (mut sent, mut next) = (0, Instant::now());
    while count.is_none_or(|count| sent < count) && !is_interrupted(&interrupts) {
        let left = next.saturating_duration_since(Instant::now());
        if !left.is_zero() {
            rc_middleware::wait(&[std::os::fd::AsFd::as_fd(&interrupts)], left);
            continue;
        }
        sender.send(&value)?;
        sent += 1;
        // A pause that was too long is not made up for.
        next = (next + pause).max(Instant::now());
    }
    sender.finish();
    Ok(0)
}

#[cfg(test)]
mod tests {
    use super::stray;

    #[test]
    fn characters_that_nobody_sees_are_named_in_json() {
        for (text, wanted) in [
            (
                "{\u{a0}\"a\": 1}",
                "U+00A0 (a no-break space) at line 1 column 2; ",
            ),
            (
                "{\"ü\"\u{200b}: 1}",
                "U+200B (a zero-width space) at line 1 column 5; ",
            ),
            (
                "{\n\u{201c}a\": 1}",
                "U+201C (a typographic quote) at line 2 column 1; write `\"`",
            ),
        ] {
            let found = stray(text).unwrap_or_default();
            assert!(found.contains(wanted), "{found}");
        }
        // Strings may have them.
        assert_eq!(stray("{\"\\\"\u{a0}\u{201c}\": 010}"), None);
    }
}
