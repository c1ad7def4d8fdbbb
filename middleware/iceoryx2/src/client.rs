//! The client of a connection.

use crate::memory;
use crate::message::RequestHeader;
use crate::mutex::lock;
use crate::notifier::{Listener, Notifier};
use crate::ports::{CallService, ClientPort, PendingResponse};
use crate::process_monitor::ProcessMonitor;
use crate::prompt;
use crate::service::{EventPorts, calls, refusal};
use crate::session::{PendingCommand, Session};
use crate::wait_set::WaitSet;
use crate::{names, nodes};
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::port::client::RequestSendError;
use iceoryx2::port::{BackpressureAction, LoanError, SendError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, CallbackProgression};
use iceoryx2::service::port_factory::PortFactory as _;
use rc_middleware::started::{Awaiting, StartedCalls, StartedState};
use rc_middleware::{CallError, Client, Endpoint, Header, OpenError, RequestBody, Spin};
use std::cell::{Cell, RefCell};
use std::fmt::Debug;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Initial size of a request in bytes; the memory grows by doubling.
const INITIAL: usize = 256;
/// Longest sleep between two looks into the queue: a notification can be lost, see
/// [`Listener::acknowledge`].
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// If the server has replied this recently, a call does not ask the kernel first whether the server
/// is alive. If the server has died meanwhile, the call ends as for a server that dies later.
const RECENT_REPLY: Duration = Duration::from_millis(10);

/// Opens the client of a connection.
pub(crate) fn open(session: &Arc<Session>, endpoint: &Endpoint) -> Result<SharedClient, OpenError> {
    let address = &endpoint.address;
    let calls = calls(session, &names::calls(address), &endpoint.types)?;
    let open = || {
        calls
            .client_builder()
            .initial_max_slice_len(INITIAL)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            // Without a handler iceoryx2 drops a request that finds the queue full, and `send`
            // succeeds.
            .set_backpressure_handler(|_| BackpressureAction::DiscardDataAndFail)
            .create()
    };
    let port =
        prompt::open(open).map_err(|error| refusal(address.as_str())(format!("{error:?}")))?;
    let guid = port.id().value().to_be_bytes();
    let own = names::client(address, guid);
    let listener = Listener::open(session, &own, EventPorts::Client, None)?;
    let wake_event = session.environment.wake_event.as_fd();
    let wait_set = WaitSet::new(listener.descriptor(), wake_event)
        .map_err(|error| refusal(address.as_str())(error.to_string()))?;
    Ok(SharedClient {
        address: address.to_string(),
        guid,
        wait_set,
        listener,
        server_notifier: Notifier::open(
            session,
            &names::server(address),
            EventPorts::Server,
            None,
        )?,
        server_process: RefCell::new(None),
        last_reply: Cell::new(None),
        command: session.command(),
        spin: Cell::new(Spin::new(endpoint.qos.spin)),
        started: StartedCalls::default(),
        port,
        calls,
        session: Arc::clone(session),
    })
}

/// The client of a connection.
pub(crate) struct SharedClient {
    address: String,
    guid: [u8; 16],
    wait_set: WaitSet,
    listener: Listener,
    server_notifier: Notifier,
    /// The process of the last known server.
    server_process: RefCell<Option<ProcessMonitor>>,
    /// The server was alive at this time, or later; `None` if the last call has no reply.
    last_reply: Cell<Option<Instant>>,
    command: PendingCommand,
    spin: Cell<Spin>,
    started: StartedCalls<SentRequest>,
    port: ClientPort,
    calls: CallService,
    session: Arc<Session>,
}

/// A started call: its request, the server that got it, and when.
struct SentRequest {
    pending: PendingResponse,
    server: Option<u128>,
    sent: Instant,
}

impl SharedClient {
    /// Port id and node of the registered server.
    fn registered(&self) -> Option<(u128, UniqueNodeId)> {
        let mut found = None;
        self.calls.dynamic_config().list_servers(|server| {
            found = Some((server.server_id.value(), server.node_id));
            CallbackProgression::Stop
        });
        found
    }

    /// Whether a live server is registered, whose process is monitored from now on. A dead server
    /// stays registered until its clean-up, which this function requests but does not await.
    fn has_server(&self) -> bool {
        let live = self.finds_server();
        if !live {
            // The next call must look up the server again.
            self.last_reply.set(None);
        }
        live
    }

    /// Fails if no live server is registered. One that has just replied is not asked for.
    fn find_server(&self, now: Instant) -> Result<(), CallError> {
        let last_reply = self.last_reply.take();
        let has_replied =
            last_reply.is_some_and(|at| now.saturating_duration_since(at) < RECENT_REPLY);
        // The registered server is the one that replied, not a successor.
        let known = self.known_server();
        let is_there = has_replied && self.registered().map(|(server, _)| server) == known;
        if is_there || self.has_server() {
            Ok(())
        } else {
            Err(CallError::NoServer(self.address.clone()))
        }
    }

