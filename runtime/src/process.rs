//! A component from its command line to its exit code.

use crate::arguments::Arguments;
use crate::clock::{Clock, SimulatedClock, SystemClock};
use crate::command_line::{self, Task};
use crate::commands::CommandQueue;
use crate::component::Component;
use crate::configuration;
use crate::context::Core;
use crate::description::Description;
use crate::error::StartError;
use crate::event_loop::EventLoop;
use crate::exact;
use crate::exact::component::Recorded;
use crate::exact::mode::Exact;
use crate::exact::recorder::Recorder;
use crate::lifecycle::{self, Goal, LifecycleState};
use crate::link::Link;
use crate::log::{self, print, print_error};
use crate::management::Management;
use crate::notify::{self, ServiceState};
use crate::ports::{Connections, Ports};
use crate::probe;
use crate::settings::settings;
use crate::slots::SlotTable;
use crate::start::Start;
use crate::status::{NetworkTime, Shared};
use crate::testing::defaults::DefaultReply;
use crate::time::protocol::turn_of;
use crate::time::{ClockChoice, ends};
use rc_files::Disk;
use rc_management::component::ClockKind;
use rc_middleware::lifecycle::LifecycleService;
use rc_middleware::{Environment, RunDirectory, Settings, WakeEvent};
use std::ffi::OsString;
use std::fs::File;
use std::path::PathBuf;
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

/// How long a component that ends waits for its last messages to arrive.
const LINGER: Duration = Duration::from_millis(100);

/// The linger of a component that leaves a source of time. The source would wait for it if the last
/// message did not arrive.
const LEAVE_LINGER: Duration = Duration::from_secs(2);

/// Runs a component with the command line of this process, until it ends. Returns the exit code.
///
/// The `main` of a component is a call of the generated `run`, which calls this function.
pub fn run<C: Component>(description: &'static Description, start: impl Start<C>) -> ExitCode {
    let args = std::env::args_os().skip(1);
    ExitCode::from(run_with(description, start, args, own_program()))
}

/// The executable of this process.
fn own_program() -> PathBuf {
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
        Err(error) => return fail(description, &StartError::Usage(error.to_string())),
    };
    // The note must be in the executable, and nothing else refers to it.
    std::hint::black_box(description.note);
    let outcome = match task {
        Task::Print(text) => {
            print(&text);
            Ok(())
        }
        Task::Check(arguments) => configuration::load(description, &arguments)
            .and_then(|read| configuration::bindings(description, &arguments, &read.configuration))
            .map(|_| print(&format!("{}: ok\n", description.name))),
        Task::Probe(arguments, wait) => {
            let result = probe::probe(&arguments.network, &arguments.name, wait);
            print(&format!("{}: {}\n", arguments.name, result.text()));
            return result.code();
        }
        Task::Replay(arguments) => exact::run::replay(description, start, &arguments),
        Task::Run(arguments) => WakeEvent::new()
            .map_err(|e| StartError::cannot_create("an event", &e))
            .and_then(|wake_event| {
                let run = || {
                    run_component(
                        description,
                        start,
                        &arguments,
                        wake_event,
                        &Hosting::Process(program),
                        &[],
                    )
                };
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_or_else(|_| {
                    Err(StartError::System("the component panicked".to_owned()))
                })
            }),
    };
    match outcome {
        Ok(()) => 0,
        Err(error) => fail(description, &error),
    }
}

