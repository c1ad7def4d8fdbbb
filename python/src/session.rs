//! What a worker reaches through its context: on its thread, while one of its functions runs.

use crate::description::Program;
use crate::errors;
use crate::memory::drop_abandoned;
use pyo3::prelude::*;
use rc_middleware::OpenError;
use rc_middleware::typed::{TypedClient, TypedPublisher};
use rc_runtime::machine::{Machine, Numbered};
use rc_runtime::{Core, Ports, Role, WorkerError};
use std::cell::RefCell;

/// A state or an event by its number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number(pub(crate) u16);

impl Numbered for Number {
    fn number(self) -> u16 {
        self.0
    }
}

/// The connections of a component. Core and machine are here while a function of the worker runs;
/// between two of them the runtime has them.
pub(crate) struct Session {
    pub(crate) core: Option<Core>,
    pub(crate) machine: Option<Machine<Number, Number>>,
    clients: Vec<Option<TypedClient>>,
    publishers: Vec<Vec<TypedPublisher>>,
}

thread_local! {
    static SESSION: RefCell<Option<Session>> = const { RefCell::new(None) };
}

impl Session {
    /// Opens the sending ends of all slots.
    pub(crate) fn open(program: &Program, ports: &Ports) -> Result<Self, OpenError> {
        let mut session = Self {
            core: None,
            machine: None,
            clients: Vec::new(),
            publishers: Vec::new(),
        };
        for (at, slot) in program.slots.iter().enumerate() {
            let client = (slot.role == Role::Requires).then(|| ports.client(at));
            session.clients.push(client.transpose()?);
            let topics = if slot.role == Role::Publishes {
                0..slot.operations.len()
            } else {
                0..0
            };
            let publishers = topics.map(|operation| ports.publisher(at, operation));
            session
                .publishers
                .push(publishers.collect::<Result<_, _>>()?);
        }
        Ok(session)
    }

    /// Makes it the session of this thread.
    pub(crate) fn begin(self) {
        SESSION.set(Some(self));
    }

    /// Closes the session of this thread.
    pub(crate) fn end() {
        drop_abandoned();
        drop(SESSION.take());
    }

    pub(crate) fn client(&mut self, slot: usize) -> PyResult<&mut TypedClient> {
        let client = self.clients.get_mut(slot).and_then(Option::as_mut);
        client.ok_or_else(|| errors::no_such("client", slot))
    }

    pub(crate) fn publisher(
        &mut self,
        slot: usize,
        operation: usize,
    ) -> PyResult<&mut TypedPublisher> {
        let topics = self.publishers.get_mut(slot);
        let topic = topics.and_then(|topics| topics.get_mut(operation));
        topic.ok_or_else(|| errors::no_such("publisher", slot))
    }

    /// The number of peers of a slot that sends.
    pub(crate) fn peers(&self, slot: usize) -> usize {
        let client = self.clients.get(slot).and_then(Option::as_ref);
        let publishers = self.publishers.get(slot).into_iter().flatten();
        let publishers = publishers.map(TypedPublisher::peers).max();
        client.map_or(0, TypedClient::peers) + publishers.unwrap_or(0)
    }
}

/// Passes the session of this thread to `use_it`. On another thread there is none.
pub(crate) fn with<T>(use_it: impl FnOnce(&mut Session) -> PyResult<T>) -> PyResult<T> {
    SESSION.with(|session| match session.try_borrow_mut() {
        Ok(mut session) => match session.as_mut() {
            Some(session) => use_it(session),
            None => Err(errors::wrong_thread()),
        },
        Err(_) => Err(errors::wrong_thread()),
    })
}

/// The same for the core, which is there while a function of the worker runs.
pub(crate) fn with_core<T>(use_it: impl FnOnce(&mut Core) -> T) -> PyResult<T> {
    with(|session| {
        let core = session.core.as_mut().ok_or_else(errors::wrong_thread)?;
        Ok(use_it(core))
    })
}

/// The same for the state machine.
pub(crate) fn with_machine<T>(
    use_it: impl FnOnce(&mut Machine<Number, Number>) -> T,
) -> PyResult<T> {
    with(|session| {
        let machine = session.machine.as_mut().ok_or_else(errors::wrong_thread)?;
        Ok(use_it(machine))
    })
}

/// The numbers of peers, between two functions of the worker.
pub(crate) fn peers_of(slot: usize) -> usize {
    SESSION.with_borrow(|session| session.as_ref().map_or(0, |session| session.peers(slot)))
}

/// Gives core and machine to the session while `run` runs.
pub(crate) fn lend<T>(
    core: &mut Option<Core>,
    machine: &mut Option<Machine<Number, Number>>,
    run: impl FnOnce() -> T,
) -> T {
    /// Takes them back, also from a panic.
    struct CoreGuard<'a>(
        &'a mut Option<Core>,
        &'a mut Option<Machine<Number, Number>>,
    );

    impl CoreGuard<'_> {
        fn swap(&mut self) {
            SESSION.with_borrow_mut(|session| {
                if let Some(session) = session {
                    std::mem::swap(&mut session.core, self.0);
                    std::mem::swap(&mut session.machine, self.1);
                }
            });
        }
    }

    impl Drop for CoreGuard<'_> {
        fn drop(&mut self) {
            self.swap();
        }
    }

    // Samples whose last view ended on another thread since the last function.
    drop_abandoned();
    let mut guard = CoreGuard(core, machine);
    guard.swap();
    run()
}

/// Logs the exception of a handler. A fatal one ends the component after the handler.
pub(crate) fn note_failure(py: Python<'_>, error: &PyErr) {
    if let WorkerError::Fatal(reason) = errors::of_worker(py, error)
        // The handler runs, so the core is there.
        && let Err(error) = with_core(|core| core.fail(&reason))
    {
        rc_runtime::tracing::error!("{reason}: {error}");
    }
}
