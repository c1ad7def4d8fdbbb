//! The calling end of a connection.

use crate::message::RequestHeader;
use crate::notifier::{Listener, Notifier};
use crate::process_monitor::ProcessMonitor;
use crate::service::{CallService, ClientPort, EventPorts, PendingResponse, calls, refusal};
use crate::session::{PendingCommand, Session, lock};
use crate::wait_set::WaitSet;
use crate::{names, nodes};
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::port::client::RequestSendError;
use iceoryx2::port::{BackpressureAction, LoanError, SendError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, CallbackProgression};
use iceoryx2::service::port_factory::PortFactory as _;
use rc_middleware::{CallError, Client, Endpoint, Header, OpenError};
use std::cell::{Cell, RefCell};
use std::fmt::Debug;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Bytes that a client is ready for; its memory grows by doubling.
const INITIAL: usize = 256;
/// Longest wait before the queue is looked into all the same: a ring can be lost, see [`Listener::acknowledge`].
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// A server that has replied so recently is asked again without a look whether it is still there: that costs a call of
/// the system. One that died meanwhile ends the call as one that dies later does.
const RECENT_REPLY: Duration = Duration::from_millis(10);

/// Opens the calling end of a connection.
pub(crate) fn open(session: &Arc<Session>, endpoint: &Endpoint) -> Result<SharedClient, OpenError> {
    let address = &endpoint.address;
    let calls = calls(session, &names::calls(address), &endpoint.types)?;
    let port = calls
        .client_builder()
        .initial_max_slice_len(INITIAL)
        .allocation_strategy(AllocationStrategy::PowerOfTwo)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        // Without a handler a request that finds the queue full is dropped, and `send` says that all is well.
        .set_backpressure_handler(|_| BackpressureAction::DiscardDataAndFail)
        .create()
        .map_err(|error| refusal(address.as_str())(format!("{error:?}")))?;
    let guid = port.id().value().to_be_bytes();
    let own = names::client(address, guid);
    let listener = Listener::open(session, &own, EventPorts::Client, None)?;
    let interrupt = session.environment.interrupt.as_fd();
    let wait_set = WaitSet::new(listener.descriptor(), interrupt)
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
        spin: endpoint.qos.spin,
        port,
        calls,
        session: Arc::clone(session),
    })
}

/// The calling end of a connection.
pub(crate) struct SharedClient {
    address: String,
    guid: [u8; 16],
    wait_set: WaitSet,
    listener: Listener,
    server_notifier: Notifier,
    /// The server that was seen last.
    server_process: RefCell<Option<ProcessMonitor>>,
    /// When the call began that it has answered, if that was the last call.
    last_reply: Cell<Option<Instant>>,
    command: PendingCommand,
    spin: Duration,
    port: ClientPort,
    calls: CallService,
    session: Arc<Session>,
}

impl SharedClient {
    /// The server that is registered now: its identity, and its node.
    fn registered(&self) -> Option<(u128, UniqueNodeId)> {
        let mut found = None;
        self.calls.dynamic_config().list_servers(|server| {
            found = Some((server.server_id.value(), server.node_id));
            CallbackProgression::Stop
        });
        found
    }

