//! The stages of a component that runs: prepared, managed, connected, working, ended. Each stage
//! consumes the previous one, so that none is skipped and none comes too early.

use crate::arguments::Arguments;
use crate::clock::{Clock, SimulatedClock, SystemClock};
use crate::commands::CommandQueue;
use crate::component::Component;
use crate::configuration::{self, LoadedConfiguration};
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
use crate::log::{self, Log};
use crate::management::{Attachment, Management};
use crate::notify::{self, ServiceState};
use crate::own_changes::OwnChanges;
use crate::ports::{Connections, Interceptors, Ports, Receiver};
use crate::settings::settings;
use crate::shared::place::Place;
use crate::slots::{OpenSlot, SlotTable};
use crate::start::Start;
use crate::status::{NetworkTime, Shared};
use crate::testing::defaults::DefaultReply;
use crate::time::protocol::turn_of;
use crate::time::{ClockChoice, TimeRole, ends};
use rc_files::Disk;
use rc_management::component::{ClockKind, Role};
use rc_middleware::lifecycle::LifecycleService;
use rc_middleware::{Environment, RunDirectory, Settings, WakeEvent};
use std::fs::File;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

/// How long a component that ends waits for its last messages to arrive.
const LINGER: Duration = Duration::from_millis(100);

/// The linger of a component that leaves a source of time. The source would wait for it if the last
/// message did not arrive.
const LEAVE_LINGER: Duration = Duration::from_secs(2);

/// Host of a component: a process, or a thread of another one.
pub(crate) enum Hosting {
    /// In a process of its own, which takes signals and has a link to the supervisor. It runs this
    /// program.
    Process(PathBuf),
    /// On a thread, which reports when the component runs.
    Thread(SyncSender<()>),
    /// On a thread of a process that takes signals for all its components.
    Shared(Place),
}

impl Hosting {
    fn log(&self) -> log::Output {
        match self {
            Self::Process(_) | Self::Thread(_) => log::Output::Process,
            Self::Shared(place) => log::Output::Component(place.output.clone()),
        }
    }

    fn attachment(&self) -> Result<Attachment, StartError> {
        Ok(match self {
            Self::Process(_) => Attachment::Process,
            Self::Thread(_) => Attachment::None,
            Self::Shared(place) => match &place.link {
                Some(link) => Attachment::Link(
                    link.try_clone()
                        .map_err(|e| StartError::cannot_create("its link", &e))?,
                ),
                None => Attachment::None,
            },
        })
    }
}

/// A component whose configuration, names and clock are known. No other process sees it yet.
pub(crate) struct Prepared<'a> {
    description: &'static Description,
    arguments: &'a Arguments,
    hosting: &'a Hosting,
    loaded: LoadedConfiguration,
    log: Log,
    slots: Arc<SlotTable>,
    environment: Environment,
    clock: ClockKind,
    simulated: Arc<SimulatedClock>,
    shared: Arc<Shared>,
    commands: Arc<CommandQueue>,
    /// The seed of the worker's random numbers.
    seed: u64,
}

/// A component that tools and its supervisor reach.
struct Managed<'a> {
    management: Management,
    prepared: Prepared<'a>,
}

/// A component that has joined its middlewares and the time of its network.
struct Connected<'a> {
    /// Dropped before the ports, which wait for requests of the life cycle that are under way.
    ends: Option<lifecycle::EndsWhenDropped>,
    /// The receiving ends of the slots of the description.
    receivers: Vec<(usize, Receiver)>,
    time: TimeRole,
    ports: Ports,
    exact: Exact,
    managed: Managed<'a>,
}

/// A component whose worker is initialised.
struct Working<'a> {
    component: Box<dyn Component + 'a>,
    connected: Connected<'a>,
}