fn fail(description: &Description, error: &StartError) -> u8 {
    match error {
        StartError::Configuration(text) => print_error(text),
        _ => print_error(&format!("{}: error: {error}\n", description.name)),
    }
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
            run_component(
                description,
                start,
                &arguments,
                clone,
                &Hosting::Thread(running),
                defaults,
            )
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

/// Host of a component: a process, or a thread of another one.
enum Hosting {
    /// In a process of its own, which takes signals and has a link to the supervisor. It runs this
    /// program.
    Process(PathBuf),
    /// On a thread, which reports when the component runs.
    Thread(SyncSender<()>),
}

fn run_component<C: Component>(
    description: &'static Description,
    start: impl Start<C>,
    arguments: &Arguments,
    wake_event: WakeEvent,
    hosting: &Hosting,
    defaults: &'static [(usize, DefaultReply)],
) -> Result<(), StartError> {
    let loaded = configuration::load(description, arguments)?;
    let configuration = &loaded.configuration;
    let of_node = arguments.node.as_ref();
    let prints_log = of_node.and_then(|(_, given)| given.prints_log());
    let level = loaded.node.log.or(arguments.log.as_deref());
    let level = level.or(configuration.log.as_deref());
    let log = log::start(level, prints_log.unwrap_or(true))?;
    let bindings = configuration::bindings(description, arguments, configuration)?;
    let names = (arguments.network.as_str(), arguments.name.as_str());
    let listed = arguments.members.clone();
    let slots = Arc::new(SlotTable::new(description, names, &bindings, listed)?);
    let mut settings = settings(description, arguments, &loaded, &slots)?;
    let kind = clock(description, arguments, &mut settings)?;
    let period = configuration.period.unwrap_or(description.period);
    let directory = RunDirectory::open(&arguments.network)
        .map_err(|e| StartError::cannot_create("the run directory", &e))?;
    let simulated = Arc::new(SimulatedClock::default());
    let clock: Arc<dyn Clock> = match kind {
        ClockKind::System => Arc::new(SystemClock),
        _ => simulated.clone(),
    };
    let shared = Arc::new(Shared::new(
        wake_event.clone(),
        period,
        description.slots.len(),
        NetworkTime::new(kind, clock),
        description.managed,
    ));
    let commands = Arc::new(CommandQueue::new(wake_event.clone()));
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
        &slots,
        &shared,
        &commands,
        &loaded,
        matches!(hosting, Hosting::Process(_)),
    )?;
    let seed = seed(kind, &arguments.name);
    let parameters = &loaded.values();
    let mut began = exact::start::Start::new(
        description,
        &arguments.name,
        &arguments.network,
        kind,
        seed,
        parameters,
        &arguments.members,
    );
    began.program = match hosting {
        Hosting::Process(program) => program.display().to_string(),
        // The executable of this process is a test or an interpreter.
        Hosting::Thread(_) => String::new(),
    };
    let exact = record(arguments, &began, &shared)?;
    let mut ports = Connections::new(description, &environment, &slots, kind)?;
    ports.set_taps(management.taps());
    ports.set_defaults(defaults);
    ports.convert(&arguments.conversions);
    if let Some(lifecycle) = &shared.lifecycle {
        ports.set_gate(lifecycle.gate());
    }
    ports.record(&exact);
    if let Some(log) = &log {
        ports.log(log)?;
    }
    let middleware = match &arguments.clock {
        ClockChoice::Simulated(middleware) => middleware.as_deref(),
        _ => None,
    };
    let (name, followers) = (&arguments.name, &arguments.followers);
    let time = ports.join_time(name, &simulated, followers, middleware)?;
    management.set_open();
    if loaded.parameters.is_some() {
        ports.parameters(&management.parameters())?;
    }
    if let Some(lifecycle) = &shared.lifecycle {
        let service: Arc<dyn LifecycleService> = Arc::new(lifecycle::Service(lifecycle.clone()));
        ports.lifecycle(&service)?;
    }
    // Dropped before the ports, which wait for requests of the life cycle that are under way.
    let _ends = shared.lifecycle.clone().map(lifecycle::EndsWhenDropped);
    let mut receivers = ports.receivers()?;
    let ports: Ports = Rc::new(ports);
    let (name, network) = (&arguments.name, &arguments.network);
    let core = Core::exact(name, network, shared.clone(), exact.clone(), seed);
    let started = exact.initialize(|| start(core, &ports, parameters));
    let component = match started {
        // A stop during the initialisation is not a failure of the worker.
        Err(StartError::Worker(_)) if environment.wake_event.is_stopping() => return Ok(()),
        other => other?,
    };
    // A component with slot arrays may have done so in `start`.
    slots.complete()?;
    receivers.extend(ports.take_members());
    let mut component: Box<dyn Component> = match &exact {
        Exact::Record(recorder) => Box::new(Recorded::new(component, recorder.clone())),
        _ => Box::new(component),
    };
    {
        let mut status = shared.status();
        status.sent = ports.sent();
        status.withheld = ports.withheld();
        status.converted = ports.converted();
        status.queues = ports.queues();
        status.extend_slots(slots.len());
    }
    // The ends of the network's time are closed after the last message has arrived.
    let (ended, time) = {
        let mut event_loop = EventLoop::new(&mut *component, &ports, receivers, commands, time)
            .map_err(|e| StartError::cannot_create("the event loop", &e))?;
        management.ready();
        // A supervisor decides for its components.
        let starts_itself = arguments.active && !Link::is_expected();
        if let Some(lifecycle) = shared.lifecycle.as_ref().filter(|_| starts_itself) {
            lifecycle.set_goal(Goal {
                state: LifecycleState::Active,
                number: None,
            });
        }
        if let Hosting::Thread(running) = hosting {
            // A starter that does not wait any more has stopped the component already.
            let _ = running.send(());
        } else if !starts_itself {
            notify::notify(ServiceState::Ready);
        }
        (event_loop.run(), event_loop.into_time())
    };
    let linger = if time.is_lockstep() {
        LEAVE_LINGER
    } else {
        LINGER
    };
    if matches!(hosting, Hosting::Process(_)) {
        notify::notify(ServiceState::Stopping);
    }
    ports.linger(linger);
    drop(component);
    drop(time);
    drop(ports);
    drop(management);
    ended.map_err(StartError::System)
}