    /// Whether there is a live server; it is watched afterwards. A dead one is none, although it is registered until
    /// what it left is removed; that is not waited for.
    fn has_server(&self) -> bool {
        let live = self.finds_server();
        if !live {
            // The next call has to look: by then there may be another server.
            self.last_reply.set(None);
        }
        live
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
                let pid = node.pid::<crate::service::Service>();
                let mut new = ProcessMonitor::new(server, pid.ok().map(|pid| pid.value()));
                if new.is_gone() && !nodes::is_dead(&self.session.config, node) {
                    // It is alive in another namespace of processes, where its id is not what it seems here.
                    new.give_up();
                }
                if let Some(death) = new.descriptor() {
                    // What the kernel refuses here shows at the end of a cycle.
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

    /// Puts a request into the queue of the server.
    fn submit(&self, header: RequestHeader, request: &[u8]) -> Result<PendingResponse, CallError> {
        let full = || CallError::QueueFull(self.address.clone());
        let mut loan = match self.port.loan_slice_uninit(request.len()) {
            Ok(loan) => loan,
            Err(LoanError::ExceedsMaxLoans | LoanError::OutOfMemory) => return Err(full()),
            Err(error) => return Err(self.failed(&error)),
        };
        *loan.user_header_mut() = header;
        match loan.write_from_slice(request).send() {
            Ok(pending) if pending.number_of_server_connections() == 0 => {
                // A server that has not looked since this client was made refuses in this way.
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

    /// Takes the answer, where it is there.
    fn take(
        &self,
        pending: &PendingResponse,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<bool, CallError> {
        match pending.receive() {
            Ok(Some(answer)) => {
                let sender = answer.origin().value();
                let header = answer.user_header().read(sender);
                let header = header.map_err(|reason| self.failed_for(reason))?;
                take(header, answer.payload());
                Ok(true)
            }
            Ok(None) => Ok(false),
            Err(error) => Err(self.failed(&error)),
        }
    }

    /// Looks for the answer without sleeping, as long as its slot says.
    fn spin(
        &self,
        pending: &PendingResponse,
        take: &mut dyn FnMut(Header, &[u8]),
        limit: Duration,
    ) -> Result<bool, CallError> {
        let start = Instant::now();
        let limit = limit.min(self.spin);
        while start.elapsed() < limit && !self.session.environment.interrupt.is_stopping() {
            if self.take(pending, take)? {
                return Ok(true);
            }
            std::hint::spin_loop();
        }
        Ok(false)
    }

    /// Whether the server that was `asked` is there no more.
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

    fn send(&mut self, header: Header, request: &[u8]) -> Result<(), CallError> {
        let header = RequestHeader::new(header, self.guid, true);
        if !self.has_server() {
            return Err(CallError::NoServer(self.address.clone()));
        }
        let pending = self.submit(header, request)?;
        // The command before this one need not be remembered: the queue keeps their order.
        *lock(&self.command) = Some(pending);
        Ok(())
    }

    fn call(
        &mut self,
        header: Header,
        request: &[u8],
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let start = Instant::now();
        let stopping = || self.session.environment.interrupt.is_stopping();
        if stopping() {
            return Err(CallError::Stopping);
        }
        let last_reply = self.last_reply.take();
        let recently_replied =
            last_reply.is_some_and(|at| start.saturating_duration_since(at) < RECENT_REPLY);
        // It is the one that answered, and no successor.
        let known = self
            .server_process
            .borrow()
            .as_ref()
            .map(|monitor| monitor.server);
        let recently_replied =
            recently_replied && self.registered().map(|(server, _)| server) == known;
        if !recently_replied && !self.has_server() {
            return Err(CallError::NoServer(self.address.clone()));
        }
        let pending = self.submit(RequestHeader::new(header, self.guid, false), request)?;
        let asked = self
            .server_process
            .borrow()
            .as_ref()
            .map(|monitor| monitor.server);
        if !self.spin.is_zero() && self.spin(&pending, take, limit)? {
            self.last_reply.set(Some(start));
            return Ok(());
        }
        let mut unanswered: Option<Instant> = None;
        let mut left = if self.spin.is_zero() {
            limit
        } else {
            limit.saturating_sub(start.elapsed())
        };
        loop {
            // Before the first look nobody has had the time to answer; and one server rings, one ring after the
            // other. A ring for an earlier request that comes now only wakes once too often.
            let rung = if stopping() {
                false
            } else {
                self.wait_set.sleep(left.min(POLL_INTERVAL))
            };
            self.listener.acknowledge(rung);
            if self.take(&pending, take)? {
                self.last_reply.set(Some(start));
                return Ok(());
            }
            // What is found out about the server comes before the look into the queue, so that no answer is missed.
            let gone = self.is_gone(asked);
            let given_up = unanswered.is_some_and(|since| since.elapsed() >= POLL_INTERVAL);
            if !pending.is_connected() {
                // The server has dropped the request. If it is about to leave, that is seen soon.
                unanswered.get_or_insert_with(Instant::now);
            }
            if self.take(&pending, take)? {
                return Ok(());
            }
            if gone {
                return Err(CallError::ServerDied(self.address.clone()));
            }
            if given_up {
                let reason = "the server took the request and gave no answer";
                return Err(self.failed_for(reason.to_owned()));
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

    fn peers(&self) -> usize {
        usize::from(self.has_server())
    }
}
