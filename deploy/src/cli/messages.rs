//! `rcdeploy echo`: the messages of a topic or of calls. Other commands watch as it does.

use super::look::look;
use super::output::{Failure, print_note, system, visible};
use crate::cli::arguments::TopicArguments;
use rc_deploy_client::Format;
use rc_diagnostics::foreign::clean;
use rc_management::event::time_text;
use rc_middleware::{Reader, rpc};
use rc_observe::{
    End, Error, MessageKind, Network, Observed, Observer, Operation, Processes, SendingClock,
    Source,
};
use rc_record::bag::seconds;
use rc_record::meaning::Converter;
use rc_record::{RecordError, system_time};
use rc_values::{Columns, Style, Value, decode_from};
use serde_json::json;
use std::io::Write;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant, SystemTime};

/// How long a finite command waits for the next message.
const PATIENCE: Duration = Duration::from_secs(10);
/// After how much silence the command looks whether components were restarted.
const SILENCE: Duration = Duration::from_secs(2);
/// The longest wait.
const TURN: Duration = Duration::from_millis(100);
/// How many calls wait for their replies, to show the operation of a reply.
const CALLS: usize = 1024;

/// The signals that end a command: Ctrl-C and its kin.
pub(super) const ENDS: [i32; 3] = [
    signal_hook::consts::SIGINT,
    signal_hook::consts::SIGTERM,
    signal_hook::consts::SIGHUP,
];

/// Becomes readable at Ctrl-C.
pub(super) fn interrupts() -> Result<UnixStream, Failure> {
    signals(&ENDS)
}

/// Lets the second Ctrl-C end the process at once: its output may be blocked. Not for a command
/// that has something to finish.
fn end_at_second_interrupt() -> Result<(), Failure> {
    let first = Arc::new(AtomicBool::new(false));
    for signal in ENDS {
        // Actions run in the order in which they were registered.
        signal_hook::flag::register_conditional_default(signal, Arc::clone(&first))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&first)))
            .map_err(|e| system(&e))?;
    }
    Ok(())
}

/// Becomes readable at these signals.
pub(super) fn signals(signals: &[i32]) -> Result<UnixStream, Failure> {
    let (read, write) = UnixStream::pair().map_err(|e| system(&e))?;
    read.set_nonblocking(true).map_err(|e| system(&e))?;
    for signal in signals {
        let write = write.try_clone().map_err(|e| system(&e))?;
        signal_hook::low_level::pipe::register(*signal, write).map_err(|e| system(&e))?;
    }
    Ok(read)
}

pub(super) fn is_interrupted(mut interrupts: &UnixStream) -> bool {
    use std::io::Read as _;
    interrupts.read(&mut [0; 16]).is_ok()
}

/// The senders of a source, for messages.
fn senders(source: &Source) -> String {
    match source {
        Source::Topic(topic) if topic.publishers.is_empty() => {
            format!("no component publishes {}", topic.address)
        }
        Source::Topic(topic) => {
            let ends: Vec<String> = topic.publishers.iter().map(ToString::to_string).collect();
            format!("{} has sent nothing yet", ends.join(", "))
        }
        Source::Calls(operation) => format!("no call of {} yet", operation.name()),
    }
}

