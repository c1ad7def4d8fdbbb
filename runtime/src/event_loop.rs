//! The one loop of a component: handlers as messages arrive, `compute()` on its period, both on one thread.
//!
//! Handlers that are ready run boundedly, then a `compute()` that is due runs. A `compute()` or handler that
//! takes longer than the period is counted and reported; what was missed is never made up for.

use crate::commands::{Command, CommandQueue};
use crate::component::{Component, WorkerError};
use crate::description::Description;
use crate::ports::{Ports, Receiver};
use crate::status::{Activity, Shared};
use rc_management::component::State;
use rc_middleware::typed::{HandlerError, Request};
use rc_middleware::{Gaps, Header, Reader, Reply};
use rustix::event::{Timespec, epoll};
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, timerfd_create, timerfd_settime,
};
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Handlers that run before a `compute()` that is due.
const HANDLERS_A_TURN: usize = 64;
/// No wait is longer: the heartbeat wants the loop to come round, and a backend may lose a wake-up
/// (iceoryx2 0.10 does, rarely), so every port is looked at this often, whatever else happens.
const LONGEST_WAIT: Duration = Duration::from_millis(50);
/// The same complaint is logged at most this often.
const COMPLAINT_PAUSE: Duration = Duration::from_secs(1);
/// How often the numbers of peers are looked up.
const PEERS_PAUSE: Duration = Duration::from_secs(1);

const TIMER: u64 = u64::MAX;
const WAKE_EVENT: u64 = u64::MAX - 1;

pub(crate) struct EventLoop<'a> {
    component: &'a mut dyn Component,
    description: &'static Description,
    shared: Arc<Shared>,
    commands: Arc<CommandQueue>,
    connections: &'a Ports,
    ports: Vec<Port>,
    epoll: OwnedFd,
    timer: OwnedFd,
    period: Duration,
    first_port: usize,
    /// The messages of this turn, which the status does not count yet.
    handled: Vec<Handled>,
    peers_at: Option<Instant>,
    swept: Instant,
    fatal: Option<String>,
    complained: Option<Instant>,
}

/// One handled message.
struct Handled {
    slot: usize,
    took: Duration,
    /// Samples of the same sender that were lost right before it.
    lost: u64,
    ok: bool,
}

struct Port {
    slot: usize,
    receiver: Receiver,
    ready: bool,
    gaps: Gaps,
    /// How often in a row nothing could be taken from it.
    failures: usize,
    /// Whether its descriptor was readable, so that there is a wake-up to take back.
    woken: bool,
    /// Whether the wake-ups were taken back since it became ready.
    acknowledged: bool,
    /// Until when it is looked at again and again, without sleeping.
    awake_until: Option<Instant>,
    complained: Option<Instant>,
    /// The longest time between two values of a topic, and when the last one came, or its first publisher.
    deadline: Option<Duration>,
    heard: Option<Instant>,
}

impl Port {
    /// It is to be looked at; `woken`: because its descriptor is readable.
    fn wake(&mut self, woken: bool) {
        self.ready = true;
        self.woken = woken;
        self.acknowledged = false;
    }

    /// Nothing is there. What came before its wake-up was taken back has to be looked for once more; what comes later
    /// wakes.
    fn rest(&mut self, now: Instant) {
        if self.awake_until.is_some_and(|until| now < until) {
            // Its wake-up stays, and spares those who send another one.
            self.ready = false;
        } else if self.awake_until.take().is_some() {
            self.wake(false);
        } else if self.acknowledged {
            self.ready = false;
        } else {
            self.receiver.acknowledge(self.woken);
            self.acknowledged = true;
        }
    }
}

