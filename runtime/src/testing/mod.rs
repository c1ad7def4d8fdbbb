//! Base of the generated context for tests: fake peers, virtual time, no process and no
//! middleware.
//!
//! A worker under test has its real [`Core`], clients and publishers. Their ports end in this
//! module: a call goes to a [`FakeServer`], a sample to a [`FakeSubscriber`]. All of it stays on
//! the thread of the test. [`embed`] runs a whole component, whose missing servers are replaced.

mod answers;
mod array;
mod backend;
mod bench;
mod context;
pub(crate) mod defaults;
mod server;
mod subscriber;

pub use crate::adapter::embed_with_defaults;
pub use crate::process::embed_with_defaults as embed;
#[doc(hidden)]
pub use answers::{Answering, Defaults, HasResult, signature};
pub use array::FakeArray;
pub use bench::Bench;
pub use defaults::DefaultReply;
pub use rc_middleware::in_place::boxed as in_place;
pub use server::{FakeCall, FakeServer, Fault, unknown};
pub use subscriber::{FakeSample, FakeSubscriber};

use crate::adapter::{self, Living};
use crate::arguments::Arguments;
use crate::clock::{Clock, SimulatedClock, Time};
use crate::configuration;
use crate::context::Core;
use crate::description::{Description, Slot};
use crate::error::StartError;
use crate::lifecycle::{Hook, LifecycleState, Missed, Transition};
use crate::own_changes::OwnChanges;
use crate::ports::{Connections, Ports};
use crate::slots::{Listed, SlotTable, Transports};
use crate::status::{NetworkTime, Shared};
use crate::worker_error::WorkerError;
use backend::{FakeBackend, Hub};
use rc_configuration::Values;
use rc_management::component::{ClockKind, State};
use rc_middleware::typed::Operation;
use rc_middleware::{Address, Backend, Member, OpenError, WakeEvent};
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// The network of a component under test, which messages name.
const NETWORK: &str = "test";

/// The most calls that end between two periods, as in a running component.
const MOST_ENDS: usize = 64;

/// The shortest period, as in a running component.
const SHORTEST_PERIOD: Duration = Duration::from_micros(100);

/// A fake peer of a slot that calls or publishes.
pub trait Fake: Clone + 'static {
    /// The peer of a slot, or of a member of an array, by the slot's number.
    #[doc(hidden)]
    fn new(bed: &TestBed, slot: usize, member: Option<&str>) -> Self;

    /// Answers every query that has no answer yet with default values.
    fn answer_defaults(&self) {}
}

/// The peers, the clock and the state of a component under test.
#[derive(Clone)]
pub struct TestBed {
    description: &'static Description,
    clock: Arc<SimulatedClock>,
    shared: Arc<Shared>,
    hub: Rc<Hub>,
    slots: Arc<SlotTable>,
}

/// A component under test before its context is made.
pub struct Parts {
    /// Controls the test.
    pub bed: TestBed,
    /// For the context.
    pub core: Core,
    /// For the clients and publishers of the context.
    pub ports: Ports,
}

/// The values of a configuration, and the period that it sets.
pub struct Configured {
    /// The values of the parameters.
    pub values: Values,
    /// The period, where it differs from that of the `.cdsl`.
    pub period: Option<Duration>,
}

/// Reads and checks `etc/config.toml` as the component does when it starts.
pub fn configured(description: &'static Description) -> Result<Configured, StartError> {
    configured_by(description, None)
}

/// [`configured`] with the configuration in `file`.
pub fn configured_by(
    description: &'static Description,
    file: Option<PathBuf>,
) -> Result<Configured, StartError> {
    let arguments = Arguments {
        config: file,
        ..Arguments::new(NETWORK, description.name)
    };
    let loaded = configuration::load(description, &arguments)?;
    Ok(Configured {
        values: loaded.values(),
        period: loaded.configuration.period,
    })
}

