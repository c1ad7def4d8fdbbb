//! The server of a connection.

use crate::memory;
use crate::message::MessageHeader;
use crate::mutex::lock;
use crate::names;
use crate::notifier::{Listener, Notifier};
use crate::ports::{ActiveRequest, CallService, Response, ServerPort, Service};
use crate::process_monitor::ProcessMonitor;
use crate::prompt;
use crate::service::{EventPorts, calls, refusal};
use crate::session::Session;
use iceoryx2::port::port_name::PortName;
use iceoryx2::port::{LoanError, ReceiveError as PortError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, CallbackProgression};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::server::ServerCreateError;
use rc_middleware::qos::MAX_READERS;
use rc_middleware::{
    Address, DeferredReply, Encoding, Endpoint, Header, OpenError, ReceiveError, Reply, Server,
};
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::fmt::Debug;
use std::os::fd::BorrowedFd;
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Largest reply in bytes. Each reply reserves address space of this size, and uses memory as far
/// as it is written. Memory that grows would need 1.6 MB of bookkeeping for every client.
const LARGEST_REPLY: usize = 64 << 20;
/// The most replies that wait until their clients receive them. Each call of each client could have one:
/// these would reserve 64 GiB of addresses for each server, and some kernels have 512 GiB for a process.
const MAX_REPLIES: usize = 3 * MAX_READERS;

/// Attempts to replace a dead server, and the pause between two.
const TAKEOVER_ATTEMPTS: u32 = 100;
const PAUSE: Duration = Duration::from_millis(10);

/// Opens the server of a connection.
pub(crate) fn open(session: &Arc<Session>, endpoint: &Endpoint) -> Result<SharedServer, OpenError> {
    let address = &endpoint.address;
    // The listener comes first: a client that sees the server can notify it.
    let listener = Listener::open(session, &names::server(address), EventPorts::Server, None)?;
    let calls = calls(session, &names::calls(address), &endpoint.types)?;
    let mut port = make_port(session, &calls);
    for _ in 0..TAKEOVER_ATTEMPTS {
        // A clean-up frees the place of a dead server; one in another process may still be running.
        if port.as_ref().err() != Some(&ServerCreateError::ExceedsMaxSupportedServers) {
            break;
        }
        session.clean();
        port = make_port(session, &calls);
        if current_server(&calls).is_some_and(|holder| !holder.is_dead()) {
            break;
        }
        std::thread::sleep(PAUSE);
    }
    let port = port.map_err(|error| match error {
        ServerCreateError::ExceedsMaxSupportedServers => OpenError::AddressTaken {
            address: address.to_string(),
            holder: current_server(&calls).map_or_else(
                || "a server that has just left".to_owned(),
                |holder| holder.to_string(),
            ),
        },
        error => refusal(address.as_str())(format!("{error:?}")),
    })?;
    Ok(SharedServer {
        inbox: VecDeque::new(),
        reply: Vec::new(),
        replies: Arc::new(Replies {
            client_notifiers: Mutex::default(),
            calls,
            address: address.clone(),
            session: Arc::clone(session),
        }),
        port,
        listener,
    })
}

fn make_port(session: &Session, calls: &CallService) -> Result<ServerPort, ServerCreateError> {
    let name = PortName::new(&session.environment.instance);
    let name = name.unwrap_or_else(|_| PortName::new_empty());
    prompt::open(|| {
        calls
            .server_builder()
            .name(&name)
            .initial_max_slice_len(LARGEST_REPLY)
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_responses_per_request(1)
            .override_response_preallocation(|most| most.min(MAX_REPLIES))
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
    })
}

/// The registered server.
struct CurrentServer {
    pid: Option<i32>,
    name: String,
}

impl CurrentServer {
    fn is_dead(&self) -> bool {
        ProcessMonitor::new(0, self.pid).is_dead()
    }
}

impl std::fmt::Display for CurrentServer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.pid {
            Some(pid) => write!(f, "pid {pid} ({})", self.name),
            None => f.write_str(&self.name),
        }
    }
}