impl<'a> Prepared<'a> {
    /// Reads the configuration, starts the log, and names the slots.
    pub(crate) fn new(
        description: &'static Description,
        arguments: &'a Arguments,
        wake_event: WakeEvent,
        hosting: &'a Hosting,
    ) -> Result<Self, StartError> {
        let loaded = configuration::load(description, arguments)?;
        let configuration = &loaded.configuration;
        let of_node = arguments.node.as_ref();
        let prints_log = of_node.and_then(|(_, given)| given.prints_log());
        let level = loaded.node.log.or(arguments.log.as_deref());
        let level = level.or(configuration.log.as_deref());
        let log = log::start(level, prints_log.unwrap_or(true), &hosting.log())?;
        let bindings = configuration::bindings(description, arguments, configuration)?;
        let (network, name) = (&arguments.network, &arguments.name);
        let listed = arguments.members.clone();
        let slots = Arc::new(SlotTable::new(
            description,
            (network, name),
            &bindings,
            &arguments.transports,
            listed,
        )?);
        let mut settings = settings(description, arguments, &loaded, &slots)?;
        let kind = clock(description, arguments, &mut settings)?;
        let period = configuration.period.unwrap_or(description.period);
        let directory = RunDirectory::open(network)
            .map_err(|e| StartError::cannot_create("the run directory", &e))?;
        let simulated = Arc::new(SimulatedClock::default());
        let clock: Arc<dyn Clock> = match kind {
            ClockKind::System => Arc::new(SystemClock),
            ClockKind::Simulated | ClockKind::Source | ClockKind::Nodes => simulated.clone(),
        };
        let shared = Shared::new(
            wake_event.clone(),
            period,
            description.slots.len(),
            NetworkTime::new(kind, clock),
            description.managed,
        );
        let shared = Arc::new(match hosting {
            Hosting::Shared(place) => shared.beside(place.done.clone()),
            Hosting::Process(_) | Hosting::Thread(_) => shared,
        });
        if matches!(hosting, Hosting::Process(_)) && !Link::is_expected() {
            report_default_addresses(&slots, network);
        }
        shared.status().schema.clone_from(&arguments.schema);
        let commands = Arc::new(CommandQueue::new(wake_event.clone()));
        let environment = Environment {
            network: network.clone(),
            instance: name.clone(),
            directory,
            wake_event,
            settings,
        };
        Ok(Self {
            seed: seed(kind, name),
            description,
            arguments,
            hosting,
            loaded,
            log,
            slots,
            environment,
            clock: kind,
            simulated,
            shared,
            commands,
        })
    }

    /// Runs the component until it ends. Calls that no server takes get the replies in `defaults`.
    pub(crate) fn run<C: Component + 'a>(
        self,
        start: impl Start<C>,
        defaults: &'static [(usize, DefaultReply)],
    ) -> Result<(), StartError> {
        let connected = self.manage()?.connect(defaults)?;
        match connected.initialize(start)? {
            Some(working) => working.work(),
            None => Ok(()),
        }
    }

    /// Takes the name in the network, and opens the management socket.
    fn manage(self) -> Result<Managed<'a>, StartError> {
        let management = Management::start(
            self.description,
            &self.environment,
            &self.slots,
            &self.shared,
            &self.commands,
            &self.loaded,
            self.hosting.attachment()?,
        )?;
        Ok(Managed {
            management,
            prepared: self,
        })
    }

    /// Begins an exact recording, if the command line names one.
    fn record(&self) -> Result<Exact, StartError> {
        let Some(path) = &self.arguments.record else {
            return Ok(Exact::Off);
        };
        if self.shared.lifecycle.is_some() {
            let message = "--record: a managed component has no exact recording; its transitions are not kept";
            return Err(StartError::Usage(message.to_owned()));
        }
        let mut began = exact::start::Start::new(
            self.description,
            &self.arguments.name,
            &self.arguments.network,
            self.clock,
            self.seed,
            &self.loaded.values(),
            &self.arguments.members,
        );
        began.schema.clone_from(&self.arguments.schema);
        began.program = match self.hosting {
            Hosting::Process(program) => program.display().to_string(),
            Hosting::Shared(place) => place.program.display().to_string(),
            // The executable of this process is a test or an interpreter.
            Hosting::Thread(_) => String::new(),
        };
        began.is_shared = matches!(self.hosting, Hosting::Shared(_));
        let what = format!("the recording {}", path.display());
        let floor = self.arguments.keep_free;
        let disk = Disk::new(floor.unwrap_or_else(|| Disk::usual_floor(path)));
        let recorder = File::create(path);
        let recorder =
            recorder.and_then(|file| Recorder::begin(file, disk, &began, self.shared.clone()));
        let recorder = recorder.map_err(|e| StartError::cannot_create(&what, &e))?;
        Ok(Exact::Record(Rc::new(recorder)))
    }
}