impl TestBed {
    /// The parts of a component under test. Its time begins at zero, its state is `Running`.
    pub fn parts(description: &'static Description) -> Result<Parts, StartError> {
        let wake_event = WakeEvent::new().map_err(|e| StartError::cannot_create("an event", &e))?;
        let clock = Arc::new(SimulatedClock::default());
        let kind = if description.simulates_time {
            ClockKind::Source
        } else {
            ClockKind::Simulated
        };
        let shared = Arc::new(Shared::new(
            wake_event.clone(),
            description.period,
            description.slots.len(),
            NetworkTime::new(kind, clock.clone()),
            description.managed,
        ));
        shared.status().state = State::Running;
        let hub = Rc::new(Hub::new(wake_event));
        let mut backends: Vec<(&'static str, Box<dyn Backend>)> = Vec::new();
        for linked in description.backends {
            let fake = FakeBackend::new(linked.name, Rc::clone(&hub));
            backends.push((linked.name, Box::new(fake)));
        }
        let slots = Arc::new(slots(description)?);
        let mut ports = Connections::over(description, backends, &slots, NETWORK, kind);
        if description.simulates_time {
            ports.simulate_time(&clock);
        }
        if let Some(lifecycle) = &shared.lifecycle {
            ports.set_gate(lifecycle.gate());
        }
        let mut core = Core::new(description.name, NETWORK, Arc::clone(&shared), 0);
        core.own_changes = OwnChanges::Kept(Vec::new());
        let bed = Self {
            description,
            clock,
            shared,
            hub,
            slots,
        };
        let ports = Rc::new(ports);
        Ok(Parts { bed, core, ports })
    }

    /// Sets the time, possibly to an earlier one.
    pub fn set_time(&self, time: Time) {
        self.clock.set(time);
    }

    /// Moves time forward.
    pub fn advance(&self, step: Duration) {
        self.clock.set(self.clock.now() + step);
    }

    /// Sets what `ctx.state()` returns.
    pub fn set_state(&self, state: State) {
        self.shared.status().state = state;
    }

    /// Takes a transition of the life cycle: `run` calls the worker.
    ///
    /// # Errors
    /// The transition is not possible in this state, or its function has failed.
    pub fn take(
        &self,
        transition: Transition,
        run: impl FnMut(Hook<'_>) -> Result<(), WorkerError>,
    ) -> Result<LifecycleState, Missed> {
        match &self.shared.lifecycle {
            Some(lifecycle) => lifecycle.take(transition, run),
            None => Ok(LifecycleState::Active),
        }
    }

    /// Runs a component for this time: [`Bench::run`], for the runtimes of all languages. `end_call`
    /// lets it handle the end of one call of a slot, and says whether there was one.
    #[doc(hidden)]
    pub fn run<J: Living>(
        &self,
        component: &mut J,
        time: Duration,
        mut emergency: impl FnMut(&mut J),
        mut end_call: impl FnMut(&mut J, usize, Option<&Member>) -> bool,
    ) -> Result<(), WorkerError> {
        let mut left = time;
        while !left.is_zero() && !component.core().is_stopping() {
            let state = component.core().lifecycle();
            if state.is_none_or(|state| state == LifecycleState::Active) {
                self.turn(component, &mut emergency)?;
            }
            self.end_calls(|slot, member| end_call(component, slot, member));
            self.end_period(component.core(), &mut left);
        }
        Ok(())
    }

    /// One period of an active component.
    fn turn<J: Living>(
        &self,
        component: &mut J,
        emergency: &mut impl FnMut(&mut J),
    ) -> Result<(), WorkerError> {
        let noted = |result| match result {
            Err(WorkerError::Emergency(_)) => {
                self.set_state(State::Emergency);
                Ok(())
            }
            other => other,
        };
        noted(adapter::react(component))?;
        if component.core().is_stopping() {
            return Ok(());
        }
        if component.core().state() == State::Emergency {
            emergency(component);
            return Ok(());
        }
        noted(adapter::step(component))
    }

    /// Ends the started calls that have ended: [`Bench::end_calls`], for the runtimes of all
    /// languages.
    #[doc(hidden)]
    pub fn end_calls(&self, mut end_call: impl FnMut(usize, Option<&Member>) -> bool) -> usize {
        let mut end_one = || {
            let all = self.slots.all();
            let mut slots = all.iter();
            slots.any(|of| end_call(of.described, of.member.as_ref()))
        };
        let mut ended = 0;
        // A handler may start a call that has ended then.
        while ended < MOST_ENDS && end_one() {
            ended += 1;
        }
        ended
    }

    /// Advances time by a period, or by `left` if that is less, and subtracts it. The worker of a
    /// source of time advances time itself.
    pub fn end_period(&self, core: &mut Core, left: &mut Duration) {
        if let Some(period) = core.new_period.take() {
            self.shared.status().period = period.max(SHORTEST_PERIOD);
        }
        let step = core.period().min(*left);
        *left -= step;
        if !self.description.simulates_time {
            self.advance(step);
        }
    }
}

/// The slots at addresses of their own names, because two slots may have one interface. Any member
/// may be opened.
fn slots(description: &'static Description) -> Result<SlotTable, OpenError> {
    let own = |slot: &Slot| {
        let text = format!("{NETWORK}/{}", slot.name);
        let address = Address::parse(&text).map_err(|reason| OpenError::Backend {
            address: text,
            reason,
        })?;
        Ok((slot.name.to_owned(), address))
    };
    let slots = description.slots.iter().filter(|slot| !slot.is_array);
    let bindings = slots.map(own).collect::<Result<_, OpenError>>()?;
    SlotTable::new(
        description,
        (NETWORK, description.name),
        &bindings,
        &Transports::new(),
        Listed::new(),
    )
}

impl TestBed {
    /// Calls `make` for each member of the array `slot` that the worker opens.
    pub fn prepare_members(&self, slot: usize, make: impl Fn(&Self, &str) + 'static) {
        let (description, slots) = (self.description, Arc::clone(&self.slots));
        let (clock, shared) = (Arc::clone(&self.clock), Arc::clone(&self.shared));
        let array = self.slots.array_address(description.slots[slot].name);
        // The hub keeps this function, which must not keep the hub.
        self.hub.prepare(&array, move |hub, name| {
            let bed = Self {
                description,
                clock: Arc::clone(&clock),
                shared: Arc::clone(&shared),
                hub: Rc::clone(hub),
                slots: Arc::clone(&slots),
            };
            make(&bed, name);
        });
    }

    /// Ends the opening of members, as the end of `initialize` does.
    ///
    /// # Errors
    /// The open members are not the listed ones.
    pub fn complete_members(&self) -> Result<(), StartError> {
        self.slots.complete()
    }

    /// Lists the members of an array as a network does, before the worker opens them.
    ///
    /// # Panics
    /// The component has no such array.
    pub fn list_members(&self, array: &str, members: &[&str]) {
        let mut arrays = self.description.slots.iter().filter(|slot| slot.is_array);
        assert!(
            arrays.any(|slot| slot.name == array),
            "{} has no slot array `{array}`",
            self.description.name
        );
        self.slots.list(array, members);
    }

    /// The operations and the address of a slot, or of a member of an array, by its number in the
    /// description.
    fn end(&self, slot: usize, member: Option<&str>) -> (&'static [Operation], String) {
        let of = &self.description.slots[slot];
        let own = || self.slots.get(slot)?.address.clone();
        let address = match member {
            Some(member) => self.slots.address(of.name, member).ok(),
            None => own(),
        };
        // A slot without an address is not opened either.
        let address = address.map_or_else(String::new, |address| address.to_string());
        (of.operations, address)
    }
}
