//! A component from its command line to its exit code.

use crate::command_line::{self, Task};
use crate::component::Component;
use crate::configuration;
use crate::description::Description;
use crate::error::StartError;
use crate::exact;
use crate::log::print_error;
use crate::probe;
use crate::stages::{Hosting, Prepared};
use crate::start::Start;
use crate::testing::defaults::DefaultReply;
use rc_diagnostics::print;
use rc_middleware::WakeEvent;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Runs a component with the command line of this process, until it ends. Returns the exit code.
///
/// The `main` of a component is a call of the generated `run`, which calls this function.
pub fn run<C: Component>(description: &'static Description, start: impl Start<C>) -> ExitCode {
    let args = std::env::args_os().skip(1);
    ExitCode::from(run_with(description, start, args, own_program()))
}

/// The executable of this process.
pub(crate) fn own_program() -> PathBuf {
    std::env::current_exe().unwrap_or_default()
}

/// [`run`] with these arguments instead of the command line of this process. `program` repeats an
/// exact recording of the component; it is empty where there is none. Returns the number of the
/// exit code.
pub fn run_with<C: Component>(
    description: &'static Description,
    start: impl Start<C>,
    args: impl IntoIterator<Item = OsString>,
    program: PathBuf,
) -> u8 {
    let task = match command_line::parse(description, args) {
        Ok(task) => task,
        Err(error) => return fail(description.name, &StartError::Usage(error.to_string())),
    };
    // The note must be in the executable, and nothing else refers to it.
    std::hint::black_box(description.note);
    let runs = matches!(task, Task::Run(_));
    let outcome = match task {
        Task::Print(text) => {
            print::data(&text);
            Ok(())
        }
        Task::Check(arguments) => configuration::load(description, &arguments)
            .and_then(|read| configuration::bindings(description, &arguments, &read.configuration))
            .map(|_| print::line(format_args!("{}: ok", description.name))),
        Task::Probe(arguments, wait) => {
            let asked = (&*arguments.network, &*arguments.name);
            let mut code = 0;
            for result in probe::probe(&[asked], wait) {
                print::line(format_args!("{}: {}", arguments.name, result.text()));
                code = result.code();
            }
            return printed(description.name, code);
        }
        Task::Replay(arguments) => exact::run::replay(description, start, &arguments),
        Task::Run(arguments) => WakeEvent::new()
            .map_err(|e| StartError::cannot_create("an event", &e))
            .and_then(|wake_event| {
                let run = || {
                    let hosting = Hosting::Process(program);
                    let prepared = Prepared::new(description, &arguments, wake_event, &hosting)?;
                    prepared.run(start, &[])
                };
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_or_else(|_| {
                    Err(StartError::System("the component panicked".to_owned()))
                })
            }),
    };
    match outcome {
        // The output of a worker does not say how it ended.
        Ok(()) if runs => 0,
        Ok(()) => printed(description.name, 0),
        Err(error) => fail(description.name, &error),
    }
}

/// The exit code if standard output cannot be written.
const REFUSED: u8 = 3;

/// The exit code, which says whether standard output could be written. A closed pipe changes no
/// code: one that is [`REFUSED`] is an answer of `--probe`.
pub(crate) fn printed(name: &str, code: u8) -> u8 {
    let (ended, message) = print::exit_code(code, None, REFUSED);
    if let Some(message) = message {
        print::error(format_args!("{name}: error: {message}"));
    }
    if ended == 0 { code } else { ended }
}

fn fail(name: &str, error: &StartError) -> u8 {
    print_error(&error.report_line(name));
    error.exit_code()
}

/// A component that runs on a thread of this process, for tests.
#[derive(Debug)]
pub struct Embedded {
    wake_event: WakeEvent,
    thread: std::thread::JoinHandle<Result<(), StartError>>,
}

impl Embedded {
    /// Requests the end of the component.
    pub fn stop(&self) {
        self.wake_event.stop();
    }

    /// Whether the component has ended.
    pub fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits until the component ends. It ends after [`Embedded::stop`], or by itself.
    pub fn join(self) -> Result<(), StartError> {
        self.thread
            .join()
            .unwrap_or_else(|_| Err(StartError::System("the component panicked".to_owned())))
    }
}

/// How long an embedded component may take until it runs.
const EMBEDDED_START_LIMIT: Duration = Duration::from_secs(10);

/// Runs a component on a thread of this process, with the command line of its binary and without
/// signals.
///
/// Returns when the component runs. If it does not within ten seconds, it is stopped, and the
/// result is an error.
///
/// ```no_run
/// # fn test<C: rc_runtime::Component + 'static>(
/// #     description: &'static rc_runtime::Description,
/// #     start: fn(rc_runtime::Core, &rc_runtime::Ports, &rc_runtime::Values) -> Result<C, rc_runtime::StartError>,
/// # ) -> Result<(), rc_runtime::StartError> {
/// let component = rc_runtime::embed(description, start, &["--network", "test", "--name", "lidar"])?;
/// component.stop();
/// component.join()
/// # }
/// ```
pub fn embed<C: Component + 'static>(
    description: &'static Description,
    start: impl Start<C> + Send + 'static,
    args: &[&str],
) -> Result<Embedded, StartError> {
    embed_with_defaults(description, start, &[], args)
}

/// [`embed`], but a call that no server takes gets the reply of its slot in `defaults`.
pub fn embed_with_defaults<C: Component + 'static>(
    description: &'static Description,
    start: impl Start<C> + Send + 'static,
    defaults: &'static [(usize, DefaultReply)],
    args: &[&str],
) -> Result<Embedded, StartError> {
    let task = command_line::parse(description, args.iter().map(OsString::from))
        .map_err(|error| StartError::Usage(error.to_string()))?;
    let Task::Run(arguments) = task else {
        return Err(StartError::Usage(format!(
            "{args:?} is not the command line of a run"
        )));
    };
    let wake_event = WakeEvent::new().map_err(|e| StartError::cannot_create("an event", &e))?;
    let clone = wake_event.clone();
    let (running, runs) = sync_channel(1);
    let thread = std::thread::Builder::new().name(arguments.name.clone());
    let thread = thread
        .spawn(move || {
            let hosting = Hosting::Thread(running);
            Prepared::new(description, &arguments, clone, &hosting)?.run(start, defaults)
        })
        .map_err(|e| StartError::cannot_create("a thread", &e))?;
    let embedded = Embedded { wake_event, thread };
    match runs.recv_timeout(EMBEDDED_START_LIMIT) {
        Ok(()) => Ok(embedded),
        Err(RecvTimeoutError::Disconnected) => Err(match embedded.join() {
            Err(error) => error,
            Ok(()) => StartError::System("the component ended before it ran".to_owned()),
        }),
        Err(RecvTimeoutError::Timeout) => {
            embedded.stop();
            Err(StartError::System(format!(
                "the component does not run within {EMBEDDED_START_LIMIT:?}"
            )))
        }
    }
}
