//! The connections of a component, opened in the order of its description.

mod converter;
mod counts;
mod early;
mod endpoints;
mod frames;
mod receiver;

use crate::ages::FreshCounts;
use crate::cached::CachingClient;
use crate::clock::SimulatedClock;
use crate::clock::{Clock, SystemClock};
use crate::converting::{ConversionCounts, Conversions, IdleFlag, OwnPlaces, Shared};
use crate::description::Description;
use crate::error::StartError;
use crate::exact::mode::Exact;
use crate::exact::replayed_ports;
use crate::forwarded::ForwardCounts;
use crate::hops::{ALL_OPERATIONS, HopNotes, SharedHops};
use crate::member::MemberError;
use crate::settings::topic_qos;
use crate::slots::{OpenSlot, SlotTable};
use crate::tap::{TappedClient, TappedPublisher, Taps};
use crate::testing::defaults::{DefaultReply, DefaultingClient};
use crate::time::follower::Follower;
use crate::time::lockstep::State as SourceState;
use crate::time::source::Source;
use crate::time::{TimeRole, TimeSource};
pub use converter::{CONVERTER, Converter};
pub use early::{Awaited, EarlySamples};
use endpoints::{call_endpoint, is_needed};
use rc_management::component::{ClockKind, Role};
use rc_middleware::lifecycle::LifecycleService;
use rc_middleware::parameters::ParameterService;
use rc_middleware::typed::{Gate, TypedClient, TypedPublisher};
use rc_middleware::{
    Backend, Client, Counter, Endpoint, Environment, LogQueue, Member, OpenError, QueueGauge,
    Settings, TypeIdentity, WakeEvent, fan_out, network_time,
};
pub(crate) use receiver::Receiver;
use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeMap, VecDeque};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// The connections of a component. Its slot arrays share them, to open members.
pub type Ports = Rc<Connections>;

