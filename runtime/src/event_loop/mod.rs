//! The event loop of a component: it runs handlers as messages arrive and `compute()` on its
//! period, on one thread.
//!
//! A turn runs a bounded number of handlers, then `compute()` if it is due. The loop counts and
//! reports a `compute()` or a handler that takes longer than the period. It never catches up on
//! missed periods.

mod calls;
mod commands;
mod lifecycle;
mod network_time;
mod peers;
mod port;
mod report;
mod serving;
mod sweep;
mod timer;

use crate::commands::CommandQueue;
use crate::component::Component;
use crate::ports::{Connections, Receiver};
use crate::status::{Activity, Shared};
use crate::time::TimeRole;
use crate::worker_error::WorkerError;
use calls::Calls;
use network_time::stamp;
use peers::PeerInterval;
use port::Port;
pub(crate) use port::{answer, receive};
use rc_management::component::State;
use report::HandledMessages;
pub(crate) use report::LogLimit;
use rustix::event::{Timespec, epoll};
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::time::{Duration, Instant};
use sweep::{Look, Sweep};
use timer::Timer;

/// The most handlers that run in a turn, before a `compute()` that is due.
const HANDLERS_A_TURN: usize = 64;
/// No handler begins in a turn after this time: slow ones would keep `compute()` and the heartbeat
/// waiting, while messages come faster than they are handled. In lockstep only the number counts,
/// so that a run repeats.
const HANDLING_A_TURN: Duration = Duration::from_millis(100);
/// The longest wait. The heartbeat reports the age of the last turn, and a backend may lose a
/// wake-up (iceoryx2 0.10 does, rarely), so the loop looks at every port this often.
const LONGEST_WAIT: Duration = Duration::from_millis(50);
/// The shortest time between two log messages about the same port, or about `compute()`.
const LOG_PAUSE: Duration = Duration::from_secs(1);
/// The longest time for which the status does not count a message that was handled without any
/// trouble.
const COUNT_INTERVAL: Duration = Duration::from_millis(100);

const TIMER: u64 = u64::MAX;
const WAKE_EVENT: u64 = u64::MAX - 1;
/// The replies to calls that the worker has started.
const CALLS: u64 = u64::MAX - 2;
/// The ends of the network's time, from this number on.
const TIME: u64 = 1 << 32;

pub(crate) struct EventLoop<'a> {
    component: &'a mut dyn Component,
    shared: Arc<Shared>,
    commands: Arc<CommandQueue>,
    connections: &'a Connections,
    ports: Vec<Port>,
    calls: Calls,
    epoll: OwnedFd,
    timer: Timer,
    period: Duration,
    first_port: usize,
    /// The messages of this turn, which the status does not count yet.
    handled: HandledMessages,
    peers: PeerInterval,
    sweep: Sweep,
    fatal: Option<String>,
    logged: LogLimit,
    /// This component's part in the time of its network.
    role: TimeRole,
    /// When the loop began: the zero of [`stamp`] where the system's clock rules.
    began: Instant,
    /// How often the ports were served in this component's turn of a tick.
    rounds: usize,
    /// When this component began to hold tick 0 for its peers.
    waits_since: Option<Instant>,
    /// When the messages of this turn were sent, while some have not arrived.
    arriving_since: Option<Instant>,
}