/// Hands messages to `take` until it returns false, Ctrl-C or the end of patience.
pub(super) fn watch(
    watched: &TopicArguments,
    finite: bool,
    mut take: impl FnMut(&Source, &Observed<'_>) -> Result<bool, Failure>,
    mut turn: impl FnMut(&Source) -> Result<bool, Failure>,
) -> Result<u8, Failure> {
    end_at_second_interrupt()?;
    let interrupts = interrupts()?;
    let network = look(&watched.network)?;
    let mut processes = Processes::of(&network);
    let mut source = Source::find(&network, &watched.topic)?;
    let mut observer = Observer::new(&network)?;
    let mut feed = source.open(&mut observer)?;
    let patience = watched.timeout.map(Duration::from_secs_f64);
    let patience = patience.or(finite.then_some(PATIENCE));
    let (mut heard, mut looked, mut noted) = (Instant::now(), Instant::now(), false);
    loop {
        if is_interrupted(&interrupts) {
            return Ok(0);
        }
        let mut outcome = Ok(true);
        let more = observer.take(&mut |_, observed| {
            heard = Instant::now();
            if matches!(outcome, Ok(true)) {
                outcome = take(&source, &observed);
            }
        });
        if !outcome? || !turn(&source)? {
            return Ok(0);
        }
        for error in observer.errors(feed) {
            print_note(&error);
        }
        let lost = observer.lost(feed);
        if lost > 0 {
            print_note(&format_args!("{lost} messages were lost"));
        }
        let silent = heard.elapsed();
        if let Some(limit) = patience.filter(|limit| silent >= *limit) {
            let senders = senders(&source);
            return Err(Failure(3, format!("no message for {limit:?}: {senders}")));
        }
        if silent >= SILENCE && looked.elapsed() >= SILENCE {
            looked = Instant::now();
            if !noted {
                print_note(&senders(&source));
                noted = true;
            }
            // A component that was restarted may have joined another shared memory.
            let Ok(now) = Network::look(&network.name) else {
                continue;
            };
            if Processes::of(&now) != processes || observer.has_ended(feed) {
                let again = Source::find(&now, &watched.topic).and_then(|found| {
                    let mut observer = Observer::new(&now)?;
                    let feed = found.open(&mut observer)?;
                    Ok((observer, feed, found))
                });
                // If it is not back yet, the next look finds it.
                if let Ok(again) = again {
                    (observer, feed, source) = again;
                    processes = Processes::of(&now);
                }
            }
        }
        if !more {
            observer.wait(&[interrupts.as_fd()], TURN);
        }
    }
}

/// Output of `echo`.
pub(super) struct Echo {
    pub(super) fields: Vec<String>,
    pub(super) count: Option<u64>,
    pub(super) rate: Option<f64>,
    pub(super) csv: bool,
    pub(super) meaning: Option<Converter>,
}

/// One message, decoded.
struct Decoded {
    kind: &'static str,
    operation: String,
    /// Name of the sender, for people.
    sender: String,
    value: Value,
}

/// The times of the system at which a message was received and sent, in nanoseconds since 1970.
struct Times {
    received: u64,
    sent: u64,
}

impl Times {
    /// The time of sending is that of the arrival if the sender's clock is another one.
    fn of(source: &Source, observed: &Observed<'_>) -> Self {
        let received = system_time();
        let sent = observed.header.sent;
        let is_known = sent > 0 && source.sending_clock() == SendingClock::Here;
        let age = rc_middleware::now().saturating_sub(sent);
        Self {
            received,
            sent: if is_known {
                received.saturating_sub(age)
            } else {
                received
            },
        }
    }
}

/// The ends that may have sent a message, and what distinguishes senders.
fn sender(ends: &[End], id: u128) -> String {
    let names: Vec<String> = ends.iter().map(|end| clean(&end.to_string())).collect();
    let names = match names.as_slice() {
        [] => "another program".to_owned(),
        names => names.join(" or "),
    };
    if id == 0 {
        return names;
    }
    // Senders may differ in any part of it.
    let id = (id ^ (id >> 32) ^ (id >> 64) ^ (id >> 96)) as u32;
    format!("{names} [{id:08x}]")
}

/// `rcdeploy echo`.
pub(super) fn echo(watched: &TopicArguments, echo: &Echo) -> Result<u8, Failure> {
    let mut out = rc_diagnostics::print::output();
    let pause = echo.rate.map(|rate| Duration::from_secs_f64(1.0 / rate));
    let (mut shown, mut printed): (u64, Option<Instant>) = (0, None);
    let mut lost = 0;
    let mut calls = Calls::default();
    let mut columns = None;
    let take = |source: &Source, observed: &Observed<'_>| {
        lost += observed.lost;
        if echo.csv && echo.fields.is_empty() && matches!(source, Source::Calls(_)) {
            return Err(Failure(
                2,
                "a request has other columns than its reply; choose one with --field".to_owned(),
            ));
        }
        let decoded = match source {
            Source::Topic(topic) => topic.decode(observed).map(|value| {
                Some(Decoded {
                    kind: "sample",
                    operation: topic.operation.name.clone(),
                    sender: sender(&topic.publishers, observed.header.sender),
                    value,
                })
            }),
            Source::Calls(operation) => calls.decode(operation, observed),
        };
        let mut decoded = match decoded {
            Ok(Some(decoded)) => decoded,
            Ok(None) => return Ok(true),
            Err(error) => {
                print_note(&format!("a message cannot be decoded: {error}"));
                return Ok(true);
            }
        };
        if let Some(meaning) = &echo.meaning {
            match converted(meaning, decoded.value)? {
                Ok(value) => decoded.value = value,
                Err(error) => {
                    print_note(&format!("a message cannot be converted: {error}"));
                    return Ok(true);
                }
            }
        }
        // A request has other members than its reply.
        let is_call = matches!(source, Source::Calls(_));
        if is_call
            && echo
                .fields
                .iter()
                .any(|path| decoded.value.field(path).is_err())
        {
            return Ok(true);
        }
        if pause.is_some_and(|pause| printed.is_some_and(|at| at.elapsed() < pause)) {
            return Ok(true);
        }
        printed = Some(Instant::now());
        let times = Times::of(source, observed);
        let text = if echo.csv {
            csv(echo, &times, &decoded, &mut columns)?
        } else {
            one(echo, watched.format, observed, &times, &decoded, lost)?
        };
        lost = 0;
        shown += 1;
        // A closed pipe ends the command.
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        Ok(written.is_ok() && echo.count.is_none_or(|count| shown < count))
    };
    watch(watched, echo.count.is_some(), take, |_| Ok(true))
}

