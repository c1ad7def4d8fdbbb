//! `rcdeploy call` and `send`.

use super::look::look;
use super::messages::{interrupts, is_interrupted};
use super::output::{Failure, print_data, print_line, print_note, system};
use rc_deploy_client::Format;
use rc_observe::{Answer, Sender};
use rc_values::{Struct, Style, Value, from_json};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Reads the JSON of a command line.
fn parameters(ty: &Arc<Struct>, text: &str) -> Result<Value, Failure> {
    // The error says at which line and column.
    let json = rc_values::json_of_person(text)
        .map_err(|error| Failure(1, format!("the value is no JSON: {error}")))?;
    from_json(ty, &json).map_err(|error| Failure(1, error.to_string()))
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
    let json = |value: &Value| serde_json::to_string(value).map_err(|e| system(&e));
    match (&answer, format) {
        (Answer::Result(value), Format::Json) => {
            print_data(&format!("{{\"result\":{}}}\n", json(value)?));
        }
        (Answer::Result(Value::Struct(_, members)), Format::Human) if members.is_empty() => {}
        (Answer::Result(value), Format::Human) => {
            print_line(format_args!("{}", value.text(&whole()).trim_end()));
        }
        (Answer::Exception(value), Format::Json) => {
            let name = serde_json::to_string(&name(value)).map_err(|e| system(&e))?;
            let value = json(value)?;
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
    match value {
        Value::Struct(ty, _) => rc_diagnostics::foreign::clean(&ty.name),
        _ => String::new(),
    }
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
