//! A component from its command line to its exit code.

use crate::arguments::{self, Arguments, Task};
use crate::component::{Component, Description, WorkerError};
use crate::context::Core;
use crate::event_loop::EventLoop;
use crate::management::Management;
use crate::notify;
use crate::parameters::Refusal;
use crate::ports::Ports;
use crate::probe;
use crate::settings::settings;
use crate::status::Shared;
use rc_configuration::model::Parameters;
use rc_configuration::{Configuration, Live, Values};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_middleware::{Address, Environment, OpenError, RunDirectory, WakeEvent};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

/// How long a component that ends waits for what it sent last to arrive.
const LINGER: Duration = Duration::from_millis(100);

/// Why a component did not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The command line is wrong.
    #[error("{0}")]
    Usage(String),
    /// The configuration is wrong; the text is one or more diagnostics.
    #[error("{0}")]
    Configuration(String),
    /// A connection could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The worker's `initialize` failed.
    #[error("initialize(): {0}")]
    Worker(String),
    /// The system refused.
    #[error("{0}")]
    System(String),
}

impl StartError {
    fn code(&self) -> u8 {
        match self {
            Self::Configuration(_) => 1,
            Self::Usage(_) => 2,
            Self::Open(_) | Self::Worker(_) | Self::System(_) => 3,
        }
    }
}

impl From<WorkerError> for StartError {
    fn from(error: WorkerError) -> Self {
        let (WorkerError::Failed(reason)
        | WorkerError::Emergency(reason)
        | WorkerError::Fatal(reason)) = error;
        Self::Worker(reason)
    }
}

/// Makes the component: its sending ends, its context, its worker.
pub(crate) type Start<C> = fn(Core, &Ports, &Values) -> Result<C, StartError>;

/// Runs a component with the command line of this process, until it ends.
pub fn run<C: Component>(description: &'static Description, start: Start<C>) -> ExitCode {
    let task = match arguments::parse(description, std::env::args_os().skip(1)) {
        Ok(task) => task,
        Err(error) => return fail(description, &StartError::Usage(error.to_string())),
    };
    // The note must be in the executable, and nothing else refers to it.
    std::hint::black_box(description.note);
    let outcome = match task {
        Task::Print(text) => {
            print(&text);
            Ok(())
        }
        Task::Check(arguments) => load(description, &arguments)
            .and_then(|read| bindings(description, &arguments, &read.configuration))
            .map(|_| print(&format!("{}: ok\n", description.name))),
        Task::Probe(arguments, wait) => {
            let found = probe::probe(&arguments.network, &arguments.name, wait);
            print(&format!("{}: {}\n", arguments.name, found.text()));
            return ExitCode::from(found.code());
        }
        Task::Run(arguments) => WakeEvent::new()
            .map_err(|e| system("an event", &e))
            .and_then(|wake_event| {
                let run = || {
                    run_component(
                        description,
                        start,
                        &arguments,
                        wake_event,
                        &Hosting::Process,
                    )
                };
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_or_else(|_| {
                    Err(StartError::System("the component panicked".to_owned()))
                })
            }),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(description, &error),
    }
}

/// Prints; a reader that has left is no failure.
fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// The same on standard error, which may be a log on a disk that is full: `eprintln!` would panic.
pub(crate) fn print_error(text: &str) {
    let _ = std::io::stderr().write_all(text.as_bytes());
}

fn fail(description: &Description, error: &StartError) -> ExitCode {
    match error {
        StartError::Configuration(text) => print_error(text),
        _ => print_error(&format!("{}: error: {error}\n", description.name)),
    }
    ExitCode::from(error.code())
}

fn system(what: &str, error: &std::io::Error) -> StartError {
    StartError::System(format!("{what} cannot be made: {error}"))
}

/// A component that runs on a thread of this process, for tests.
#[derive(Debug)]
pub struct Embedded {
    wake_event: WakeEvent,
    thread: std::thread::JoinHandle<Result<(), StartError>>,
}

impl Embedded {
    /// Asks it to end.
    pub fn stop(&self) {
        self.wake_event.stop();
    }

    /// Whether it has ended.
    pub fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits for its end, which `stop` or the component itself brings about.
    pub fn join(self) -> Result<(), StartError> {
        self.thread
            .join()
            .unwrap_or_else(|_| Err(StartError::System("the component panicked".to_owned())))
    }
}