impl<'a> EventLoop<'a> {
    pub(crate) fn new(
        component: &'a mut dyn Component,
        description: &'static Description,
        connections: &'a Ports,
        receivers: Vec<(usize, Receiver)>,
        commands: Arc<CommandQueue>,
    ) -> io::Result<Self> {
        let shared = component.core().shared.clone();
        let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
        let timer = timerfd_create(
            TimerfdClockId::Monotonic,
            TimerfdFlags::CLOEXEC | TimerfdFlags::NONBLOCK,
        )?;
        let watch = |fd: rustix::fd::BorrowedFd<'_>, data: u64| {
            epoll::add(
                &epoll,
                fd,
                epoll::EventData::new_u64(data),
                epoll::EventFlags::IN,
            )
        };
        watch(timer.as_fd(), TIMER)?;
        watch(shared.wake_event.as_fd(), WAKE_EVENT)?;
        for (at, (_, receiver)) in receivers.iter().enumerate() {
            match receiver {
                Receiver::Server(port) => watch(port.descriptor(), at as u64)?,
                Receiver::Subscriber { port, .. } => watch(port.descriptor(), at as u64)?,
            }
        }
        // What arrived before the first wait is served at once.
        let ports = receivers
            .into_iter()
            .map(|(slot, receiver)| Port {
                slot,
                deadline: match receiver {
                    Receiver::Subscriber { deadline, .. } => deadline,
                    Receiver::Server(_) => None,
                },
                receiver,
                ready: true,
                gaps: Gaps::default(),
                failures: 0,
                woken: false,
                acknowledged: false,
                awake_until: None,
                complained: None,
                heard: None,
            })
            .collect();
        let period = component.core().period();
        Ok(Self {
            component,
            description,
            shared,
            commands,
            connections,
            ports,
            epoll,
            timer,
            period,
            first_port: 0,
            handled: Vec::with_capacity(HANDLERS_A_TURN),
            peers_at: None,
            swept: Instant::now(),
            fatal: None,
            complained: None,
        })
    }

    /// Runs until a stop; an error is what made the worker end.
    pub(crate) fn run(&mut self) -> Result<(), String> {
        self.arm(Duration::from_nanos(1))
            .map_err(|e| format!("the timer cannot be set: {e}"))?;
        self.enter(State::Running);
        while !self.shared.wake_event.is_stopping() && self.fatal.is_none() {
            let due = self
                .wait()
                .map_err(|e| format!("waiting for events failed: {e}"))?;
            let now = Instant::now();
            self.sweep(now);
            self.shared.turned(now);
            self.execute_commands();
            self.handlers(now);
            self.listen();
            if due && !self.shared.wake_event.is_stopping() && self.fatal.is_none() {
                self.compute();
            }
            self.new_period();
            self.peers(now);
        }
        self.enter(State::Stopping);
        self.component.finalize();
        match self.fatal.take() {
            Some(reason) => Err(reason),
            None => Ok(()),
        }
    }

    fn enter(&mut self, state: State) {
        self.shared.status().state = state;
        tracing::debug!("{}", state.word());
    }

    fn arm(&self, first: Duration) -> io::Result<()> {
        let spec = |d: Duration| Timespec {
            tv_sec: d.as_secs() as i64,
            tv_nsec: i64::from(d.subsec_nanos()),
        };
        let timing = Itimerspec {
            it_interval: spec(self.period),
            it_value: spec(first),
        };
        timerfd_settime(&self.timer, TimerfdTimerFlags::empty(), &timing)?;
        Ok(())
    }

    /// Waits for anything; says whether a `compute()` is due.
    fn wait(&mut self) -> io::Result<bool> {
        let awake = self
            .ports
            .iter_mut()
            .filter(|port| port.awake_until.is_some());
        for port in awake {
            port.ready = true;
        }
        let limit = if self.ports.iter().any(|p| p.ready) {
            Duration::ZERO
        } else {
            LONGEST_WAIT
        };
        let limit = Timespec {
            tv_sec: 0,
            tv_nsec: i64::from(limit.subsec_nanos()),
        };
        let mut events = [MaybeUninit::uninit(); 16];
        let events = match epoll::wait(&self.epoll, &mut events, Some(&limit)) {
            Err(rustix::io::Errno::INTR) => return Ok(false),
            other => other?.0,
        };
        let mut due = false;
        for event in events {
            match event.data.u64() {
                TIMER => due = self.tick(),
                WAKE_EVENT => self.shared.wake_event.clear(),
                at => {
                    if let Some(port) = self.ports.get_mut(at as usize) {
                        port.wake(true);
                    }
                }
            }
        }
        Ok(due)
    }

    /// Has every port looked at, where that was not done for as long as a wait may be.
    fn sweep(&mut self, now: Instant) {
        if now.saturating_duration_since(self.swept) >= LONGEST_WAIT {
            self.swept = now;
            for port in self.ports.iter_mut().filter(|port| !port.ready) {
                port.wake(false);
            }
        }
    }

    fn tick(&mut self) -> bool {
        let mut expirations = [0_u8; 8];
        if rustix::io::read(&self.timer, &mut expirations).is_err() {
            return false;
        }
        let missed = u64::from_ne_bytes(expirations).saturating_sub(1);
        if missed > 0 {
            self.shared.status().overruns += missed;
        }
        true
    }

    fn execute_commands(&mut self) {
        for command in self.commands.take() {
            match command {
                Command::Period(period) => self.component.core().new_period = Some(period),
                Command::Parameters(proposal) => {
                    let said = proposal.put_to(self.component);
                    self.heed(said);
                }
                Command::Emergency(true) => self.enter_emergency("asked for by management"),
                Command::Emergency(false) => {
                    if self.component.core().state() == State::Emergency {
                        self.component.restore();
                        self.enter(State::Running);
                    }
                }
            }
        }
    }

    fn enter_emergency(&mut self, reason: &str) {
        if self.component.core().state() != State::Emergency {
            tracing::error!("emergency: {reason}");
            self.enter(State::Emergency);
        }
    }

    /// Serves what is ready, one message a port in turn, within the bound.
    fn handlers(&mut self, now: Instant) {
        let mut start = now;
        let count = self.ports.len();
        let mut left = HANDLERS_A_TURN;
        self.first_port = if self.first_port + 1 < count {
            self.first_port + 1
        } else {
            0
        };
        'turn: while left > 0 && self.ports.iter().any(|p| p.ready) {
            for at in (self.first_port..count).chain(0..self.first_port) {
                if self.shared.wake_event.is_stopping() {
                    break 'turn;
                }
                if left > 0 && self.ports[at].ready {
                    start = self.handle(at, start);
                    left -= 1;
                }
            }
        }
        self.count_handled();
    }

    /// Serves one message of a port, where one is there. `start` is now; says what is now afterwards.
    fn handle(&mut self, at: usize, start: Instant) -> Instant {
        let Self {
            component,
            ports,
            description,
            ..
        } = self;
        let port = &mut ports[at];
        let slot = port.slot;
        let mut result: Result<(), HandlerError> = Ok(());
        let mut lost = 0;
        let gaps = &mut port.gaps;
        let taken = match &mut port.receiver {
            Receiver::Server(server) => server.serve(&mut |header, body, reply| {
                result = answer(*component, slot, header, body, reply);
            }),
            Receiver::Subscriber {
                port, operation, ..
            } => port.receive(&mut |header, body| {
                lost = gaps.note(&header);
                let expected = description.slots[slot].operations[*operation].type_hash;
                result = if header.type_hash == 0 || header.type_hash == expected {
                    component.receive(slot, *operation, &mut Reader::of(body, header.encoding))
                } else {
                    Err(HandlerError("it is of another type".to_owned()))
                };
            }),
        };
        match taken {
            Ok(false) => port.rest(start),
            Ok(true) => {
                port.failures = 0;
                let now = Instant::now();
                port.heard = Some(now);
                let spin = self.description.slots[slot].qos.spin;
                if !spin.is_zero() {
                    self.ports[at].awake_until = Some(now + spin);
                }
                self.handled(at, now.saturating_duration_since(start), lost, result);
                return now;
            }
            Err(error) => {
                // What cannot be read does not hold up what comes behind it; a port that gives nothing else does not
                // keep the loop busy.
                port.failures += 1;
                if port.failures % HANDLERS_A_TURN == 0 {
                    port.receiver.acknowledge(false);
                    port.ready = false;
                    port.awake_until = None;
                }
                let now = Instant::now();
                let error = HandlerError(error.to_string());
                self.handled(at, now.saturating_duration_since(start), lost, Err(error));
                return now;
            }
        }
        start
    }

    fn handled(&mut self, at: usize, took: Duration, lost: u64, result: Result<(), HandlerError>) {
        self.handled.push(Handled {
            slot: self.ports[at].slot,
            took,
            lost,
            ok: result.is_ok(),
        });
        if took > self.period {
            let message = format!(
                "a handler took {took:?}, longer than the period of {:?}",
                self.period
            );
            self.complain(at, &message);
        }
        if let Err(error) = result {
            self.complain(at, &format!("a message was not handled: {error}"));
        }
    }

    /// Adds the messages of this turn to the status: one lock a turn, not one a message.
    fn count_handled(&mut self) {
        if self.handled.is_empty() {
            return;
        }
        let mut status = self.shared.status();
        for Handled {
            slot,
            took,
            lost,
            ok,
        } in self.handled.drain(..)
        {
            status.slots[slot].handled(took, lost, ok);
            if took > self.period {
                status.delta.overrun(Activity::Handler(slot), took);
            }
        }
    }

    /// Notes topics from which nothing has come for longer than they promise. What has come and waits is no silence.
    fn listen(&mut self) {
        let late = |port: &&Port| !port.ready && port.deadline.is_some() && port.heard.is_some();
        for port in self.ports.iter().filter(late) {
            if let (Receiver::Subscriber { operation, .. }, Some(heard), Some(deadline)) =
                (&port.receiver, port.heard, port.deadline)
            {
                let silence = heard.elapsed();
                if silence > deadline {
                    let mut status = self.shared.status();
                    status.delta.silent(port.slot, *operation, silence);
                }
            }
        }
    }

    /// Logs what went wrong at a port, at most once a second.
    fn complain(&mut self, at: usize, message: &str) {
        let port = &mut self.ports[at];
        self.shared.status().last_error = Some(message.to_owned());
        if port
            .complained
            .is_none_or(|last| last.elapsed() >= COMPLAINT_PAUSE)
        {
            port.complained = Some(Instant::now());
            tracing::warn!("slot {}: {message}", self.description.slots[port.slot].name);
        }
    }

    fn compute(&mut self) {
        if self.component.core().state() == State::Emergency {
            self.component.emergency();
            return;
        }
        let start = Instant::now();
        let result = self.component.compute();
        let took = start.elapsed();
        let complain = {
            let mut status = self.shared.status();
            status.compute.count(took, result.is_ok());
            if took > self.period {
                status.overruns += 1;
                status.delta.overrun(Activity::Compute, took);
            }
            if let Err(WorkerError::Failed(message)) = &result {
                status.last_error = Some(message.clone());
            }
            self.complained
                .is_none_or(|last: Instant| last.elapsed() >= COMPLAINT_PAUSE)
        };
        let slow = took > self.period && result.is_ok();
        if complain && (slow || matches!(result, Err(WorkerError::Failed(_)))) {
            self.complained = Some(Instant::now());
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
        self.heed(result);
    }

    /// What an answer of the worker means for the state.
    fn heed(&mut self, said: Result<(), WorkerError>) {
        match said {
            Err(WorkerError::Emergency(reason)) => self.enter_emergency(&reason),
            Err(WorkerError::Fatal(reason)) => self.fatal = Some(reason),
            Ok(()) | Err(WorkerError::Failed(_)) => {}
        }
    }

    fn new_period(&mut self) {
        let Some(period) = self.component.core().new_period.take() else {
            return;
        };
        self.period = period.max(Duration::from_micros(100));
        self.shared.status().period = self.period;
        if let Err(error) = self.arm(self.period) {
            self.fatal = Some(format!("the period cannot be set: {error}"));
        }
    }

    /// Looks up who is connected, now and then.
    fn peers(&mut self, now: Instant) {
        if self
            .peers_at
            .is_some_and(|last| now.saturating_duration_since(last) < PEERS_PAUSE)
        {
            return;
        }
        self.peers_at = Some(now);
        let mut counts = vec![0; self.description.slots.len()];
        for port in &mut self.ports {
            counts[port.slot] = match &port.receiver {
                Receiver::Server(server) => server.peers(),
                Receiver::Subscriber {
                    port: subscriber, ..
                } => {
                    let peers = subscriber.peers();
                    if peers > 0 {
                        port.heard.get_or_insert(now);
                    }
                    peers.max(counts[port.slot])
                }
            };
        }
        self.component.sending_peers(&mut counts);
        let mismatches = self.connections.mismatches();
        let mut status = self.shared.status();
        for (slot, peers) in status.slots.iter_mut().zip(counts) {
            slot.peers = peers;
        }
        status.delta.mismatches.extend(mismatches);
        drop(status);
        // Whoever keeps components alive starts a new one.
        if self.fatal.is_none() {
            self.fatal = self.connections.lost();
        }
    }
}

/// Opens the envelope, lets the worker answer, closes it. A request without envelope gets no answer.
fn answer(
    component: &mut dyn Component,
    slot: usize,
    header: Header,
    body: &[u8],
    reply: &mut dyn Reply,
) -> Result<(), HandlerError> {
    let mut request = Request::open(header, body, reply)?;
    let result = component.serve(slot, &mut request);
    request.close();
    result
}
