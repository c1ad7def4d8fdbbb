//! Commands and queries.

use crate::body::Pool;
use crate::hub::{self, QUEUE_LIMIT, Table, lock};
use crate::reply::{Answer, LocalReply, ReplyState, Ticket};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::started::{Awaiting, StartedCalls, StartedState};
use rc_middleware::{
    CallError, Client, Endpoint, Environment, Header, Message, OpenError, QueueGauge, ReceiveError,
    Reply, Server, SharedValue, Spin, WakeEvent, wait,
};
use std::cell::Cell;
use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::{Arc, LazyLock, Mutex};
use std::time::{Duration, Instant};

/// Longest wait before a client looks for a stop: another thread may have cleared the wake event.
const CYCLE: Duration = Duration::from_millis(50);

/// How long a client polls at least: a thread of this process replies in less than a wake-up takes.
const POLL: Duration = Duration::from_micros(30);

static CALLS: LazyLock<Mutex<Table<State>>> = LazyLock::new(Mutex::default);

/// The clients and the server of an address.
#[derive(Default)]
pub(crate) struct State {
    server: Option<Registration>,
    /// In the order in which the server serves them.
    queues: VecDeque<Queue>,
}

/// The server that is open.
struct Registration {
    port: u64,
    /// The bytes of all requests that wait.
    gauge: QueueGauge,
    holder: String,
    signal: WakeEvent,
}

/// The requests of one client that the server has not taken yet.
struct Queue {
    client: u64,
    requests: VecDeque<Request>,
    /// Whether the client is still open. The server also serves the requests of a closed client.
    open: bool,
}

struct Request {
    header: Header,
    body: Content,
    ticket: Option<Ticket>,
}

/// The body of a request.
enum Content {
    Copied(Vec<u8>),
    Value(SharedValue),
}

impl Content {
    fn of(request: &dyn RequestBody) -> Result<Self, CallError> {
        match request.value() {
            Some(value) => Ok(Self::Value(value)),
            None => Ok(Self::Copied(buffer(request)?)),
        }
    }

    /// The memory that it takes, in bytes. It stays as it is while the request waits.
    fn memory(&self) -> usize {
        match self {
            Self::Copied(body) => body.capacity(),
            Self::Value(value) => value.memory(),
        }
    }
}

/// Opens a client.
pub(crate) fn client(
    environment: &Environment,
    endpoint: &Endpoint,
) -> Result<LocalClient, OpenError> {
    let state = hub::meet(&CALLS, environment, endpoint)?;
    let port = hub::number();
    let signal = hub::signal(endpoint)?;
    lock(&state).queues.push_back(Queue {
        client: port,
        requests: VecDeque::new(),
        open: true,
    });
    Ok(LocalClient {
        address: endpoint.address.to_string(),
        wake_event: environment.wake_event.clone(),
        state,
        port,
        signal,
        spin: Cell::new(Spin::new(endpoint.qos.spin.max(POLL))),
        started: StartedCalls::default(),
    })
}

/// Opens a server.
pub(crate) fn server(
    environment: &Environment,
    endpoint: &Endpoint,
) -> Result<LocalServer, OpenError> {
    let state = hub::meet(&CALLS, environment, endpoint)?;
    let port = hub::number();
    let signal = hub::signal(endpoint)?;
    let mut guard = lock(&state);
    if let Some(server) = &guard.server {
        return Err(OpenError::AddressTaken {
            address: endpoint.address.to_string(),
            holder: server.holder.clone(),
        });
    }
    let gauge = QueueGauge::new(QUEUE_LIMIT);
    guard.server = Some(Registration {
        port,
        gauge: gauge.clone(),
        holder: format!("pid {} ({})", std::process::id(), environment.instance),
        signal: signal.clone(),
    });
    drop(guard);
    Ok(LocalServer {
        state,
        signal,
        gauge,
        pool: Pool::default(),
    })
}

/// A client.
pub(crate) struct LocalClient {
    address: String,
    wake_event: WakeEvent,
    state: Arc<Mutex<State>>,
    port: u64,
    signal: WakeEvent,
    spin: Cell<Spin>,
    started: StartedCalls<SentRequest>,
}