/// How long an embedded component may take until it runs.
const EMBEDDED_START_LIMIT: Duration = Duration::from_secs(10);

/// Runs a component on a thread of this process, with a command line as for its binary and without signals.
/// Returns when it runs; one that does not within ten seconds is stopped.
pub fn embed<C: Component + 'static>(
    description: &'static Description,
    start: Start<C>,
    args: &[&str],
) -> Result<Embedded, StartError> {
    let task = arguments::parse(description, args.iter().map(OsString::from))
        .map_err(|error| StartError::Usage(error.to_string()))?;
    let Task::Run(arguments) = task else {
        return Err(StartError::Usage(format!(
            "{args:?} is not the command line of a run"
        )));
    };
    let wake_event = WakeEvent::new().map_err(|e| system("an event", &e))?;
    let clone = wake_event.clone();
    let (running, runs) = std::sync::mpsc::sync_channel(1);
    let thread = std::thread::Builder::new().name(arguments.name.clone());
    let thread = thread
        .spawn(move || {
            run_component(
                description,
                start,
                &arguments,
                clone,
                &Hosting::Thread(running),
            )
        })
        .map_err(|e| system("a thread", &e))?;
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

/// Whether a component has its process for itself.
enum Hosting {
    /// It has: signals and the supervisor are its own.
    Process,
    /// It is a thread; who started it is told when it runs.
    Thread(std::sync::mpsc::SyncSender<()>),
}

fn run_component<C: Component>(
    description: &'static Description,
    start: Start<C>,
    arguments: &Arguments,
    wake_event: WakeEvent,
    hosting: &Hosting,
) -> Result<(), StartError> {
    let loaded = load(description, arguments)?;
    let configuration = &loaded.configuration;
    let level = arguments
        .log
        .as_deref()
        .or(configuration.log.as_deref())
        .unwrap_or("info");
    start_log(level)?;
    let bindings = bindings(description, arguments, configuration)?;
    let settings = settings(description, arguments, configuration, &bindings)?;
    let period = configuration.period.unwrap_or(description.period);
    let directory = RunDirectory::open(&arguments.network)
        .map_err(|e| StartError::System(format!("the run directory cannot be made: {e}")))?;
    let shared = Arc::new(Shared::new(
        wake_event.clone(),
        period,
        description.slots.len(),
    ));
    let environment = Environment {
        network: arguments.network.clone(),
        instance: arguments.name.clone(),
        directory,
        wake_event,
        settings,
    };
    let management = Management::start(
        description,
        &environment,
        &shared,
        &loaded,
        matches!(hosting, Hosting::Process),
    )?;
    let ports = Ports::new(description, &environment, &bindings)?;
    management.addresses(ports.addresses());
    if loaded.parameters.is_some() {
        ports.parameters(&management.parameters())?;
    }
    let receivers = ports.receivers()?;
    let core = Core::new(&arguments.name, &arguments.network, shared.clone());
    let mut component = match start(core, &ports, &configuration.parameters) {
        // A stop that came while the worker was being initialised is no failure of the worker.
        Err(StartError::Worker(_)) if environment.wake_event.is_stopping() => return Ok(()),
        other => other?,
    };
    shared.status().sent = ports.sent();
    let ended = {
        let mut event_loop = EventLoop::new(&mut component, description, &ports, receivers)
            .map_err(|e| system("the event loop", &e))?;
        management.ready();
        if let Hosting::Thread(running) = hosting {
            // Who does not wait any more has stopped the component already.
            let _ = running.send(());
        } else {
            notify::notify(notify::ServiceState::Ready);
        }
        event_loop.run()
    };
    if matches!(hosting, Hosting::Process) {
        notify::notify(notify::ServiceState::Stopping);
    }
    ports.linger(LINGER);
    drop(component);
    drop(ports);
    drop(management);
    ended.map_err(StartError::System)
}

/// What a component is told when it starts.
pub(crate) struct LoadedConfiguration {
    /// The model of its parameters; none where it has none.
    pub(crate) parameters: Option<Parameters>,
    pub(crate) configuration: Configuration,
    /// The file that was read, with its whole path.
    pub(crate) file: Option<PathBuf>,
}

/// Reads and checks the configuration, and what the command line says of parameters in its place.
fn load(
    description: &Description,
    arguments: &Arguments,
) -> Result<LoadedConfiguration, StartError> {
    let mut loaded = read(description, arguments)?;
    if arguments.parameters.is_empty() {
        return Ok(loaded);
    }
    let Some(model) = &loaded.parameters else {
        let message = format!("{} has no parameters, and -p names one", description.name);
        return Err(StartError::Usage(message));
    };
    let live = Live::new(model.clone(), &loaded.configuration.parameters);
    let given = arguments.parameters.iter();
    let given: Vec<(&str, serde_json::Value)> = given
        .map(|(path, text)| (path.as_str(), live.spelled(path, text)))
        .collect();
    let given = given.iter().map(|(path, value)| (*path, value));
    let accepted = live.check_start(given).map_err(|found| {
        let (name, reason) = (description.name, Refusal::found(&found).message);
        StartError::Configuration(format!("{name}: error: -p: {reason}\n"))
    })?;
    loaded.configuration.parameters = accepted.values();
    Ok(loaded)
}

fn read(
    description: &Description,
    arguments: &Arguments,
) -> Result<LoadedConfiguration, StartError> {
    let parameters = match description
        .parameters
        .map(Parameters::from_json)
        .transpose()
    {
        Ok(parameters) => parameters,
        Err(error) => {
            return Err(StartError::System(format!(
                "the generated parameters cannot be read: {error}"
            )));
        }
    };
    let Some(path) = config_file(description, arguments) else {
        let configuration = rc_configuration::defaults(parameters.as_ref()).map_err(|missing| {
            StartError::Configuration(format!(
                "{}: error: there is no configuration file, and these parameters have no default: {}; name one with --config\n",
                description.name,
                missing.join(", ")
            ))
        })?;
        return Ok(LoadedConfiguration {
            parameters,
            configuration,
            file: None,
        });
    };
    let text = rc_files::read(&path).map_err(|e| {
        StartError::Configuration(format!(
            "{}: error: {} cannot be read: {e}\n",
            description.name,
            path.display()
        ))
    })?;
    let mut sources = SourceMap::new();
    let source = sources.add(&path, text);
    let (configuration, found) = rc_configuration::check(&sources, source, parameters.as_ref());
    if found.has_errors() {
        return Err(StartError::Configuration(render(
            &sources,
            &found,
            Format::Human,
        )));
    }
    warn(&sources, &found);
    // The worker may change its working directory.
    let file = std::path::absolute(&path).unwrap_or(path);
    Ok(LoadedConfiguration {
        parameters,
        configuration,
        file: Some(file),
    })
}

fn warn(sources: &SourceMap, found: &Diagnostics) {
    if !found.is_empty() {
        print_error(&render(sources, found, Format::Human));
    }
}

fn config_file(description: &Description, arguments: &Arguments) -> Option<PathBuf> {
    if arguments.config.is_some() {
        return arguments.config.clone();
    }
    let here = PathBuf::from("etc/config.toml");
    let built = Path::new(description.folder).join("etc/config.toml");
    // Another component's folder may be the current one; its configuration is not ours.
    let ours = Path::new(&format!("{}.cdsl", description.name)).exists();
    [here]
        .into_iter()
        .filter(|_| ours)
        .chain([built])
        .find(|path| path.exists())
}

fn bindings(
    description: &Description,
    arguments: &Arguments,
    configuration: &Configuration,
) -> Result<BTreeMap<String, Address>, StartError> {
    let mut all = BTreeMap::new();
    for (slot, address) in &configuration.bindings {
        let bad = |reason: String| {
            StartError::Configuration(format!(
                "{}: error: [bindings]: {reason}\n",
                description.name
            ))
        };
        let slot = arguments::check_slot(description, slot).map_err(bad)?;
        let bad = |reason: String| {
            StartError::Configuration(format!(
                "{}: error: [bindings]: {reason}\n",
                description.name
            ))
        };
        all.insert(slot, Address::parse(address).map_err(bad)?);
    }
    all.extend(arguments.bindings.clone());
    Ok(all)
}

fn start_log(level: &str) -> Result<(), StartError> {
    let level: tracing::Level = level.parse().map_err(|_| {
        StartError::Usage(format!(
            "`{level}` is not a log level; there are error, warn, info, debug and trace"
        ))
    })?;
    // A second component of one process (a test) writes into the log of the first.
    let _ = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .with_ansi(false)
        // A line that cannot be written is lost; to say so on the same stream would be a panic.
        .log_internal_errors(false)
        .with_writer(std::io::stderr)
        .try_init();
    Ok(())
}
