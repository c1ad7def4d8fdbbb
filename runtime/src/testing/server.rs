//! Fake servers: they answer the calls of a worker under test, and keep them.

use super::TestBed;
use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::typed::{HandlerError, Operation, Request, Throws};
use rc_middleware::{CallError, Client, DecodeError, Header, Reader, WakeEvent, Writer};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

/// How calls of a worker under test fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// There is no server: `CallError::NoServer`, and `is_connected` is false.
    NoServer,
    /// The server takes calls and does not reply: a query ends with `CallError::Deadline`, a
    /// command is queued. The clock of the test stands meanwhile.
    Timeout,
    /// The server dies while it holds a query, `CallError::ServerDied`. For a command there is no
    /// server any more.
    ServerDied,
    /// The server does not take its queue: `CallError::QueueFull`.
    QueueFull,
}

type Answer = Box<dyn FnMut(&mut Request<'_>) -> Result<(), HandlerError>>;

/// The server at one address.
pub(super) struct Calls {
    address: String,
    operations: &'static [Operation],
    answers: BTreeMap<i32, Answer>,
    /// Keeps a call.
    record: Option<Answer>,
    /// The fault of the next call, and whether it is that of all later ones.
    fault: Option<(Fault, bool)>,
}

impl Calls {
    pub(super) fn new(address: &str) -> Self {
        Self {
            address: address.to_owned(),
            operations: &[],
            answers: BTreeMap::new(),
            record: None,
            fault: None,
        }
    }

    fn take_fault(&mut self) -> Option<Fault> {
        let (fault, stays) = self.fault?;
        if !stays {
            self.fault = None;
        }
        Some(fault)
    }
}

/// Refuses a request of an operation that the interface does not have.
#[doc(hidden)]
pub fn unknown(request: &mut Request<'_>) -> HandlerError {
    let refused = request.unknown().err();
    refused.unwrap_or_else(|| HandlerError("there is no such operation".to_owned()))
}

/// A fake server for one slot of a worker under test. Its clones are the same server.
#[derive(Clone)]
pub struct FakeServer<T> {
    state: Rc<RefCell<Calls>>,
    calls: Rc<RefCell<Vec<T>>>,
}

/// A call that a fake keeps: generated code has one for each interface that can be implemented.
pub trait FakeCall: Clone + 'static {
    /// The operations with a result, which a test has to answer.
    const ANSWERED: &'static [Operation];

    /// Reads a call.
    fn read(request: &mut Request<'_>) -> Result<Self, HandlerError>;

    /// Replies with default values.
    fn default_reply(request: &mut Request<'_>) -> Result<(), HandlerError>;
}

impl<T: FakeCall> FakeServer<T> {
    /// The server of a slot, or of a member of an array, by the slot's number.
    #[doc(hidden)]
    pub fn new(bed: &TestBed, slot: usize, member: Option<&str>) -> Self {
        let server = Self::reading(bed, slot, member, T::read);
        let operations = server.state.borrow().operations;
        for operation in operations {
            if !T::ANSWERED.contains(operation) {
                server.or_default(operation, T::default_reply);
            }
        }
        server
    }

    /// Answers every query that has no answer yet with default values.
    pub fn answer_defaults(&self) {
        for operation in T::ANSWERED {
            self.or_default(operation, T::default_reply);
        }
    }
}

impl<T: Clone + 'static> FakeServer<T> {
    /// The server of a slot, or of a member of an array. `read` reads a call.
    #[doc(hidden)]
    pub fn reading(
        bed: &TestBed,
        slot: usize,
        member: Option<&str>,
        read: impl Fn(&mut Request<'_>) -> Result<T, HandlerError> + 'static,
    ) -> Self {
        let calls: Rc<RefCell<Vec<T>>> = Rc::default();
        let kept = Rc::clone(&calls);
        let (operations, address) = bed.end(slot, member);
        let state = bed.hub.server(&address);
        {
            let mut state = state.borrow_mut();
            state.operations = operations;
            state.record = Some(Box::new(move |request| {
                let call = read(request)?;
                kept.borrow_mut().push(call);
                Ok(())
            }));
        }
        Self { state, calls }
    }

    /// Answers an operation from now on.
    #[doc(hidden)]
    pub fn on(
        &self,
        operation: &Operation,
        answer: impl FnMut(&mut Request<'_>) -> Result<(), HandlerError> + 'static,
    ) {
        let mut state = self.state.borrow_mut();
        state.answers.insert(operation.id, Box::new(answer));
    }

    /// Answers a command from now on by a call of `answer`.
    #[doc(hidden)]
    pub fn on_command<A: 'static>(
        &self,
        operation: &'static Operation,
        read: fn(&mut Reader<'_>) -> Result<A, DecodeError>,
        mut answer: impl FnMut(A) + 'static,
    ) {
        self.on(operation, move |request| {
            request.command(operation, read, &mut answer)
        });
    }

    /// Answers a query that throws nothing from now on with what `answer` returns.
    #[doc(hidden)]
    pub fn on_query<A: 'static, R: 'static>(
        &self,
        operation: &'static Operation,
        read: fn(&mut Reader<'_>) -> Result<A, DecodeError>,
        write: fn(&R, &mut Writer<'_>),
        mut answer: impl FnMut(A) -> R + 'static,
    ) {
        self.on(operation, move |request| {
            request.answer(operation, read, write, &mut answer)
        });
    }

    /// [`FakeServer::on_query`] for a query that throws.
    #[doc(hidden)]
    pub fn on_throwing_query<A: 'static, R: 'static, E: Throws + 'static>(
        &self,
        operation: &'static Operation,
        read: fn(&mut Reader<'_>) -> Result<A, DecodeError>,
        write: fn(&R, &mut Writer<'_>),
        mut answer: impl FnMut(A) -> Result<R, E> + 'static,
    ) {
        self.on(operation, move |request| {
            request.try_answer(operation, read, write, &mut answer)
        });
    }

    /// Answers an operation that has no answer yet.
    #[doc(hidden)]
    pub fn or_default(
        &self,
        operation: &Operation,
        answer: impl FnMut(&mut Request<'_>) -> Result<(), HandlerError> + 'static,
    ) {
        let mut state = self.state.borrow_mut();
        let entry = state.answers.entry(operation.id);
        entry.or_insert_with(|| Box::new(answer));
    }

    /// The calls that have reached the server, in their order, commands included.
    pub fn calls(&self) -> Vec<T> {
        self.calls.borrow().clone()
    }

    /// Takes them. A long test does so now and then, since all are kept until then.
    pub fn take_calls(&self) -> Vec<T> {
        self.calls.take()
    }

    /// Lets all calls fail from now on.
    pub fn fail(&self, fault: Fault) {
        self.state.borrow_mut().fault = Some((fault, true));
    }

    /// Lets the next call fail.
    pub fn fail_once(&self, fault: Fault) {
        self.state.borrow_mut().fault = Some((fault, false));
    }

    /// Ends a fault.
    pub fn recover(&self) {
        self.state.borrow_mut().fault = None;
    }
}

/// The client of the worker.
pub(super) struct Port {
    pub(super) calls: Rc<RefCell<Calls>>,
    pub(super) wake_event: WakeEvent,
}

impl Port {
    /// Keeps a request and answers it. Gives the reply, which is empty for a command.
    fn serve(&self, header: Header, body: &[u8]) -> Result<Vec<u8>, CallError> {
        let operation = Request::open(header, body, &mut Vec::new())?.operation;
        // Neither runs while the state is borrowed: an answer may use the fake itself.
        let record = self.calls.borrow_mut().record.take();
        if let Some(mut record) = record {
            let recorded = record(&mut Request::open(header, body, &mut Vec::new())?);
            self.calls.borrow_mut().record = Some(record);
            recorded.map_err(|error| CallError::Refused(error.0))?;
        }
        let answer = self.calls.borrow_mut().answers.remove(&operation);
        let mut reply = Vec::new();
        let mut request = Request::open(header, body, &mut reply)?;
        if let Some(mut answer) = answer {
            // What went wrong is in the reply.
            let _ = answer(&mut request);
            let mut calls = self.calls.borrow_mut();
            calls.answers.entry(operation).or_insert(answer);
        } else {
            let calls = self.calls.borrow();
            let known = calls.operations.iter().find(|o| o.id == operation);
            let name = known.map_or("this operation", |o| o.name);
            let _ = request.fail(&format!(
                "the test does not answer `{name}` of {}; set an answer with its `on_…`, or call `answer_defaults`",
                calls.address
            ));
        }
        request.close();
        Ok(reply)
    }
}

impl Client for Port {
    fn guid(&self) -> [u8; 16] {
        [1; 16]
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let fault = self.calls.borrow_mut().take_fault();
        let address = self.calls.borrow().address.clone();
        match fault {
            Some(Fault::NoServer | Fault::ServerDied) => Err(CallError::NoServer(address)),
            Some(Fault::QueueFull) => Err(CallError::QueueFull(address)),
            Some(Fault::Timeout) | None => self.serve(header, &buffer(request)?).map(drop),
        }
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        if self.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let fault = self.calls.borrow_mut().take_fault();
        let address = self.calls.borrow().address.clone();
        match fault {
            Some(Fault::NoServer) => return Err(CallError::NoServer(address)),
            Some(Fault::QueueFull) => return Err(CallError::QueueFull(address)),
            _ => {}
        }
        let reply = self.serve(header, &buffer(request)?)?;
        match fault {
            Some(Fault::Timeout) => Err(CallError::Deadline { address, limit }),
            Some(Fault::ServerDied) => Err(CallError::ServerDied(address)),
            _ => {
                take(header, &reply);
                Ok(())
            }
        }
    }

    fn peers(&self) -> usize {
        let fault = self.calls.borrow().fault;
        usize::from(!matches!(fault, Some((Fault::NoServer, _))))
    }
}

/// Declares the fake server of an interface, whose calls are of the type `$call`. Generated code adds
/// the functions that set its answers.
///
/// ```
/// use rc_middleware::typed::{self, HandlerError, Operation, Request};
/// use rc_runtime::testing::{FakeCall, unknown};
///
/// const IS_ENABLED: Operation = Operation::query("isEnabled", 7, 0, &[]);
///
/// #[derive(Clone, Debug, PartialEq)]
/// pub enum Call {
///     IsEnabled,
/// }
///
/// impl FakeCall for Call {
///     const ANSWERED: &'static [Operation] = &[IS_ENABLED];
///
///     fn read(request: &mut Request<'_>) -> Result<Self, HandlerError> {
///         match request.place(Self::ANSWERED) {
///             Some(_) => request.arguments(&IS_ENABLED, typed::read).map(|()| Self::IsEnabled),
///             None => Err(unknown(request)),
///         }
///     }
///
///     fn default_reply(request: &mut Request<'_>) -> Result<(), HandlerError> {
///         request.answer(&IS_ENABLED, typed::read, typed::reply, |(): ()| false)
///     }
/// }
///
/// rc_runtime::fake_server!(Fake: Call);
///
/// impl Fake {
///     /// Answers `isEnabled` with what `answer` returns.
///     pub fn on_is_enabled(&self, mut answer: impl FnMut() -> bool + 'static) {
///         self.0.on_query(&IS_ENABLED, typed::read, typed::reply, move |()| answer());
///     }
/// }
/// ```
#[macro_export]
macro_rules! fake_server {
    ($name:ident: $call:ident) => {
        /// A server of the interface for tests: it replies as configured, records the calls, and
        /// fails on demand. An operation without result needs no answer.
        #[derive(Clone)]
        pub struct $name($crate::testing::FakeServer<$call>);

        impl $crate::testing::Fake for $name {
            fn new(bed: &$crate::testing::TestBed, slot: usize, member: Option<&str>) -> Self {
                Self($crate::testing::FakeServer::new(bed, slot, member))
            }

            fn answer_defaults(&self) {
                self.0.answer_defaults();
            }
        }

        impl ::std::ops::Deref for $name {
            type Target = $crate::testing::FakeServer<$call>;

            fn deref(&self) -> &Self::Target {
                &self.0
            }
        }
    };
}