impl<'a> EventLoop<'a> {
    pub(crate) fn new(
        component: &'a mut dyn Component,
        connections: &'a Connections,
        receivers: Vec<(usize, Receiver)>,
        commands: Arc<CommandQueue>,
        role: TimeRole,
    ) -> io::Result<Self> {
        let shared = component.core().shared.clone();
        let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
        let timer = Timer::new()?;
        let watch = |fd: rustix::fd::BorrowedFd<'_>, data: u64| {
            epoll::add(
                &epoll,
                fd,
                epoll::EventData::new_u64(data),
                epoll::EventFlags::IN,
            )
        };
        watch(timer.descriptor(), TIMER)?;
        watch(shared.wake_event.as_fd(), WAKE_EVENT)?;
        for (at, (_, receiver)) in receivers.iter().enumerate() {
            match receiver {
                Receiver::Server { port, .. } => watch(port.descriptor(), at as u64)?,
                Receiver::Subscriber { port, .. } => watch(port.descriptor(), at as u64)?,
            }
        }
        match &role {
            TimeRole::System => {}
            TimeRole::Follower(follower) => watch(follower.descriptor(), TIME)?,
            TimeRole::Source(source) => {
                for (at, descriptor) in source.descriptors().enumerate() {
                    watch(descriptor, TIME + at as u64)?;
                }
            }
        }
        let ports = receivers
            .into_iter()
            .filter_map(|(slot, receiver)| {
                Some(Port::new(slot, connections.slots().get(slot)?, receiver))
            })
            .collect();
        let period = component.core().period();
        let calls = Calls::new(component, connections.slots());
        let now = Instant::now();
        Ok(Self {
            calls,
            component,
            shared,
            commands,
            connections,
            ports,
            epoll,
            timer,
            period,
            first_port: 0,
            handled: HandledMessages::new(now),
            peers: PeerInterval::default(),
            sweep: Sweep::new(now),
            fatal: None,
            logged: LogLimit::default(),
            role,
            began: now,
            rounds: 0,
            waits_since: None,
            arriving_since: None,
        })
    }

    /// Runs until the component is to stop. An error is the reason of a worker or a middleware that
    /// failed.
    pub(crate) fn run(&mut self) -> Result<(), String> {
        if !matches!(self.role, TimeRole::Follower(_)) {
            self.timer
                .set(Duration::from_nanos(1), self.period)
                .map_err(|e| format!("the timer cannot be set: {e}"))?;
        }
        self.enter(State::Running);
        while !self.shared.wake_event.is_stopping() && self.fatal.is_none() {
            let due = self
                .wait()
                .map_err(|e| format!("waiting for events failed: {e}"))?;
            let now = Instant::now();
            let sweep = self.wake_all(now);
            self.shared.turned(now);
            self.execute_commands();
            self.change_lifecycle();
            let due = self.follow_time(now, sweep, due);
            self.serve(now);
            if self.component.has_turns() {
                self.component.turn();
            }
            self.take_failure();
            self.react();
            self.check_deadlines(now);
            let due = due || self.ends_turn();
            if due && !self.shared.wake_event.is_stopping() && self.fatal.is_none() {
                self.compute();
            }
            let ends = self.ends_left();
            if ends > 0 {
                self.end_calls(ends);
            }
            for port in self.ports.iter_mut().filter(|port| port.is_full) {
                port.find_room(&*self.component);
            }
            self.settle_own_changes();
            self.take_failure();
            self.tell_time(now);
            self.apply_period();
            if self.peers.are_due(now) {
                let counts = self.count_peers(now);
                peers::note(counts, self.connections, &self.shared);
            }
        }
        self.enter(State::Stopping);
        // No call starts any more, so this ends.
        loop {
            self.end_calls(HANDLERS_A_TURN);
            if !self.calls.has_more {
                break;
            }
        }
        self.leave_time();
        self.finish_lifecycle();
        self.component.finalize();
        self.take_failure();
        match self.fatal.take() {
            Some(reason) => Err(reason),
            None => Ok(()),
        }
    }

    fn enter(&mut self, state: State) {
        self.shared.status().state = state;
        tracing::debug!("{}", state.word());
    }

    /// Waits for an event. Returns whether a `compute()` is due.
    fn wait(&mut self) -> io::Result<bool> {
        let awake = self
            .ports
            .iter_mut()
            .filter(|port| port.spin_until.is_some());
        for port in awake {
            port.ready = true;
        }
        let (gated, ends) = (self.is_gated(), self.ends_left() > 0);
        let ready = self.ports.iter().any(|p| p.may_be_served(gated));
        let limit = if ready || self.role.is_in_a_hurry() || (self.calls.has_more && ends) {
            Duration::ZERO
        } else {
            self.longest_wait()
        };
        // Calls that may not end now do not wake the loop.
        let limit = if ends {
            let (epoll, in_order) = (&self.epoll, self.role.is_lockstep());
            self.calls
                .watch(&mut *self.component, (epoll, CALLS), in_order, limit)?
        } else {
            limit
        };
        let limit = self.wait_in_window(limit);
        let limit = Timespec {
            tv_sec: 0,
            tv_nsec: i64::from(limit.subsec_nanos()),
        };
        let mut events = [MaybeUninit::uninit(); 16];
        let waited = epoll::wait(&self.epoll, &mut events, Some(&limit));
        if ends {
            self.calls.unwatch(&mut *self.component, &self.epoll)?;
        }
        let events = match waited {
            Err(rustix::io::Errno::INTR) => return Ok(false),
            other => other?.0,
        };
        let mut due = false;
        for event in events {
            match event.data.u64() {
                TIMER => due = self.take_period(),
                WAKE_EVENT => self.shared.wake_event.clear(),
                CALLS => {}
                at if at >= TIME => self.role.wake((at - TIME) as usize),
                at => {
                    if let Some(port) = self.ports.get_mut(at as usize) {
                        port.wake(true);
                        if !port.may_be_served(gated) {
                            port.postpone();
                        }
                    }
                }
            }
        }
        Ok(due)
    }

    /// Waits in the window of the worker, if it has one. Returns for how long the loop waits itself.
    fn wait_in_window(&mut self, limit: Duration) -> Duration {
        if !self.component.has_window() {
            return limit;
        }
        let hops = self.connections.hops();
        hops.begin();
        let result = self.component.wait_in_window(self.epoll.as_fd(), limit);
        hops.end(false);
        if let Err(WorkerError::Failed(message)) = &result {
            if self.logged.allows(Instant::now()) {
                tracing::warn!("the window: {message}");
            }
            self.shared.status().last_error = Some(message.clone());
        }
        self.apply(result);
        Duration::ZERO
    }

    /// Makes the loop look at every port, once in the time of the longest wait. Says whether it
    /// does now.
    fn wake_all(&mut self, now: Instant) -> bool {
        let Some(look) = self.sweep.due(now) else {
            return false;
        };
        for port in self.ports.iter_mut().filter(|port| !port.ready) {
            match look {
                Look::WakeUps => port.wake(false),
                Look::Messages => port.look(),
            }
        }
        true
    }

    /// Counts the periods that were missed. Returns whether one is over.
    fn take_period(&mut self) -> bool {
        let Some(over) = self.timer.take() else {
            return false;
        };
        if over > 1 {
            self.shared.status().overruns += over - 1;
        }
        true
    }

    /// Counts the peers of each slot.
    fn count_peers(&mut self, now: Instant) -> Vec<usize> {
        let here = stamp(&self.role, self.began, now);
        let slots = self.connections.slots().len();
        peers::count(&mut self.ports, &*self.component, slots, here)
    }

    fn enter_emergency(&mut self, reason: &str) {
        if self.component.core().state() != State::Emergency {
            tracing::error!("emergency: {reason}");
            self.enter(State::Emergency);
        }
    }

    /// Lets the state machine handle the events that handlers fired, or that are due.
    fn react(&mut self) {
        let runs = self.fatal.is_none() && !self.shared.wake_event.is_stopping();
        if runs && !self.is_gated() && self.idle_state().is_none() {
            let hops = self.connections.hops();
            hops.begin();
            let result = self.component.react();
            hops.end(false);
            self.apply(result);
        }
    }

    /// The longest wait: `LONGEST_WAIT`, or until the next delayed event of the state machine is
    /// due.
    fn longest_wait(&mut self) -> Duration {
        let is_gated = self.is_gated();
        let is_idle = self.idle_state().is_some();
        let Some(machine) = self.component.machine().filter(|_| !is_idle) else {
            return LONGEST_WAIT;
        };
        if machine.has_events() && !is_gated {
            return Duration::ZERO;
        }
        match machine.next_due() {
            Some(due) if matches!(self.role, TimeRole::System) => {
                (due - self.component.core().now()).min(LONGEST_WAIT)
            }
            _ => LONGEST_WAIT,
        }
    }

    fn compute(&mut self) {
        if self.idle_state().is_some() {
            return;
        }
        if self.component.core().state() == State::Emergency {
            self.component.emergency();
            return;
        }
        let start = Instant::now();
        let hops = self.connections.hops();
        hops.begin();
        let result = self.component.compute();
        hops.end(true);
        let took = start.elapsed();
        let is_overrun = self.is_overrun(took);
        {
            let mut status = self.shared.status();
            status.compute.count(took, result.is_ok());
            if is_overrun {
                status.overruns += 1;
                status.delta.overrun(Activity::Compute, took);
            }
            if let Err(WorkerError::Failed(message)) = &result {
                status.last_error = Some(message.clone());
            }
        }
        let slow = is_overrun && result.is_ok();
        let is_news = slow || matches!(result, Err(WorkerError::Failed(_)));
        if is_news && self.logged.allows(Instant::now()) {
            if slow {
                tracing::warn!(
                    "compute() took {took:?}, longer than its period of {:?}",
                    self.period
                );
            }
            if let Err(WorkerError::Failed(message)) = &result {
                tracing::warn!("compute(): {message}");
            }
        }
        self.apply(result);
    }

    /// Changes the state as the result of the worker demands.
    fn apply(&mut self, result: Result<(), WorkerError>) {
        match result {
            Err(WorkerError::Emergency(reason)) => self.enter_emergency(&reason),
            Err(WorkerError::Fatal(reason)) => self.fatal = Some(reason),
            Ok(()) | Err(WorkerError::Failed(_)) => {}
        }
    }

    /// Takes over what a function of the worker reported to `Core::fail`.
    fn take_failure(&mut self) {
        if let Some(reason) = self.component.core().fatal.take() {
            self.fatal.get_or_insert(reason);
        }
    }

    fn apply_period(&mut self) {
        let Some(period) = self.component.core().new_period.take() else {
            return;
        };
        self.period = period.max(Duration::from_micros(100));
        self.shared.status().period = self.period;
        if let TimeRole::Follower(follower) = &mut self.role {
            let now = follower.now();
            return follower.schedule.set_period(now, self.period);
        }
        if let Err(error) = self.timer.set(self.period, self.period) {
            self.fatal = Some(format!("the period cannot be set: {error}"));
        }
    }
}