    fn finds_server(&self) -> bool {
        let Some((server, node)) = self.registered() else {
            *self.server_process.borrow_mut() = None;
            return false;
        };
        let mut monitor = self.server_process.borrow_mut();
        let monitor = match monitor.take() {
            Some(known) if known.server == server => monitor.insert(known),
            _ => {
                let pid = node.pid::<crate::ports::Service>();
                let mut new = ProcessMonitor::new(server, pid.ok().map(|pid| pid.value()));
                if new.is_gone() && !nodes::is_dead(&self.session.config, node) {
                    // It is alive in another pid namespace.
                    new.give_up();
                }
                if let Some(death) = new.descriptor() {
                    // If the kernel refuses, the death shows at the next poll.
                    let _ = self.wait_set.add_death(death);
                }
                monitor.insert(new)
            }
        };
        let live = !monitor.is_dead();
        if !live {
            self.session.request_cleanup();
        }
        live
    }

    /// Puts a request into the queue of the server and notifies it.
    fn submit(
        &self,
        header: RequestHeader,
        request: &dyn RequestBody,
    ) -> Result<PendingResponse, CallError> {
        let full = || CallError::QueueFull(self.address.clone());
        let mut loan = match self.port.loan_slice_uninit(request.length()) {
            Ok(loan) => memory::request(loan),
            Err(LoanError::ExceedsMaxLoans | LoanError::OutOfMemory) => return Err(full()),
            Err(error) => return Err(self.failed(&error)),
        };
        request.write_into(loan.payload_mut())?;
        *loan.user_header_mut() = header;
        match loan.send() {
            Ok(pending) if pending.number_of_server_connections() == 0 => {
                // The server has not connected to this client yet.
                Err(match self.registered() {
                    Some(_) => full(),
                    None => CallError::NoServer(self.address.clone()),
                })
            }
            Ok(pending) => {
                self.server_notifier.notify();
                Ok(pending)
            }
            Err(
                RequestSendError::SendError(SendError::UnableToDeliver)
                | RequestSendError::ExceedsMaxActiveRequests,
            ) => Err(full()),
            Err(error) => Err(self.failed(&error)),
        }
    }

    /// Hands the reply to `take` if it has arrived.
    fn take(
        &self,
        pending: &PendingResponse,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<bool, CallError> {
        match pending.receive() {
            Ok(Some(response)) => {
                let sender = response.origin().value();
                let header = response.user_header().read(sender);
                let header = header.map_err(|reason| self.failed_for(reason))?;
                take(header, response.payload());
                Ok(true)
            }
            Ok(None) => Ok(false),
            Err(error) => Err(self.failed(&error)),
        }
    }

    /// Polls for the reply without sleeping, for the time that the slot configures.
    fn spin(
        &self,
        pending: &PendingResponse,
        take: &mut dyn FnMut(Header, &[u8]),
        limit: Duration,
    ) -> Result<bool, CallError> {
        let is_stopping = || self.session.environment.wake_event.is_stopping();
        let polled = Spin::poll(&self.spin, limit, |found| {
            let came = self.take(pending, &mut |header, body| {
                *found = Some(Instant::now());
                take(header, body);
            });
            (is_stopping() || !matches!(came, Ok(false))).then_some(came)
        });
        polled.unwrap_or(Ok(false))
    }

    /// Whether the server that got the request, `asked`, is dead or no longer registered.
    fn is_gone(&self, asked: Option<u128>) -> bool {
        let dead = self
            .server_process
            .borrow()
            .as_ref()
            .is_some_and(ProcessMonitor::is_dead);
        if dead {
            self.session.request_cleanup();
        }
        dead || self.registered().map(|(server, _)| server) != asked
    }

    /// The server that is monitored.
    fn known_server(&self) -> Option<u128> {
        let monitor = self.server_process.borrow();
        monitor.as_ref().map(|monitor| monitor.server)
    }

    /// The error of a request that the server dropped.
    fn unanswered(&self) -> CallError {
        self.failed_for("the server took the request and sent no reply".to_owned())
    }

    /// The state of a started call. If its reply has arrived, `take` gets it.
    fn look(&self, asked: &SentRequest, take: &mut dyn FnMut(Header, &[u8])) -> StartedState {
        match self.take(&asked.pending, take) {
            Ok(true) => {
                // The reply may have waited: its server may be dead by now.
                self.last_reply.set(Some(asked.sent));
                return StartedState::Ended(Ok(()));
            }
            Err(error) => return StartedState::Ended(Err(error)),
            Ok(false) => {}
        }
        // The server's state is read before the queue, so that no reply is missed.
        let gone = self.is_gone(asked.server);
        let dropped = !asked.pending.is_connected();
        match self.take(&asked.pending, take) {
            Ok(true) => StartedState::Ended(Ok(())),
            Err(error) => StartedState::Ended(Err(error)),
            Ok(false) if gone => {
                StartedState::Ended(Err(CallError::ServerDied(self.address.clone())))
            }
            // The death or departure of the server shows soon.
            Ok(false) if dropped => StartedState::Lost(self.unanswered(), POLL_INTERVAL),
            Ok(false) => StartedState::Pending,
        }
    }

    fn failed(&self, error: &dyn Debug) -> CallError {
        self.failed_for(format!("{error:?}"))
    }

    fn failed_for(&self, reason: String) -> CallError {
        CallError::Backend {
            address: self.address.clone(),
            reason,
        }
    }
}

impl Client for SharedClient {
    fn guid(&self) -> [u8; 16] {
        self.guid
    }

