//! The answer of a fake to an operation. The functions have the names of those of [`Request`] that
//! serve the operation, so that one list of operations names both.

use super::FakeServer;
use rc_middleware::typed::{HandlerError, Operation, Request, Throws};
use rc_middleware::{DecodeError, Reader, Writer};
use std::any::TypeId;
use std::marker::PhantomData;

type Read<A> = fn(&mut Reader<'_>) -> Result<A, DecodeError>;
type Write<R> = fn(&R, &mut Writer<'_>);

/// Answers an operation of a fake from now on with the result of a function of the test.
pub struct Answering<'s, T>(pub(super) &'s FakeServer<T>, pub(super) &'static Operation);

impl<T: Clone + 'static> Answering<'_, T> {
    /// Answers a command by a call of `answer`.
    pub fn command<A: 'static>(self, read: Read<A>, mut answer: impl FnMut(A) + 'static) {
        let Self(server, operation) = self;
        server.on(operation, move |request| {
            request.command(operation, read, &mut answer)
        });
    }

    /// Answers a query that throws nothing.
    pub fn answer<A: 'static, R: Send + Sync + 'static>(
        self,
        read: Read<A>,
        write: Write<R>,
        mut answer: impl FnMut(A) -> R + 'static,
    ) {
        let Self(server, operation) = self;
        server.on(operation, move |request| {
            request.answer(operation, read, write, &mut answer)
        });
    }

    /// Answers a query that throws.
    pub fn try_answer<A: 'static, R: Send + Sync + 'static, E: Throws + 'static>(
        self,
        read: Read<A>,
        write: Write<R>,
        mut answer: impl FnMut(A) -> Result<R, E> + 'static,
    ) {
        let Self(server, operation) = self;
        server.on(operation, move |request| {
            request.try_answer(operation, read, write, &mut answer)
        });
    }
}

/// The type of a handler without its worker: all parameters as one tuple.
pub fn signature<F>() -> PhantomData<F> {
    PhantomData
}

/// Replies to a request of an operation with default values.
pub struct Defaults<'r, 'a>(pub &'r mut Request<'a>, pub &'static Operation);

impl Defaults<'_, '_> {
    /// A command has no reply.
    pub fn command<A>(self, read: Read<A>, _: PhantomData<fn(A)>) -> Result<(), HandlerError> {
        self.0.command(self.1, read, drop)
    }

    /// The default value of the result of a query that throws nothing.
    pub fn answer<A, R: Default + Send + Sync + 'static>(
        self,
        read: Read<A>,
        write: Write<R>,
        _: PhantomData<fn(A) -> R>,
    ) -> Result<(), HandlerError> {
        self.0.answer(self.1, read, write, |_| R::default())
    }

    /// The default value of the result of a query that throws.
    pub fn try_answer<A, R: Default + Send + Sync + 'static, E>(
        self,
        read: Read<A>,
        write: Write<R>,
        _: PhantomData<fn(A) -> Result<R, E>>,
    ) -> Result<(), HandlerError> {
        self.answer(read, write, PhantomData)
    }
}

/// Whether an operation has a result, which a test has to answer.
pub struct HasResult;

impl HasResult {
    /// A command has none.
    pub fn command<A>(_: PhantomData<fn(A)>) -> bool {
        false
    }

    /// Whether the result of a query that throws nothing is a value.
    pub fn answer<A, R: 'static>(_: PhantomData<fn(A) -> R>) -> bool {
        TypeId::of::<R>() != TypeId::of::<()>()
    }

    /// Whether the result of a query that throws is a value.
    pub fn try_answer<A, R: 'static, E>(_: PhantomData<fn(A) -> Result<R, E>>) -> bool {
        Self::answer(PhantomData::<fn(A) -> R>)
    }
}