/// A call whose request was sent.
struct SentRequest {
    header: Header,
    slot: Arc<Mutex<ReplyState>>,
    server: u64,
}

impl LocalClient {
    /// Sends the request of a call.
    fn ask(&self, header: Header, request: &dyn RequestBody) -> Result<SentRequest, CallError> {
        let slot = Arc::new(Mutex::new(ReplyState::default()));
        let server = self.submit(Request {
            header: self.signed(header),
            body: Content::of(request)?,
            ticket: Some(Ticket {
                slot: Arc::clone(&slot),
                signal: self.signal.clone(),
            }),
        })?;
        Ok(SentRequest {
            header,
            slot,
            server,
        })
    }

    /// The result of a call, if it has ended. If its reply has come, `take` gets it.
    fn result(
        &self,
        asked: &SentRequest,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Option<Result<(), CallError>> {
        // The lock is not held while `take` runs.
        let state = std::mem::take(&mut *lock(&asked.slot));
        let (answer, age) = match state {
            ReplyState::Ready(answer, age) => (answer, age),
            ReplyState::Dropped => return Some(Err(self.silence(asked.server))),
            ReplyState::Pending => return None,
        };
        let mut header = asked.header;
        header.sent = header.sent_less(age);
        match answer {
            Answer::Copied(reply) => take(header, Message::Bytes(&reply)),
            Answer::Lent(body, encoding) => {
                header.encoding = encoding;
                take(header, Message::Bytes(body.bytes()));
            }
            Answer::Value(value) => take(header, Message::Value(value.into())),
        }
        Some(Ok(()))
    }

    /// Puts a request into the queue. Returns the server that will reply.
    fn submit(&self, request: Request) -> Result<u64, CallError> {
        let mut state = lock(&self.state);
        let State { server, queues } = &mut *state;
        let (Some(server), Some(queue)) = (
            server,
            queues.iter_mut().find(|queue| queue.client == self.port),
        ) else {
            return Err(CallError::NoServer(self.address.clone()));
        };
        let is_full = queue.requests.len() >= REQUEST_QUEUE;
        if is_full || !server.gauge.add(request.body.memory()) {
            return Err(CallError::QueueFull(self.address.clone()));
        }
        queue.requests.push_back(request);
        server.signal.wake();
        Ok(server.port)
    }

    fn signed(&self, header: Header) -> Header {
        Header {
            sender: self.port.into(),
            ..header
        }
    }

    /// Why a server did not reply.
    fn silence(&self, asked: u64) -> CallError {
        let state = lock(&self.state);
        if state.server.as_ref().map(|server| server.port) == Some(asked) {
            CallError::Backend {
                address: self.address.clone(),
                reason: "the server took the request and sent no reply".to_owned(),
            }
        } else {
            CallError::ServerDied(self.address.clone())
        }
    }
}

impl Client for LocalClient {
    fn guid(&self) -> [u8; 16] {
        let mut guid = [0; 16];
        guid[..4].copy_from_slice(&std::process::id().to_be_bytes());
        guid[8..].copy_from_slice(&self.port.to_be_bytes());
        guid
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let request = Request {
            header: self.signed(header),
            body: Content::of(request)?,
            ticket: None,
        };
        self.submit(request).map(|_| ())
    }

    fn takes_values(&self) -> bool {
        true
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        self.call_message(header, request, limit, &mut |header, message| {
            take(header, message.bytes());
        })
    }

    fn call_message(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<(), CallError> {
        let start = Instant::now();
        if self.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let asked = self.ask(header, request)?;
        let polled = Spin::poll(&self.spin, limit, |found| {
            let result = self.result(&asked, &mut |header, message| {
                *found = Some(Instant::now());
                take(header, message);
            });
            let is_stopping = self.wake_event.is_stopping();
            (is_stopping || result.is_some()).then_some(result)
        });
        if let Some(Some(result)) = polled {
            return result;
        }
        let mut interrupted = false;
        loop {
            self.signal.clear();
            if let Some(result) = self.result(&asked, take) {
                return result;
            }
            if self.wake_event.is_stopping() {
                return Err(CallError::Stopping);
            }
            let left = limit.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Err(CallError::Deadline {
                    address: self.address.clone(),
                    limit,
                });
            }
            // The wake event stays readable for its owner: this call does not wait for it twice.
            let descriptors = [self.signal.as_fd(), self.wake_event.as_fd()];
            let waited = if interrupted { 1 } else { 2 };
            interrupted |= wait(&descriptors[..waited], left.min(CYCLE)) & 2 != 0;
        }
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let start = Instant::now();
        if self.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        self.started.check_room()?;
        let asked = self.ask(header, request)?;
        self.started.add(header.sequence, asked, (start, limit));
        Ok(())
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        self.poll_message(&mut |sequence, header, message| {
            take(sequence, header, message.bytes());
        })
    }

