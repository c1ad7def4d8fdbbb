//! Fake servers: they answer the calls of a worker under test, and keep them.

use super::{Answering, TestBed};
use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::started::STARTED_CALLS;
use rc_middleware::typed::{HandlerError, Operation, Request};
use rc_middleware::{CallError, Client, Header, WakeEvent};
use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::rc::Rc;
use std::time::Duration;

/// How calls of a worker under test fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// There is no server: `CallError::NoServer`, and `is_connected` is false.
    NoServer,
    /// The server accepts calls and does not reply: a query ends with `CallError::Deadline`, a
    /// command is queued. The clock of the test stands meanwhile.
    Timeout,
    /// The server dies while it holds a query, `CallError::ServerDied`. For a command there is no
    /// server any more.
    ServerDied,
    /// The server does not take its queue: `CallError::QueueFull`.
    QueueFull,
}

type Answer = Box<dyn FnMut(&mut Request<'_>) -> Result<(), HandlerError>>;

/// The reply to a query, or why its server sent none.
type Answered = Result<Vec<u8>, CallError>;

/// The server at one address.
pub(super) struct Calls {
    address: String,
    /// Distinguishes its client from those of other servers.
    number: u64,
    operations: &'static [Operation],
    answers: BTreeMap<i32, Answer>,
    /// Keeps a call.
    record: Option<Answer>,
    /// The fault of the next call, and whether it is that of all later ones.
    fault: Option<(Fault, bool)>,
}

impl Calls {
    pub(super) fn new(address: &str, number: u64) -> Self {
        Self {
            address: address.to_owned(),
            number,
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
    /// Whether an operation has a result, which a test has to answer.
    fn has_result(operation: &Operation) -> bool;

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
        server.answer_by_default(|operation| !T::has_result(operation));
        server
    }

    /// Answers every query that has no answer yet with default values.
    pub fn answer_defaults(&self) {
        self.answer_by_default(T::has_result);
    }

    fn answer_by_default(&self, which: fn(&Operation) -> bool) {
        let operations = self.state.borrow().operations.iter();
        for operation in operations.filter(|operation| which(operation)) {
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

    /// Sets how an operation is answered from now on.
    #[doc(hidden)]
    pub fn answering(&self, operation: &'static Operation) -> Answering<'_, T> {
        Answering(self, operation)
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

    /// Removes and returns them. A long test does so now and then, because all are kept until then.
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
    /// Started calls that end at the next polls. The server has answered them when they began.
    pub(super) ended: VecDeque<EndedCall>,
}

/// A started call that has ended.
pub(super) struct EndedCall {
    header: Header,
    result: Answered,
}

impl Port {
    /// Lets the server answer a query, as its fault says.
    fn ask(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<Answered, CallError> {
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
        Ok(match fault {
            Some(Fault::Timeout) => Err(CallError::Deadline { address, limit }),
            Some(Fault::ServerDied) => Err(CallError::ServerDied(address)),
            _ => Ok(reply),
        })
    }

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
            // The error is in the reply.
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
        u128::from(self.calls.borrow().number).to_be_bytes()
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
        let reply = self.ask(header, request, limit)??;
        take(header, &reply);
        Ok(())
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        if self.ended.len() >= STARTED_CALLS {
            return Err(CallError::TooManyStarted);
        }
        let result = self.ask(header, request, limit)?;
        self.ended.push_back(EndedCall { header, result });
        Ok(())
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        let EndedCall { header, result } = self.ended.pop_front()?;
        let result = result.map(|reply| take(header.sequence, header, &reply));
        Some((header.sequence, result))
    }

    fn forget(&mut self, sequence: u64) {
        self.ended.retain(|call| call.header.sequence != sequence);
    }

    fn peers(&self) -> usize {
        let fault = self.calls.borrow().fault;
        usize::from(!matches!(fault, Some((Fault::NoServer, _))))
    }
}

/// Declares the fake server `Fake` of an interface and its calls `Call`, over the list of operations
/// that [`rc_middleware::operations!`] documents.
///
/// ```
/// use rc_middleware::typed;
/// use rc_runtime::testing::FakeCall;
///
/// macro_rules! interface {
///     ($($what:tt)+) => {
///         $($what)+! {
///             /// The handlers of `Base`.
///             Base ServeBase ReceiveBase, BaseMembers ServeBaseMembers ReceiveBaseMembers;
///             fn set_speed(speed: f32) {
///                 SET_SPEED.command(typed::read)
///                 SetSpeed on_set_speed one_way("setSpeed", 7, 0x2a)
///             }
///             fn speed -> f32 {
///                 SPEED.answer(typed::read, typed::reply)
///                 Speed on_speed query("speed", 8, 0x2b, &[])
///             }
///         }
///     };
/// }
/// interface!(rc_middleware::operations);
/// interface!(rc_runtime::fake_server);
///
/// assert!(Call::has_result(&SPEED) && !Call::has_result(&SET_SPEED));
/// assert_ne!(Call::Speed, Call::SetSpeed { speed: 0.5 });
/// fn answer(base: &Fake) {
///     base.on_speed(|| 0.5);
/// }
/// ```
#[macro_export]
macro_rules! fake_server {
    (
        $(#[$about:meta])*
        $single:ident $serve:ident $receive:ident, $members:ident $serve_member:ident $receive_member:ident;
        $(
            $(#[$doc:meta])*
            fn $method:ident $(($($arg:ident: $ty:ty),+ $(,)?))? $(-> $ret:ty)? {
                $operation:ident.$how:ident($read:expr $(, $codec:expr)* $(,)?)
                $call:ident $on:ident $kind:ident($name:literal $(, $fact:expr)* $(,)?)
            }
        )*
    ) => {
        /// A call.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Call {
            $(
                #[doc = ::std::concat!("`", $name, "`")]
                $call $({ $($arg: $ty),+ })?,
            )*
        }

        impl $crate::testing::FakeCall for Call {
            fn has_result(operation: &$crate::middleware::typed::Operation) -> bool {
                use $crate::testing::{HasResult, signature};
                $(
                    if operation.id == $operation.id {
                        return HasResult::$how(signature::<fn(($($($ty,)+)?)) $(-> $ret)?>());
                    }
                )*
                let _ = operation;
                false
            }

            fn read(
                request: &mut $crate::middleware::typed::Request<'_>,
            ) -> ::std::result::Result<Self, $crate::middleware::typed::HandlerError> {
                $(
                    if request.operation == $operation.id {
                        return request
                            .arguments(&$operation, $read)
                            .map(|($($($arg,)+)?)| Self::$call $({ $($arg),+ })?);
                    }
                )*
                ::std::result::Result::Err($crate::testing::unknown(request))
            }

            fn default_reply(
                request: &mut $crate::middleware::typed::Request<'_>,
            ) -> ::std::result::Result<(), $crate::middleware::typed::HandlerError> {
                use $crate::testing::{Defaults, signature};
                $(
                    if request.operation == $operation.id {
                        return Defaults(request, &$operation).$how(
                            $read,
                            $($codec,)*
                            signature::<fn(($($($ty,)+)?)) $(-> $ret)?>(),
                        );
                    }
                )*
                ::std::result::Result::Err($crate::testing::unknown(request))
            }
        }

        /// A server of the interface for tests: it replies as configured, records the calls, and
        /// fails on demand. An operation without result needs no answer.
        #[derive(Clone)]
        pub struct Fake($crate::testing::FakeServer<Call>);

        impl Fake {
            $(
                #[doc = ::std::concat!(
                    "Answers `", $name, "` with what `answer` returns; a command by a call of it."
                )]
                pub fn $on(&self, mut answer: impl FnMut($($($ty),+)?) $(-> $ret)? + 'static) {
                    self.0.answering(&$operation).$how(
                        $read,
                        $($codec,)*
                        move |($($($arg,)+)?)| answer($($($arg),+)?),
                    );
                }
            )*
        }

        impl $crate::testing::Fake for Fake {
            fn new(bed: &$crate::testing::TestBed, slot: usize, member: Option<&str>) -> Self {
                Self($crate::testing::FakeServer::new(bed, slot, member))
            }

            fn answer_defaults(&self) {
                self.0.answer_defaults();
            }
        }

        impl ::std::ops::Deref for Fake {
            type Target = $crate::testing::FakeServer<Call>;

            fn deref(&self) -> &Self::Target {
                &self.0
            }
        }
    };
}