impl<'a> Managed<'a> {
    /// Joins the middlewares and the time of the network.
    fn connect(
        self,
        defaults: &'static [(usize, DefaultReply)],
    ) -> Result<Connected<'a>, StartError> {
        let Self {
            management,
            prepared,
        } = &self;
        let arguments = prepared.arguments;
        let exact = prepared.record()?;
        let lifecycle = prepared.shared.lifecycle.as_ref();
        let interceptors = Interceptors {
            taps: management.taps(),
            hops: management.hops(),
            gate: lifecycle
                .map(|lifecycle| lifecycle.gate())
                .unwrap_or_default(),
            exact: exact.clone(),
            defaults,
            conversions: arguments.conversions.clone(),
            now: match prepared.clock {
                ClockKind::System => Arc::new(SystemClock),
                ClockKind::Simulated | ClockKind::Source | ClockKind::Nodes => {
                    prepared.simulated.clone()
                }
            },
        };
        let middleware = match &arguments.clock {
            ClockChoice::Simulated(middleware) => middleware.as_deref(),
            ClockChoice::Own | ClockChoice::System | ClockChoice::Source => None,
        };
        let mut ports = Connections::new(
            prepared.description,
            &prepared.environment,
            &prepared.slots,
            prepared.clock,
            Some(middleware.unwrap_or(prepared.description.middleware)),
            interceptors,
        )?;
        if let Some(log) = &prepared.log.queue {
            ports.log(log)?;
        }
        let time = ports.join_time(
            &arguments.name,
            &prepared.simulated,
            &arguments.followers,
            middleware,
        )?;
        management.set_open();
        if prepared.loaded.parameters.is_some() {
            ports.parameters(&management.parameters())?;
        }
        if let Some(lifecycle) = lifecycle {
            let service: Arc<dyn LifecycleService> =
                Arc::new(lifecycle::Service(lifecycle.clone()));
            ports.lifecycle(&service)?;
        }
        let ends = lifecycle.cloned().map(lifecycle::EndsWhenDropped);
        Ok(Connected {
            ends,
            receivers: ports.receivers()?,
            time,
            ports: Rc::new(ports),
            exact,
            managed: self,
        })
    }
}

impl<'a> Connected<'a> {
    /// Initialises the worker. `None` if the component was stopped meanwhile.
    fn initialize<C: Component + 'a>(
        mut self,
        start: impl Start<C>,
    ) -> Result<Option<Working<'a>>, StartError> {
        let prepared = &self.managed.prepared;
        let (name, network) = (&prepared.arguments.name, &prepared.arguments.network);
        let (shared, exact) = (&prepared.shared, &self.exact);
        let mut core = Core::exact(name, network, shared.clone(), exact.clone(), prepared.seed);
        core.own_changes = OwnChanges::Requested(self.managed.management.requests());
        let values = prepared.loaded.values();
        let started = exact.initialize(|| start(core, &self.ports, &values));
        let component = match started {
            // A stop during the initialisation is not a failure of the worker.
            Err(StartError::Worker(_)) if prepared.environment.wake_event.is_stopping() => {
                return Ok(None);
            }
            other => other?,
        };
        // A component with slot arrays may have done so in `start`.
        prepared.slots.complete()?;
        self.receivers.extend(self.ports.take_members());
        if component.has_window() && matches!(self.exact, Exact::Record(_)) {
            let message = "--record: a component with a window has no exact recording; what people do in it is not kept";
            return Err(StartError::Usage(message.to_owned()));
        }
        let component: Box<dyn Component + 'a> = match &self.exact {
            Exact::Record(recorder) => Box::new(Recorded::new(component, recorder.clone())),
            Exact::Off | Exact::Replay(_) => Box::new(component),
        };
        {
            let mut status = shared.status();
            status.sent = self.ports.sent();
            status.withheld = self.ports.withheld();
            status.converted = self.ports.converted();
            // The worker may have set values that answer queries.
            status.fresh.extend(self.ports.fresh());
            status.forwarded = self.ports.forwarded();
            status.transports = self.ports.transports();
            status.queues = self.ports.queues();
            status.extend_slots(prepared.slots.len());
        }
        Ok(Some(Working {
            component,
            connected: self,
        }))
    }
}