    fn can_loan(&self) -> bool {
        true
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let header = RequestHeader::new(header, self.guid, true);
        if !self.has_server() {
            return Err(CallError::NoServer(self.address.clone()));
        }
        let pending = self.submit(header, request)?;
        // The queue keeps the order of commands, so that the last one represents all.
        *lock(&self.command) = Some(pending);
        Ok(())
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let start = Instant::now();
        let stopping = || self.session.environment.wake_event.is_stopping();
        if stopping() {
            return Err(CallError::Stopping);
        }
        self.find_server(start)?;
        let pending = self.submit(RequestHeader::new(header, self.guid, false), request)?;
        let asked = self.known_server();
        if self.spin(&pending, take, limit)? {
            self.last_reply.set(Some(start));
            return Ok(());
        }
        let mut unanswered: Option<Instant> = None;
        let mut left = limit.saturating_sub(start.elapsed());
        loop {
            // The server has had no time to reply before the first sleep. It sends one notification
            // for each request; a late one for an earlier request wakes this client once too often,
            // which is harmless.
            let notified = if stopping() {
                false
            } else {
                self.wait_set.sleep(left.min(POLL_INTERVAL))
            };
            self.listener.acknowledge(notified);
            if self.take(&pending, take)? {
                self.last_reply.set(Some(start));
                return Ok(());
            }
            // The server's state is read before the queue, so that no reply is missed.
            let gone = self.is_gone(asked);
            let given_up = unanswered.is_some_and(|since| since.elapsed() >= POLL_INTERVAL);
            if !pending.is_connected() {
                // The server has dropped the request; its death or departure shows soon.
                unanswered.get_or_insert_with(Instant::now);
            }
            if self.take(&pending, take)? {
                return Ok(());
            }
            if gone {
                return Err(CallError::ServerDied(self.address.clone()));
            }
            if given_up {
                return Err(self.unanswered());
            }
            if stopping() {
                return Err(CallError::Stopping);
            }
            left = limit.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Err(CallError::Deadline {
                    address: self.address.clone(),
                    limit,
                });
            }
        }
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let start = Instant::now();
        if self.session.environment.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        self.started.check_room()?;
        self.find_server(start)?;
        let pending = self.submit(RequestHeader::new(header, self.guid, false), request)?;
        let server = self.known_server();
        let asked = SentRequest {
            pending,
            server,
            sent: start,
        };
        self.started.add(header.sequence, asked, (start, limit));
        Ok(())
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        if self.started.is_empty() {
            return None;
        }
        let notified = self.wait_set.sleep(Duration::ZERO);
        if notified {
            self.listener.acknowledge(true);
        }
        let mut started = std::mem::take(&mut self.started);
        let is_stopping = self.session.environment.wake_event.is_stopping();
        let look = |sequence, asked: &mut SentRequest| {
            self.look(asked, &mut |header, body| take(sequence, header, body))
        };
        let ended = started.next(&self.address, is_stopping, look);
        self.started = started;
        if ended.is_some() && !notified {
            // The notification of this reply may be swallowed, with all that follow.
            self.listener.acknowledge(false);
        }
        ended.map(|(sequence, _, result)| (sequence, result))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.started.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        self.started.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        let look_again = Instant::now() + POLL_INTERVAL;
        let due = self.started.due();
        (!self.started.is_empty()).then(|| Awaiting {
            descriptor: self.wait_set.descriptor(),
            until: due.map_or(look_again, |due| due.min(look_again)),
        })
    }

    fn replies_have_ages(&self) -> bool {
        true
    }

    fn peers(&self) -> usize {
        usize::from(self.has_server())
    }

    fn server(&self) -> u128 {
        let registered = self.has_server().then(|| self.registered()).flatten();
        registered.map_or(0, |(server, _)| server.max(1))
    }
}