fn current_server(calls: &CallService) -> Option<CurrentServer> {
    let mut holder = None;
    calls.dynamic_config().list_servers(|server| {
        holder = Some(CurrentServer {
            pid: server.node_id.pid::<Service>().ok().map(|pid| pid.value()),
            name: server.server_name.to_string(),
        });
        CallbackProgression::Stop
    });
    holder
}

/// The server of a connection.
pub(crate) struct SharedServer {
    /// Requests taken from the queues of the clients.
    inbox: VecDeque<ActiveRequest>,
    reply: Vec<u8>,
    port: ServerPort,
    listener: Listener,
    /// Dropped after everything above: the last process that leaves must have no port open.
    replies: Arc<Replies>,
}

/// The state for sending replies. Deferred replies share it with their server.
struct Replies {
    /// Notifiers of clients, by client GUID.
    client_notifiers: Mutex<BTreeMap<[u8; 16], Notifier>>,
    calls: CallService,
    address: Address,
    session: Arc<Session>,
}

impl SharedServer {
    /// Fills the inbox round-robin: the first request of each client, then the second of each.
    /// iceoryx2 itself empties the queue of one client before it looks into the next.
    fn refill(&mut self) -> Result<(), ReceiveError> {
        let mut most = 1;
        while self.inbox.len() < most {
            match self.port.receive() {
                Ok(Some(request)) => {
                    self.inbox.push_back(request);
                    // Looking into an empty queue is expensive, and the requests of a single client
                    // are in order already.
                    if most == 1 && self.peers() > 1 {
                        most = usize::MAX;
                    }
                }
                // `ExceedsMaxBorrows`: the server holds as many requests as it may.
                Ok(None) | Err(PortError::ExceedsMaxBorrows) => break,
                Err(_) if !self.inbox.is_empty() => break,
                Err(error) => return Err(self.replies.failed(format!("{error:?}"))),
            }
        }
        if self.inbox.len() > 1 {
            let mut counts = HashMap::new();
            let mut ranked: Vec<(usize, ActiveRequest)> = Vec::with_capacity(self.inbox.len());
            for request in self.inbox.drain(..) {
                let count = counts
                    .entry(request.header().client_id().value())
                    .or_insert(0_usize);
                *count += 1;
                ranked.push((*count, request));
            }
            ranked.sort_by_key(|(rank, _)| *rank);
            self.inbox
                .extend(ranked.into_iter().map(|(_, request)| request));
        }
        Ok(())
    }
}

impl Replies {
    /// Sends the reply to a query, unless it is empty, and wakes its client. If the call has ended,
    /// nobody would take the reply out of its channel.
    fn finish(&self, header: Header, reply: SharedReply<'_>) -> Result<(), ReceiveError> {
        if !reply.request.is_connected() {
            return Ok(());
        }
        let client = reply.request.user_header().client();
        let sent = self.send(header, reply);
        self.notify_client(client);
        sent
    }

    fn send(&self, header: Header, reply: SharedReply<'_>) -> Result<(), ReceiveError> {
        let length = reply.body.len();
        let unsent = |reason: String| {
            self.failed(format!("a reply of {length} bytes was not sent: {reason}"))
        };
        let failed = |error: &dyn Debug| {
            unsent(format!(
                "iceoryx2 says {error:?} (the limit is {LARGEST_REPLY} bytes)"
            ))
        };
        let encoding = if reply.loan_is_reply {
            reply.loan_encoding
        } else {
            Encoding::Cdr
        };
        let header = MessageHeader::new(Header {
            encoding,
            sent: header.sent_less(reply.age),
            ..header
        });
        match reply.loan.filter(|_| reply.loan_is_reply) {
            Some(mut loan) => {
                *loan.user_header_mut() = header;
                loan.send().map_err(|error| failed(&error))
            }
            None if length == 0 => Ok(()),
            None => {
                let loan = reply.request.loan_slice_uninit(length);
                let mut loan = loan.map_err(|error| match error {
                    LoanError::OutOfMemory => unsent(format!(
                        "{MAX_REPLIES} replies wait until their clients receive them; look for clients that have stopped"
                    )),
                    error => failed(&error),
                })?;
                *loan.user_header_mut() = header;
                let loan = loan.write_from_slice(reply.body);
                loan.send().map_err(|error| failed(&error))
            }
        }
    }

