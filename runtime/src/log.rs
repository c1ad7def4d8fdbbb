//! The log of a component, and its other output.

use crate::error::StartError;
use rc_middleware::{LogLevel, LogLine, LogQueue};
use std::fmt::{self, Write as _};
use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;
use std::time::SystemTime;
use tracing::field::{Field, Visit};
use tracing::subscriber::DefaultGuard;
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::MakeWriter;
use tracing_subscriber::fmt::writer::BoxMakeWriter;
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

/// Where the log of a component is printed.
pub(crate) enum Output {
    /// To standard error, from all threads of the process. A second component of one process, as in
    /// tests, uses the log of the first.
    Process,
    /// From the threads of this component alone.
    Component(ComponentOutput),
}

/// Where the log of one of several components of a process is printed.
#[derive(Clone, Debug)]
pub(crate) enum ComponentOutput {
    /// A file of its own, or a pipe.
    File(Arc<File>),
    /// Standard error, each line with this name.
    Named(Arc<str>),
}

impl Write for &ComponentOutput {
    /// Writes all of it. The subscriber hands over whole messages.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            ComponentOutput::File(file) => (&**file).write_all(bytes)?,
            ComponentOutput::Named(name) => {
                let text = String::from_utf8_lossy(bytes);
                let lines = text.lines().map(|line| format!("{name} | {line}\n"));
                let text: String = lines.collect();
                io::stderr().write_all(text.as_bytes())?;
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for ComponentOutput {
    type Writer = &'a Self;

    fn make_writer(&'a self) -> Self::Writer {
        self
    }
}

/// The log of a component, as long as this lives on the thread that started it.
pub(crate) struct Log {
    /// The messages, for its middlewares. `None` if it uses the log of another component.
    pub(crate) queue: Option<Arc<LogQueue>>,
    _scope: Option<DefaultGuard>,
}

/// Sends the log, with messages of this level and above, to the output if it `prints`, and to the
/// queue that it returns. Without a level, `RUST_LOG` holds.
pub(crate) fn start(level: Option<&str>, prints: bool, output: &Output) -> Result<Log, StartError> {
    let filter = match level {
        Some(level) => Targets::new().with_default(parse(level)?),
        None => environment(),
    };
    let writer = match output {
        Output::Process => BoxMakeWriter::new(io::stderr),
        Output::Component(output) => BoxMakeWriter::new(output.clone()),
    };
    let printed = prints.then(|| {
        tracing_subscriber::fmt::layer()
            .with_target(false)
            .with_ansi(false)
            // A line that cannot be written is lost; an error message about it on the same stream
            // would panic.
            .log_internal_errors(false)
            .with_writer(writer)
    });
    let queue = Arc::new(LogQueue::default());
    let subscriber = tracing_subscriber::registry()
        .with(filter)
        .with(printed)
        .with(ToQueue(Arc::clone(&queue)));
    Ok(match output {
        Output::Process => Log {
            queue: subscriber.try_init().is_ok().then_some(queue),
            _scope: None,
        },
        Output::Component(_) => Log {
            queue: Some(queue),
            _scope: Some(subscriber.set_default()),
        },
    })
}

/// Adds messages to a queue.
struct ToQueue(Arc<LogQueue>);

impl<S: Subscriber> Layer<S> for ToQueue {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let metadata = event.metadata();
        let mut text = Text::default();
        event.record(&mut text);
        self.0.push(LogLine {
            time: SystemTime::now(),
            level: match *metadata.level() {
                Level::ERROR => LogLevel::Error,
                Level::WARN => LogLevel::Warn,
                Level::INFO => LogLevel::Info,
                _ => LogLevel::Debug,
            },
            text: text.0,
            file: metadata.file().unwrap_or_default(),
            module: metadata.module_path().unwrap_or_default(),
            line: metadata.line().unwrap_or(0),
        });
    }
}

/// The message of an event, and its other fields as `NAME=VALUE`.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.record_debug(field, &format_args!("{value}"));
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        let blank = if self.0.is_empty() { "" } else { " " };
        let _ = match field.name() {
            "message" => write!(self.0, "{blank}{value:?}"),
            name => write!(self.0, "{blank}{name}={value:?}"),
        };
    }
}

fn parse(level: &str) -> Result<Level, StartError> {
    level.parse().map_err(|_| {
        StartError::Usage(format!(
            "`{level}` is not a log level; there are error, warn, info, debug and trace"
        ))
    })
}

/// Levels from `RUST_LOG`: one, or one for each of some modules. An invalid text is reported, and
/// `info` holds.
fn environment() -> Targets {
    let default = Targets::new().with_default(Level::INFO);
    match std::env::var("RUST_LOG") {
        Ok(text) if !text.trim().is_empty() => text.parse().unwrap_or_else(|_| {
            let expected = "expected a level (debug), or levels of modules (guard=debug,info)";
            print_error(&format!("warning: RUST_LOG has no effect: {expected}\n"));
            default
        }),
        _ => default,
    }
}

/// Prints to standard error, which may be a log on a full disk, where `eprintln!` would panic.
pub(crate) fn print_error(text: &str) {
    let _ = std::io::stderr().write_all(text.as_bytes());
}