/// The seed of the worker's random numbers: in simulated time, every run has the same ones.
fn seed(kind: ClockKind, name: &str) -> u64 {
    match kind {
        ClockKind::System | ClockKind::Ros => fastrand::u64(..),
        ClockKind::Simulated | ClockKind::Source => turn_of(name),
    }
}

/// Begins an exact recording, if the command line names one.
fn record(
    arguments: &Arguments,
    began: &exact::start::Start,
    shared: &Arc<Shared>,
) -> Result<Exact, StartError> {
    let Some(path) = &arguments.record else {
        return Ok(Exact::Off);
    };
    if shared.lifecycle.is_some() {
        let message =
            "--record: a managed component has no exact recording; its transitions are not kept";
        return Err(StartError::Usage(message.to_owned()));
    }
    let what = format!("the recording {}", path.display());
    let floor = arguments.keep_free;
    let disk = Disk::new(floor.unwrap_or_else(|| Disk::usual_floor(path)));
    let recorder = File::create(path);
    let recorder = recorder.and_then(|file| Recorder::begin(file, disk, began, shared.clone()));
    let recorder = recorder.map_err(|e| StartError::cannot_create(&what, &e))?;
    Ok(Exact::Record(Rc::new(recorder)))
}

/// The clock of a component, as its command line and its settings choose it.
fn clock(
    description: &Description,
    arguments: &Arguments,
    settings: &mut Settings,
) -> Result<ClockKind, StartError> {
    let name = description.name;
    let usage = |message: String| Err(StartError::Usage(message));
    let of_nodes = description.node_clock();
    let followed = of_nodes
        .filter(|(middleware, clock)| settings.bool(middleware, clock.setting) == Some(true));
    let kind = match &arguments.clock {
        ClockChoice::Own if followed.is_some() => ClockKind::Ros,
        ClockChoice::Own | ClockChoice::Source if description.simulates_time => ClockKind::Source,
        ClockChoice::Own | ClockChoice::System => ClockKind::System,
        ClockChoice::Source => {
            return usage(format!(
                "--clock source: {name} does not advance time; write `simulates time;` in its .cdsl and generate it anew"
            ));
        }
        ClockChoice::Simulated(_) => match followed {
            Some((middleware, clock)) => {
                let setting = clock.setting;
                return usage(format!(
                    "--clock simulated and {middleware}.{setting} name two clocks; choose one"
                ));
            }
            None => ClockKind::Simulated,
        },
    };
    if kind != ClockKind::Source && !arguments.followers.is_empty() {
        return usage("--followers goes with --clock source".to_owned());
    }
    if let Some((_, clock)) = of_nodes
        && matches!(kind, ClockKind::Ros | ClockKind::Source)
    {
        (clock.rename)(settings, ends::SLOT);
    }
    Ok(kind)
}