/// Opens the connections of a component. Generated code gets its publishers and clients from here.
pub struct Connections {
    description: &'static Description,
    slots: Arc<SlotTable>,
    backends: Vec<(&'static str, Box<dyn Backend>)>,
    settings: Settings,
    /// The counters of the sending ends, each with the index of its slot.
    sent: RefCell<Vec<(usize, Counter)>>,
    /// The counters of samples that were not published, each with the index of its slot.
    withheld: RefCell<Vec<(usize, Counter)>>,
    /// The conversions of slots.
    conversions: Conversions,
    /// The transforms that slots of tf have received, by their names.
    histories: RefCell<BTreeMap<String, Shared>>,
    /// Places of frames in the shared world.
    places: OwnPlaces,
    /// Whether the component is not active: then no sample asks where frames are.
    idle: IdleFlag,
    /// Reports the end of the component to waits for the place of a frame.
    stop: Option<WakeEvent>,
    /// The counts of slots that convert, each with the index of its slot.
    converted: RefCell<Vec<(usize, ConversionCounts)>>,
    /// How old the replies of slots are, each with the index of its slot.
    fresh: RefCell<Vec<(usize, FreshCounts)>>,
    /// The forwarded messages of slots, each with the index of its slot.
    forwarded: RefCell<Vec<(usize, ForwardCounts)>>,
    /// Gate of all publishers.
    gate: Gate,
    /// The messages over each middleware of providers, each with the index of its slot.
    transports: RefCell<Vec<(usize, &'static str, Counter)>>,
    /// The receive queues, each with the index of its slot.
    queues: RefCell<Vec<(usize, QueueGauge)>>,
    /// Whether members are opened to receive: not where the recording or a test calls the handlers.
    is_live: bool,
    /// The receiving ends of members, until the event loop takes them.
    receivers: RefCell<Vec<(usize, Receiver)>>,
    network: String,
    taps: Arc<Taps>,
    /// Notes of messages on chains.
    hops: Rc<HopNotes>,
    clock: ClockKind,
    /// The time of the network.
    now: Arc<dyn Clock>,
    /// For a source of time: the state that its worker and the event loop share.
    source: Option<Rc<RefCell<SourceState>>>,
    exact: Exact,
    /// For tests: the replies of slots without a server, each with the index of its slot.
    defaults: &'static [(usize, DefaultReply)],
    /// The messages that a worker may await inside of a turn.
    early: OnceCell<EarlySamples>,
}

/// The parts of each connection, which has them from its beginning.
pub(crate) struct Interceptors {
    /// Copies messages to tools.
    pub(crate) taps: Arc<Taps>,
    /// Notes of messages on chains.
    pub(crate) hops: Arc<SharedHops>,
    /// Gate of all publishers.
    pub(crate) gate: Gate,
    /// Records inputs and outputs.
    pub(crate) exact: Exact,
    /// Replies to calls that no server takes, each with the index of its slot.
    pub(crate) defaults: &'static [(usize, DefaultReply)],
    /// Conversions of units, by slots.
    pub(crate) conversions: Conversions,
    /// The time of the network.
    pub(crate) now: Arc<dyn Clock>,
}

impl Connections {
    /// Opens the middlewares that the slots and the clock need. `of_time` is the one over which the
    /// component hears the time of its network.
    pub(crate) fn new(
        description: &'static Description,
        environment: &Environment,
        slots: &Arc<SlotTable>,
        clock: ClockKind,
        of_time: Option<&str>,
        interceptors: Interceptors,
    ) -> Result<Self, OpenError> {
        let used = slots.used()?;
        let mut backends = Vec::new();
        for linked in description.backends {
            let is_main = linked.name == description.middleware;
            if !is_main && !is_needed(linked, &used, clock, of_time) {
                continue;
            }
            backends.push((linked.name, (linked.connect)(environment)?));
        }
        let ports = Self::over(description, backends, slots, &environment.network, clock);
        Ok(Self {
            settings: environment.settings.clone(),
            is_live: true,
            stop: Some(environment.wake_event.clone()),
            taps: interceptors.taps,
            hops: Rc::new(HopNotes::new(interceptors.hops)),
            gate: interceptors.gate,
            exact: interceptors.exact,
            defaults: interceptors.defaults,
            conversions: interceptors.conversions,
            now: interceptors.now,
            ..ports
        })
    }

    /// The connections over these middlewares, with the default settings.
    pub(crate) fn over(
        description: &'static Description,
        backends: Vec<(&'static str, Box<dyn Backend>)>,
        slots: &Arc<SlotTable>,
        network: &str,
        clock: ClockKind,
    ) -> Self {
        Self {
            description,
            slots: Arc::clone(slots),
            backends,
            settings: Settings::default(),
            sent: RefCell::default(),
            withheld: RefCell::default(),
            conversions: Conversions::default(),
            histories: RefCell::default(),
            places: OwnPlaces::default(),
            idle: IdleFlag::default(),
            stop: None,
            converted: RefCell::default(),
            fresh: RefCell::default(),
            forwarded: RefCell::default(),
            gate: Gate::default(),
            transports: RefCell::default(),
            queues: RefCell::default(),
            is_live: false,
            receivers: RefCell::default(),
            network: network.to_owned(),
            taps: Arc::new(Taps::new(SlotTable::capacity(description), None)),
            hops: Rc::new(HopNotes::new(Arc::default())),
            clock,
            now: Arc::new(SystemClock),
            source: None,
            exact: Exact::Off,
            defaults: &[],
            early: OnceCell::new(),
        }
    }

    /// Whether calls of this slot of the description get default values without a server.
    pub(crate) fn has_default(&self, described: usize) -> bool {
        self.defaults.iter().any(|(of, _)| *of == described)
    }

    /// The taps of the slots.
    pub(crate) fn taps(&self) -> &Arc<Taps> {
        &self.taps
    }

    /// The notes of messages on chains.
    pub(crate) fn hops(&self) -> &HopNotes {
        &self.hops
    }

    /// Opens publishers behind `gate` from now on.
    pub(crate) fn set_gate(&mut self, gate: Gate) {
        self.gate = gate;
    }

    /// The connections of a component that is repeated: they end in its recording.
    pub(crate) fn replayed(
        description: &'static Description,
        slots: &Arc<SlotTable>,
        network: &str,
        clock: ClockKind,
        exact: &Exact,
    ) -> Self {
        let ports = Self::over(description, Vec::new(), slots, network, clock);
        Self {
            exact: exact.clone(),
            ..ports
        }
    }

    /// Lets the worker set `clock` as a source of time without followers.
    pub(crate) fn simulate_time(&mut self, clock: &Arc<SimulatedClock>) {
        let state = SourceState::new(Arc::clone(clock), &[]);
        self.source = Some(Rc::new(RefCell::new(state)));
    }

    /// Joins the time of the network. `followers` are those that a source expects; `middleware` is
    /// the one over which a follower receives its time.
    pub(crate) fn join_time(
        &mut self,
        name: &str,
        clock: &Arc<SimulatedClock>,
        followers: &[String],
        middleware: Option<&str>,
    ) -> Result<TimeRole, OpenError> {
        let wrong = |reason: String| OpenError::Backend {
            address: self.network.clone(),
            reason,
        };
        let address = network_time::address(&self.network).map_err(wrong)?;
        let backend = |wanted: &str| {
            let mut all = self.backends.iter();
            let found = all.find(|(name, _)| *name == wanted);
            found.map(|(_, backend)| backend.as_ref()).ok_or_else(|| {
                let names: Vec<&str> = self.backends.iter().map(|(name, _)| *name).collect();
                wrong(format!(
                    "this component cannot hear time over {wanted}; its middlewares are: {}",
                    names.join(", ")
                ))
            })
        };
        let clock = Arc::clone(clock);
        match self.clock {
            ClockKind::System => Ok(TimeRole::System),
            ClockKind::Simulated => {
                let backend = backend(middleware.unwrap_or(self.description.middleware))?;
                let follower = Follower::open(backend, &address, name, clock)?;
                Ok(TimeRole::Follower(Box::new(follower)))
            }
            ClockKind::Nodes => {
                let (middleware, of_nodes) = self.description.node_clock().ok_or_else(|| {
                    wrong("none of its middlewares has a clock of nodes".to_owned())
                })?;
                let backend = backend(middleware)?;
                let follower = Follower::open_nodes(backend, &address, name, clock, of_nodes)?;
                Ok(TimeRole::Follower(Box::new(follower)))
            }
            ClockKind::Source => {
                let state = SourceState::new(clock, followers);
                let state = Rc::new(RefCell::new(state));
                let of_nodes = self.description.node_clock();
                let state_of = Rc::clone(&state);
                let source = Source::open(&self.backends, of_nodes, &address, state_of)?;
                self.source = Some(state);
                Ok(TimeRole::Source(Box::new(source)))
            }
        }
    }

    /// The network's time, for a worker that may advance it.
    pub fn time_source(&self) -> TimeSource {
        TimeSource::new(self.source.clone(), self.exact.clone())
    }

    /// The sending end of one operation of a published slot.
    pub fn publisher(&self, slot: usize, operation: usize) -> Result<TypedPublisher, OpenError> {
        let port = if let Some(replay) = self.exact.replay() {
            Box::new(replayed_ports::Publishing::new(replay, slot, operation))
        } else {
            let open = self.slot(slot)?;
            let ports = self.backends(&open)?.into_iter().map(|(name, backend)| {
                let endpoint = self.topic_endpoint(&open, operation, name)?;
                Ok((backend.publisher(&endpoint)?, self.transport(slot, name)))
            });
            let port = fan_out::over(ports.collect::<Result<_, _>>()?);
            self.exact.publisher(slot, operation, port)
        };
        self.hops.opened(slot, operation, &port.senders());
        let port = Box::new(TappedPublisher {
            port,
            taps: Arc::clone(&self.taps),
            hops: Rc::clone(&self.hops),
            slot,
            operation,
        });
        let topic = TypedPublisher::new(port, self.slot(slot)?.operations[operation]);
        let topic = topic.behind(self.gate.clone());
        self.count(slot, topic.sent());
        let withheld = (slot, topic.withheld().clone());
        self.withheld.borrow_mut().push(withheld);
        Ok(topic)
    }

    /// Opens the publishers of a slot, each by the number of its operation: an argument for the
    /// constructors of generated publishers.
    pub fn publishers(
        &self,
        slot: usize,
    ) -> impl FnMut(usize) -> Result<TypedPublisher, OpenError> + '_ {
        move |operation| self.publisher(slot, operation)
    }

    /// The calling end of a required slot.
    pub fn client(&self, slot: usize) -> Result<TypedClient, OpenError> {
        let port = if let Some(replay) = self.exact.replay() {
            Box::new(replayed_ports::Calling::new(replay, slot))
        } else {
            let open = self.slot(slot)?;
            let port = self.backend(&open)?.client(&call_endpoint(&open)?)?;
            let port = self.converting_client(&open, slot, port)?;
            let port = match self.defaults.iter().find(|(of, _)| *of == open.described) {
                Some((_, reply)) => Box::new(DefaultingClient {
                    port,
                    reply: *reply,
                    ended: VecDeque::new(),
                }),
                None => port,
            };
            if open.qos.cache.is_some() || open.qos.fresh.is_some() {
                // A query that a kept reply answers is no request, for tools and for chains.
                let port = self.cached(&open, slot, self.tapped(slot, port));
                let port = self.exact.client(slot, port);
                return Ok(self.counted(slot, TypedClient::new(port, open.qos.timeout)));
            }
            self.exact.client(slot, port)
        };
        Ok(self.calling(slot, self.slot(slot)?.qos.timeout, port))
    }

    /// A client whose replies are kept, or know their age.
    fn cached(&self, open: &OpenSlot, slot: usize, port: Box<dyn Client>) -> Box<dyn Client> {
        let counts = FreshCounts::new(open.qos.fresh);
        self.fresh.borrow_mut().push((slot, counts.clone()));
        let simulated = self.is_time_simulated().then(|| Arc::clone(&self.now));
        Box::new(CachingClient::new(port, open, simulated, counts))
    }

    /// The client of a slot over its port, whose calls are counted, tapped and noted.
    fn calling(&self, slot: usize, timeout: Duration, port: Box<dyn Client>) -> TypedClient {
        self.counted(slot, TypedClient::new(self.tapped(slot, port), timeout))
    }

    fn counted(&self, slot: usize, client: TypedClient) -> TypedClient {
        self.count(slot, client.sent());
        client
    }

    /// A client whose calls are tapped and noted.
    fn tapped(&self, slot: usize, port: Box<dyn Client>) -> Box<dyn Client> {
        self.watch(slot, port.queue());
        self.hops.opened(slot, ALL_OPERATIONS, &port.senders());
        Box::new(TappedClient {
            port,
            taps: Arc::clone(&self.taps),
            hops: Rc::clone(&self.hops),
            slot,
        })
    }

    /// Ends the opening of members: a component does so between `initialize` and the first state of
    /// its machine. The runtime repeats it after the start.
    ///
    /// # Errors
    /// The open members are not those that the network lists and binds.
    pub fn complete_members(&self) -> Result<(), StartError> {
        self.slots.complete()
    }

    /// Opens a member of an array, whose number in the description is `array`. `open` opens its
    /// sending ends.
    ///
    /// # Errors
    /// Those of [`SlotArray::open`](crate::SlotArray::open).
    pub fn open_member<E>(
        &self,
        array: usize,
        name: &str,
        open: impl FnOnce(&Self, usize) -> Result<E, OpenError>,
    ) -> Result<(Member, E), MemberError> {
        let member = self.slots.add(array, name)?;
        let receivers = if self.is_live {
            self.receivers_of(member.slot())
        } else {
            Ok(Vec::new())
        };
        let opened = receivers.and_then(|ports| Ok((ports, open(self, member.slot())?)));
        match opened {
            Ok((ports, end)) => {
                let ports = ports.into_iter().map(|port| (member.slot(), port));
                self.receivers.borrow_mut().extend(ports);
                Ok((member, end))
            }
            Err(error) => {
                self.slots.remove_last();
                Err(error.into())
            }
        }
    }

    /// The members of an array that the network lists.
    pub fn listed(&self, array: usize) -> Option<Vec<String>> {
        self.slots.listed(array)
    }

    /// Opens the receiving ends of all slots that are not arrays, each with the index of its slot.
    pub(crate) fn receivers(&self) -> Result<Vec<(usize, Receiver)>, OpenError> {
        let mut receivers = Vec::new();
        for at in 0..self.description.slots.len() {
            if !self.description.slots[at].is_array {
                let ports = self.receivers_of(at)?;
                receivers.extend(ports.into_iter().map(|port| (at, port)));
            }
        }
        Ok(receivers)
    }

    /// The receiving ends of the members that the worker has opened, each with the index of its
    /// slot.
    pub(crate) fn take_members(&self) -> Vec<(usize, Receiver)> {
        self.receivers.take()
    }

    /// Opens the receiving ends of a slot.
    fn receivers_of(&self, at: usize) -> Result<Vec<Receiver>, OpenError> {
        let slot = self.slot(at)?;
        match slot.role {
            Role::Implements => {
                let backends = self.backends(&slot)?.into_iter();
                let ports = backends.map(|(name, backend)| {
                    let port = backend.server(&call_endpoint(&slot)?)?;
                    self.watch(at, port.queue());
                    Ok(Receiver::Server {
                        port: self.exact.server(at, port),
                        counter: self.transport(at, name),
                    })
                });
                ports.collect()
            }
            Role::SubscribesTo => {
                let operations = 0..slot.operations.len();
                let ports = operations.map(|operation| {
                    let endpoint = self.topic_endpoint(&slot, operation, slot.middleware())?;
                    let port = self.backend(&slot)?.subscriber(&endpoint)?;
                    self.watch(at, port.queue());
                    Ok((endpoint, port))
                });
                let ports = ports.collect::<Result<_, OpenError>>()?;
                let ports = self.converting_subscribers(&slot, at, ports)?;
                let ports = ports.into_iter().enumerate();
                let ports = ports.map(|(operation, (endpoint, port))| {
                    let port = self.shared_early((&slot, operation), &endpoint, port)?;
                    Ok(Receiver::Subscriber {
                        port: self.exact.subscriber(at, operation, port),
                        operation,
                        deadline: topic_qos(&slot, operation, slot.middleware(), &self.settings)
                            .deadline,
                    })
                });
                ports.collect()
            }
            Role::Requires | Role::Publishes => Ok(Vec::new()),
        }
    }

    /// The slots.
    pub(crate) fn slots(&self) -> &Arc<SlotTable> {
        &self.slots
    }

    /// Gives the parameters of the component to the middlewares.
    pub(crate) fn parameters(&self, service: &Arc<dyn ParameterService>) -> Result<(), OpenError> {
        let mut backends = self.backends.iter();
        backends.try_for_each(|(_, backend)| backend.parameters(Arc::clone(service)))
    }

    /// Gives the life cycle of the component to the middlewares.
    pub(crate) fn lifecycle(&self, service: &Arc<dyn LifecycleService>) -> Result<(), OpenError> {
        let mut backends = self.backends.iter();
        backends.try_for_each(|(_, backend)| backend.lifecycle(Arc::clone(service)))
    }

    /// Gives the log of the component to the middlewares that publish it.
    pub(crate) fn log(&self, log: &Arc<LogQueue>) -> Result<(), OpenError> {
        let mut is_published = false;
        for (_, backend) in &self.backends {
            is_published |= backend.log(log)?;
        }
        if !is_published {
            log.close(false);
        }
        Ok(())
    }

    /// Whether all messages have arrived. Waits for that at most `limit` with each middleware.
    pub(crate) fn have_arrived(&self, limit: Duration) -> bool {
        let mut backends = self.backends.iter();
        backends.all(|(_, backend)| backend.have_arrived(limit))
    }

    /// Waits until the last messages have arrived, at most for `limit`.
    pub(crate) fn linger(&self, limit: Duration) {
        for (_, backend) in &self.backends {
            backend.linger(limit);
        }
    }

    fn slot(&self, slot: usize) -> Result<Arc<OpenSlot>, OpenError> {
        self.slots.get(slot).ok_or_else(|| OpenError::Backend {
            address: self.network.clone(),
            reason: format!("the component has no slot {slot}; generate it again"),
        })
    }

    /// The middleware of a consumer.
    fn backend(&self, slot: &OpenSlot) -> Result<&dyn Backend, OpenError> {
        self.opened(slot, slot.middleware())
    }

    /// The middlewares of a provider.
    fn backends(&self, slot: &OpenSlot) -> Result<Vec<(&'static str, &dyn Backend)>, OpenError> {
        let names = slot.transports.iter();
        names
            .map(|name| Ok((*name, self.opened(slot, name)?)))
            .collect()
    }

    fn opened(&self, slot: &OpenSlot, wanted: &str) -> Result<&dyn Backend, OpenError> {
        let found = self.backends.iter().find(|(name, _)| *name == wanted);
        found
            .map(|(_, backend)| backend.as_ref())
            .ok_or_else(|| OpenError::Backend {
                address: slot.name.to_string(),
                reason: format!("this component was generated without {wanted}; generate it again"),
            })
    }

    fn topic_endpoint(
        &self,
        slot: &OpenSlot,
        operation: usize,
        middleware: &str,
    ) -> Result<Endpoint, OpenError> {
        let mut qos = topic_qos(slot, operation, middleware, &self.settings);
        if self.clock != ClockKind::System {
            // A middleware would measure it by the system's clock; the event loop measures it by
            // the network's.
            qos.deadline = None;
        }
        let external = slot.external_types().nth(operation);
        let operation = &slot.operations[operation];
        let types = TypeIdentity {
            name: format!("{}/{}", slot.type_name, operation.name),
            hash: operation.type_hash,
        };
        Ok(Endpoint {
            address: slot.address()?.join(operation.name),
            types,
            qos,
            external_types: external.into_iter().collect(),
        })
    }
}