    /// Notifies one client.
    fn notify_client(&self, client: [u8; 16]) {
        if client == [0; 16] {
            return;
        }
        let mut notifiers = lock(&self.client_notifiers);
        if let Some(notifier) = notifiers.get(&client) {
            notifier.notify();
            return;
        }
        if notifiers.len() >= self.calls.dynamic_config().number_of_clients() {
            notifiers.retain(|_, notifier| notifier.has_listeners());
        }
        // Without an event service, the client has left or does not wait for a notification.
        if let Some(notifier) =
            Notifier::existing(&self.session, &names::client(&self.address, client))
        {
            notifier.notify();
            notifiers.insert(client, notifier);
        }
    }

    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.to_string(),
            reason,
        }
    }
}

/// The reply to one request.
struct SharedReply<'a> {
    request: &'a Rc<ActiveRequest>,
    body: &'a mut Vec<u8>,
    loan: Option<Response>,
    loan_encoding: Encoding,
    /// Whether the loan is the reply.
    loan_is_reply: bool,
    /// The state for sending the reply to a query later.
    later: Option<(Header, &'a Arc<Replies>)>,
    is_deferred: bool,
    /// The age of its value.
    age: Duration,
}

impl<'a> SharedReply<'a> {
    fn new(request: &'a Rc<ActiveRequest>, body: &'a mut Vec<u8>) -> Self {
        Self {
            request,
            body,
            loan: None,
            loan_encoding: Encoding::Cdr,
            loan_is_reply: false,
            later: None,
            is_deferred: false,
            age: Duration::ZERO,
        }
    }
}

/// A deferred reply.
struct SharedDeferred {
    request: Rc<ActiveRequest>,
    header: Header,
    /// Dropped last, as in a server.
    replies: Arc<Replies>,
}

impl DeferredReply for SharedDeferred {
    fn send(self: Box<Self>, write: &mut dyn FnMut(&mut dyn Reply)) -> Result<(), ReceiveError> {
        let mut body = Vec::new();
        let mut reply = SharedReply::new(&self.request, &mut body);
        write(&mut reply);
        self.replies.finish(self.header, reply)
    }
}

impl Reply for SharedReply<'_> {
    fn body(&mut self) -> &mut Vec<u8> {
        self.body
    }

    fn set_age(&mut self, age: Duration) {
        self.age = age;
    }

    fn can_loan(&self, _: Encoding) -> bool {
        true
    }

    fn loan(&mut self, length: usize, encoding: Encoding) -> Option<&mut [u8]> {
        self.loan_encoding = encoding;
        // The port allows one loan for each request.
        self.loan = None;
        let loan = self.request.loan_slice_uninit(length).ok()?;
        let loan = self.loan.insert(memory::response(loan));
        Some(loan.payload_mut())
    }

    fn send_loan(&mut self) {
        self.loan_is_reply = true;
    }

    fn defer(&mut self) -> Option<Box<dyn DeferredReply>> {
        let (header, replies) = self.later.take()?;
        self.is_deferred = true;
        Some(Box::new(SharedDeferred {
            request: Rc::clone(self.request),
            header,
            replies: Arc::clone(replies),
        }))
    }
}

impl Server for SharedServer {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.listener.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.listener.acknowledge(woken);
    }

    fn serve(
        &mut self,
        handler: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        if self.inbox.is_empty() {
            self.refill()?;
        }
        let Some(request) = self.inbox.pop_front() else {
            return Ok(false);
        };
        let request = Rc::new(request);
        let user_header = *request.user_header();
        let sender = request.origin().value();
        let header = user_header
            .read(sender)
            .map_err(|reason| self.replies.failed(reason))?;
        let mut body = std::mem::take(&mut self.reply);
        body.clear();
        let mut reply = SharedReply::new(&request, &mut body);
        if !user_header.is_one_way() {
            reply.later = Some((header, &self.replies));
        }
        handler(header, request.payload(), &mut reply);
        let sent = if user_header.is_one_way() || reply.is_deferred {
            Ok(())
        } else {
            self.replies.finish(header, reply)
        };
        self.reply = body;
        sent.map(|()| true)
    }

    fn peers(&self) -> usize {
        self.replies.calls.dynamic_config().number_of_clients()
    }
}
