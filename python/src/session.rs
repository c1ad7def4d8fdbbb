//! What a worker reaches through its context: on its thread, while one of its functions runs.

use crate::description::{Program, Slot};
use crate::errors;
use crate::memory::drop_abandoned;
use pyo3::prelude::*;
use rc_middleware::OpenError;
use rc_middleware::typed::{TypedClient, TypedPublisher};
use rc_runtime::machine::{Machine, Numbered};
use rc_runtime::{Connections, Core, Member, Ports, Role, TimeSource, WorkerError};
use std::cell::RefCell;
use std::sync::Arc;

/// A state or an event by its number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number(pub(crate) u16);

impl Numbered for Number {
    fn number(self) -> u16 {
        self.0
    }
}

/// The sending ends of a slot, or of a member of an array. An array itself has none.
struct Ends {
    /// The number of the slot in the description, for a member that of its array.
    described: usize,
    client: Option<TypedClient>,
    publishers: Vec<TypedPublisher>,
}

impl Ends {
    fn open(
        of: &Slot,
        described: usize,
        ports: &Connections,
        slot: usize,
    ) -> Result<Self, OpenError> {
        let client = (of.role == Role::Requires).then(|| ports.client(slot));
        let topics = if of.role == Role::Publishes {
            of.operations.len()
        } else {
            0
        };
        let publishers = (0..topics).map(|operation| ports.publisher(slot, operation));
        Ok(Self {
            described,
            client: client.transpose()?,
            publishers: publishers.collect::<Result<_, _>>()?,
        })
    }

    fn peers(&self) -> usize {
        let publishers = self.publishers.iter().map(TypedPublisher::peers).max();
        self.client.as_ref().map_or(0, TypedClient::peers) + publishers.unwrap_or(0)
    }
}

/// The connections of a component. Core and machine are here while a function of the worker runs;
/// between two of them the runtime has them.
pub(crate) struct Session {
    pub(crate) core: Option<Core>,
    pub(crate) machine: Option<Machine<Number, Number>>,
    pub(crate) time: TimeSource,
    program: Arc<Program>,
    ports: Ports,
    /// By the number of the slot: those of the description, then the members in the order in which
    /// the worker opened them.
    ends: Vec<Ends>,
}

thread_local! {
    static SESSION: RefCell<Option<Session>> = const { RefCell::new(None) };
}

impl Session {
    /// Opens the sending ends of all slots that are no arrays.
    pub(crate) fn open(program: &Arc<Program>, ports: &Ports) -> Result<Self, OpenError> {
        let slots = program.slots.iter().enumerate();
        let ends = slots.map(|(at, slot)| {
            if slot.is_array {
                return Ok(Ends {
                    described: at,
                    client: None,
                    publishers: Vec::new(),
                });
            }
            Ends::open(slot, at, ports, at)
        });
        Ok(Self {
            core: None,
            machine: None,
            ends: ends.collect::<Result<_, _>>()?,
            time: ports.time_source(),
            program: Arc::clone(program),
            ports: Ports::clone(ports),
        })
    }

    /// Opens a member of the array with this number.
    pub(crate) fn open_member(&mut self, array: usize, name: &str) -> PyResult<Member> {
        let of = self.program.array(array)?;
        let opened = self.ports.open_member(array, name, |ports, slot| {
            Ends::open(of, array, ports, slot)
        });
        let (member, ends) = opened.map_err(|error| errors::of_member(&error))?;
        // The runtime numbers members in the order in which they are opened.
        self.ends.push(ends);
        Ok(member)
    }

    /// The members of an array that the network lists.
    pub(crate) fn listed(&self, array: usize) -> PyResult<Option<Vec<String>>> {
        self.program.array(array)?;
        Ok(self.ports.listed(array))
    }

    /// The number in the description of a slot, or of the array of a member.
    pub(crate) fn described(&self, slot: usize) -> PyResult<usize> {
        let ends = self.ends.get(slot);
        let ends = ends.ok_or_else(|| errors::no_such("operation", slot))?;
        Ok(ends.described)
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
        let ends = self.ends.get_mut(slot);
        let client = ends.and_then(|ends| ends.client.as_mut());
        client.ok_or_else(|| errors::no_such("client", slot))
    }

    pub(crate) fn publisher(
        &mut self,
        slot: usize,
        operation: usize,
    ) -> PyResult<&mut TypedPublisher> {
        let ends = self.ends.get_mut(slot);
        let topic = ends.and_then(|ends| ends.publishers.get_mut(operation));
        topic.ok_or_else(|| errors::no_such("publisher", slot))
    }

    /// The number of peers of a slot that sends.
    pub(crate) fn peers(&self, slot: usize) -> usize {
        self.ends.get(slot).map_or(0, Ends::peers)
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

/// The same for the time of the network.
pub(crate) fn with_time<T>(use_it: impl FnOnce(&mut TimeSource) -> T) -> PyResult<T> {
    with(|session| Ok(use_it(&mut session.time)))
}

/// Writes the numbers of peers of all slots that send, between two functions of the worker.
pub(crate) fn count_peers(peers: &mut [usize]) {
    SESSION.with_borrow(|session| {
        let ends = session.iter().flat_map(|session| &session.ends);
        for (count, ends) in peers.iter_mut().zip(ends) {
            if ends.client.is_some() || !ends.publishers.is_empty() {
                *count = ends.peers();
            }
        }
    });
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