/// A value as the wanted prototype. The inner error is about this value, the outer one about its
/// type.
fn converted(meaning: &Converter, value: Value) -> Result<Result<Value, RecordError>, RecordError> {
    if let Value::Struct(ty, _) = &value
        && !meaning.converts(ty)
    {
        return Err(meaning.no_conversion_error(ty));
    }
    Ok(meaning.value(value))
}

/// The values of the chosen fields, or the whole value.
fn chosen(echo: &Echo, value: &Value) -> Result<Vec<(String, Value)>, Failure> {
    let field = |path: &String| {
        let found = value.field(path);
        let found = found.map_err(|error| Failure(1, format!("--field {path}: {error}")))?;
        Ok((path.clone(), found))
    };
    echo.fields.iter().map(field).collect()
}

fn one(
    echo: &Echo,
    format: Format,
    observed: &Observed<'_>,
    times: &Times,
    decoded: &Decoded,
    lost: u64,
) -> Result<String, Failure> {
    let chosen = chosen(echo, &decoded.value)?;
    let kind = decoded.kind;
    if format == Format::Json {
        let mut object = json!({
            "kind": kind,
            "operation": decoded.operation,
            "sequence": observed.header.sequence,
            "sent_ns": observed.header.sent,
            "log_time": seconds(times.received),
            "publish_time": seconds(times.sent),
            "sender": decoded.sender,
            "lost": lost,
        });
        object["value"] = if chosen.is_empty() {
            json!(decoded.value)
        } else {
            let fields = chosen
                .iter()
                .map(|(path, value)| (path.clone(), json!(value)));
            serde_json::Value::Object(fields.collect())
        };
        // The members of a value keep their order in a text of its own.
        let mut text = object.to_string();
        if chosen.is_empty() {
            object["value"] = serde_json::Value::Null;
            let value = serde_json::to_string(&decoded.value).map_err(|e| system(&e))?;
            text = object
                .to_string()
                .replacen("\"value\":null", &format!("\"value\":{value}"), 1);
        }
        return Ok(visible(text) + "\n");
    }
    let style = Style::default();
    let mut text = String::new();
    if lost > 0 {
        text.push_str(&format!("# {lost} lost\n"));
    }
    let what = if kind == "sample" {
        String::new()
    } else {
        format!("{kind} {} ", clean(&decoded.operation))
    };
    if echo.fields.is_empty() || !what.is_empty() {
        let sent = SystemTime::UNIX_EPOCH + Duration::from_nanos(times.sent);
        text.push_str(&format!(
            "# {what}{} from {}\n",
            time_text(sent),
            decoded.sender
        ));
    }
    match chosen.as_slice() {
        [] => text.push_str(&decoded.value.text(&style)),
        [(_, value)] => text.push_str(value.text(&style).trim_start_matches('\n')),
        many => {
            for (path, value) in many {
                text.push_str(&format!("{path}: {}", value.text(&style)));
            }
        }
    }
    if echo.fields.is_empty() {
        text.push_str("---\n");
    }
    Ok(text)
}

/// The value that a recording holds: the only structure of a topic is its message.
fn message(decoded: &Decoded) -> &Value {
    if decoded.kind == "sample"
        && let Some([only @ Value::Struct(..)]) = decoded.value.members()
    {
        return only;
    }
    &decoded.value
}