impl Working<'_> {
    /// Runs the event loop, and ends: the worker first, then its network's time after the last
    /// message has arrived, then the ports, and the management.
    fn work(self) -> Result<(), StartError> {
        let Self {
            component,
            connected,
        } = self;
        let Connected {
            ends,
            receivers,
            time,
            ports,
            exact: _exact,
            managed,
        } = connected;
        let Managed {
            management,
            prepared,
        } = managed;
        // Locals drop in the reverse order, also in a panic: the worker first, then everything that
        // it uses.
        let (ports, ends, mut component) = (ports, ends, component);
        let commands = prepared.commands.clone();
        let mut event_loop = EventLoop::new(&mut *component, &ports, receivers, commands, time)
            .map_err(|e| StartError::cannot_create("the event loop", &e))?;
        management.ready();
        prepared.announce();
        let ended = event_loop.run();
        let time = event_loop.into_time();
        let linger = if time.is_lockstep() {
            LEAVE_LINGER
        } else {
            LINGER
        };
        if matches!(prepared.hosting, Hosting::Process(_)) {
            notify::notify(ServiceState::Stopping);
        }
        ports.linger(linger);
        drop(component);
        drop(time);
        drop(ends);
        drop(ports);
        drop(management);
        ended.map_err(StartError::System)
    }
}

impl Prepared<'_> {
    /// Reports that the component runs, to its host or to the service manager. A managed component
    /// that activates itself reports when it is active.
    fn announce(&self) {
        // A supervisor decides for its components.
        let starts_itself = self.arguments.active && !Link::is_expected();
        if let Some(lifecycle) = self.shared.lifecycle.as_ref().filter(|_| starts_itself) {
            lifecycle.set_goal(Goal {
                state: LifecycleState::Active,
                number: None,
            });
        }
        match self.hosting {
            Hosting::Thread(running) => {
                // A starter that does not wait any more has stopped the component already.
                let _ = running.send(());
                return;
            }
            Hosting::Shared(place) => place.reports.ready(),
            Hosting::Process(_) => {}
        }
        if !starts_itself {
            notify::notify(ServiceState::Ready);
        }
    }
}

/// Reports where the calls of a component go that was started by hand: without a `.ddsl`, its servers
/// are seldom there.
fn report_default_addresses(slots: &SlotTable, network: &str) {
    let all = slots.all();
    let default = |slot: &OpenSlot| {
        let address = slot.address.as_ref()?.to_string();
        let is_default = address == format!("{network}/{}", slot.slot.interface);
        (slot.role == Role::Requires && is_default).then(|| format!("`{address}`"))
    };
    let addresses: Vec<String> = all.iter().filter_map(|slot| default(slot)).collect();
    if let [_, ..] = &*addresses {
        tracing::info!(
            "started without rcdeploy: this component calls servers at {}; to call others, name their \
             addresses with `--bind SLOT=ADDRESS`, or start its network with `rcdeploy up`",
            addresses.join(", ")
        );
    }
}

/// The seed of the worker's random numbers: in simulated time, it is equal in every run.
fn seed(kind: ClockKind, name: &str) -> u64 {
    match kind {
        ClockKind::System | ClockKind::Nodes => fastrand::u64(..),
        ClockKind::Simulated | ClockKind::Source => turn_of(name),
    }
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
        ClockChoice::Own if followed.is_some() => ClockKind::Nodes,
        ClockChoice::Own | ClockChoice::Source if description.simulates_time => ClockKind::Source,
        ClockChoice::Own | ClockChoice::System => ClockKind::System,
        ClockChoice::Source => {
            return usage(format!(
                "--clock source: {name} does not advance time; write `simulates time;` in its .cdsl and generate it again"
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
        && matches!(kind, ClockKind::Nodes | ClockKind::Source)
    {
        (clock.rename)(settings, ends::SLOT);
    }
    Ok(kind)
}