    fn poll_message(
        &mut self,
        take: &mut dyn FnMut(u64, Header, Message<'_>),
    ) -> Option<(u64, Result<(), CallError>)> {
        if self.started.is_empty() {
            return None;
        }
        self.signal.clear();
        let mut started = std::mem::take(&mut self.started);
        let is_stopping = self.wake_event.is_stopping();
        let ended = started.next(&self.address, is_stopping, |sequence, asked| {
            self.result(asked, &mut |header, message| {
                take(sequence, header, message);
            })
            .map_or(StartedState::Pending, StartedState::Ended)
        });
        self.started = started;
        ended.map(|(sequence, _, result)| (sequence, result))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.started.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        self.started.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        let until = self.started.due().unwrap_or_else(|| Instant::now() + CYCLE);
        (!self.started.is_empty()).then(|| Awaiting {
            descriptor: self.signal.as_fd(),
            until,
        })
    }

    fn replies_have_ages(&self) -> bool {
        true
    }

    fn peers(&self) -> usize {
        usize::from(lock(&self.state).server.is_some())
    }

    fn server(&self) -> u128 {
        let state = lock(&self.state);
        let server = state.server.as_ref();
        server.map_or(0, |server| u128::from(server.port) + 1)
    }
}

impl Drop for LocalClient {
    fn drop(&mut self) {
        let mut state = lock(&self.state);
        for queue in &mut state.queues {
            queue.open &= queue.client != self.port;
        }
        state.forget();
    }
}

/// A server.
pub(crate) struct LocalServer {
    state: Arc<Mutex<State>>,
    signal: WakeEvent,
    gauge: QueueGauge,
    /// Memory of replies.
    pool: Pool,
}

impl State {
    /// Takes the next request. Clients take turns.
    fn next(&mut self) -> Option<Request> {
        let at = self.queues.iter().position(|q| !q.requests.is_empty())?;
        let mut queue = self.queues.remove(at)?;
        let request = queue.requests.pop_front();
        self.queues.push_back(queue);
        self.forget();
        request
    }

    /// Drops the empty queues of closed clients.
    fn forget(&mut self) {
        self.queues
            .retain(|queue| queue.open || !queue.requests.is_empty());
    }
}

impl Server for LocalServer {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.signal.clear();
    }

    fn serve(
        &mut self,
        handler: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        self.serve_message(&mut |header, message, reply| handler(header, message.bytes(), reply))
    }

    fn serve_message(
        &mut self,
        handler: &mut dyn FnMut(Header, Message<'_>, &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        let request = lock(&self.state).next();
        let Some(request) = request else {
            return Ok(false);
        };
        self.gauge.remove(request.body.memory());
        let mut reply = LocalReply::new(&mut self.pool, request.ticket);
        match request.body {
            Content::Copied(body) => handler(request.header, Message::Bytes(&body), &mut reply),
            Content::Value(value) => {
                handler(request.header, Message::Value(value.into()), &mut reply);
            }
        }
        reply.finish();
        Ok(true)
    }

    fn peers(&self) -> usize {
        lock(&self.state)
            .queues
            .iter()
            .filter(|queue| queue.open)
            .count()
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.gauge.clone())
    }
}

impl Drop for LocalServer {
    fn drop(&mut self) {
        let mut state = lock(&self.state);
        state.server = None;
        let abandoned: Vec<Request> = state
            .queues
            .iter_mut()
            .flat_map(|queue| queue.requests.drain(..))
            .collect();
        state.forget();
        drop(state);
        // Waiting clients are woken only now, outside the lock.
        drop(abandoned);
    }
}