/// A line of CSV; the first one names the columns, as in the tables of a recording.
fn csv(
    echo: &Echo,
    times: &Times,
    decoded: &Decoded,
    columns: &mut Option<Columns>,
) -> Result<String, Failure> {
    let mut values = chosen(echo, &decoded.value)?;
    if values.is_empty() {
        values.push((String::new(), message(decoded).clone()));
    }
    let mut header = String::new();
    let columns = columns.get_or_insert_with(|| {
        let mut columns = Columns::new("log_time_s,publish_time_s");
        columns.add(&values);
        header = columns.header();
        columns
    });
    if let Some(name) = columns.missing(&values) {
        print_note(&format_args!(
            "the first message has no {}, so the table has no such column; choose it with --field",
            clean(&name)
        ));
    }
    let times = [times.received, times.sent].map(seconds);
    Ok(header + &columns.row(&times.join(","), &values))
}

/// The calls whose replies have not come.
#[derive(Default)]
struct Calls(Vec<rpc::RequestId>);

impl Calls {
    /// Decodes a request or a reply of an operation; none for another one of its slot.
    fn decode(
        &mut self,
        operation: &Operation,
        observed: &Observed<'_>,
    ) -> Result<Option<Decoded>, Error> {
        let of = &operation.operation;
        let wrong =
            |error: rc_middleware::DecodeError| Error::Value(rc_values::ValueError::from(error));
        let mut reader = Reader::new(observed.body);
        let caller = rpc::request_id(observed.body);
        let caller = caller.map_or(0, |id| u128::from_be_bytes(id.writer));
        let decoded = |kind, value| {
            let sender = match kind {
                "request" => sender(&operation.clients, caller),
                _ => format!(
                    "{} to {}",
                    sender(std::slice::from_ref(&operation.server), 0),
                    sender(&operation.clients, caller)
                ),
            };
            Ok(Some(Decoded {
                kind,
                operation: of.name.clone(),
                sender,
                value,
            }))
        };
        if observed.kind == MessageKind::Request {
            let (id, found) = rpc::open_request(&mut reader).map_err(wrong)?;
            if found != of.id {
                return Ok(None);
            }
            if self.0.len() >= CALLS {
                self.0.remove(0);
            }
            self.0.push(id);
            rpc::open_body(&mut reader, observed.profile);
            return decoded("request", decode_from(&of.request, &mut reader)?);
        }
        let id = rpc::request_id(observed.body);
        let Some(at) = self.0.iter().position(|known| Some(*known) == id) else {
            return Ok(None);
        };
        self.0.remove(at);
        let (_, kind) = rpc::open_reply(&mut reader, of.id).map_err(wrong)?;
        let refused = |reason: String| {
            Err(Error::Refused {
                operation: of.name.clone(),
                reason,
            })
        };
        match kind {
            rpc::ReplyKind::Case(_) if observed.profile == rc_middleware::Profile::Bare => {
                rpc::open_body(&mut reader, observed.profile);
                ros_reply(of, &mut reader).and_then(|(kind, value)| decoded(kind, value))
            }
            rpc::ReplyKind::Case(0)
                if observed.header.encoding == rc_middleware::Encoding::Image =>
            {
                let image = observed
                    .body
                    .get(rc_middleware::in_place::BEHIND_ENVELOPE..);
                let value = rc_values::decode_image(&of.reply, image.unwrap_or_default())?;
                decoded("reply", value)
            }
            rpc::ReplyKind::Case(0) => decoded("reply", decode_from(&of.reply, &mut reader)?),
            rpc::ReplyKind::Case(case) => match of.throws.iter().find(|e| e.id == case) {
                Some(exception) => decoded("exception", decode_from(&exception.ty, &mut reader)?),
                None => refused(format!("an unknown exception, {case}")),
            },
            rpc::ReplyKind::Refused(reason) => refused(reason),
            rpc::ReplyKind::Unavailable(state) => refused(rpc::not_served_in(&state)),
        }
    }
}

/// A reply in ROS 2: where the operation throws, a code, all exceptions and the result.
fn ros_reply(
    of: &rc_values::Operation,
    reader: &mut Reader<'_>,
) -> Result<(&'static str, Value), Error> {
    let wrong =
        |error: rc_middleware::DecodeError| Error::Value(rc_values::ValueError::from(error));
    if of.throws.is_empty() {
        return Ok(("reply", decode_from(&of.reply, reader)?));
    }
    let code: i32 = reader.get().map_err(wrong)?;
    for (at, exception) in of.throws.iter().enumerate() {
        let value = decode_from(&exception.ty, reader)?;
        if i32::try_from(at + 1) == Ok(code) {
            return Ok(("exception", value));
        }
    }
    Ok(("reply", decode_from(&of.reply, reader)?))
}
