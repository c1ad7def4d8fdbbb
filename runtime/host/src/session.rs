//! Everything that a worker reaches through its context: on its thread, while one of its functions
//! runs.

use crate::description::{Operation, Program, Slot};
use crate::error::HostError;
use crate::lent::drop_abandoned;
use rc_middleware::OpenError;
use rc_middleware::typed::{TypedClient, TypedPublisher};
use rc_runtime::machine::{Machine, Numbered};
use rc_runtime::{Connections, Core, EarlySamples, Member, Places, Ports, Role, TimeSource};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

/// A state or an event by its number.
#[derive(Clone, Copy, Debug)]
pub struct Number(
    /// The number.
    pub u16,
);

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
pub struct Session {
    /// The core.
    pub core: Option<Core>,
    /// The state machine, if the component has one.
    pub machine: Option<Machine<Number, Number>>,
    /// Advances the time of the network.
    pub time: TimeSource,
    program: Arc<Program>,
    ports: Ports,
    /// By the number of the slot: those of the description, then the members in the order in which
    /// the worker opened them.
    ends: Vec<Ends>,
}

thread_local! {
    static SESSION: RefCell<Option<Box<Session>>> = const { RefCell::new(None) };
}

impl Session {
    /// From now on, `places` knows where frames are in the world of the component.
    pub fn know_frames(&self, places: Rc<dyn Places>) {
        self.ports.know_frames(places);
    }

    /// Opens the sending ends of all slots that are not arrays. The session is boxed, because each function of a worker
    /// may move it to the thread and back.
    ///
    /// # Errors
    /// A middleware refuses one.
    pub fn open(program: &Arc<Program>, ports: &Ports) -> Result<Box<Self>, OpenError> {
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
        Ok(Box::new(Self {
            core: None,
            machine: None,
            ends: ends.collect::<Result<_, _>>()?,
            time: ports.time_source(),
            program: Arc::clone(program),
            ports: Ports::clone(ports),
        }))
    }

    /// Opens a member of the array with this number.
    ///
    /// # Errors
    /// There is no such array, or the runtime refuses the member.
    pub fn open_member(&mut self, array: usize, name: &str) -> Result<Member, HostError> {
        let of = self.program.array(array)?;
        let opened = self.ports.open_member(array, name, |ports, slot| {
            Ends::open(of, array, ports, slot)
        });
        let (member, ends) = opened?;
        // The runtime numbers members in the order in which they are opened.
        self.ends.push(ends);
        Ok(member)
    }

    /// The members of an array that the network lists.
    ///
    /// # Errors
    /// There is no such array.
    pub fn listed(&self, array: usize) -> Result<Option<Vec<String>>, HostError> {
        self.program.array(array)?;
        Ok(self.ports.listed(array))
    }

    /// The number in the description of a slot, or of the array of a member.
    ///
    /// # Errors
    /// There is no such slot.
    pub fn described(&self, slot: usize) -> Result<usize, HostError> {
        let ends = self.ends.get(slot);
        let ends = ends.ok_or_else(|| HostError::no_such("operation", slot))?;
        Ok(ends.described)
    }

    /// Makes it the session of this thread.
    pub fn begin(self: Box<Self>) {
        SESSION.set(Some(self));
    }

    /// Closes the session of this thread.
    pub fn end() {
        drop_abandoned();
        drop(SESSION.take());
    }

    /// The client of a slot.
    ///
    /// # Errors
    /// The slot has none.
    pub fn client(&mut self, slot: usize) -> Result<&mut TypedClient, HostError> {
        let ends = self.ends.get_mut(slot);
        let client = ends.and_then(|ends| ends.client.as_mut());
        client.ok_or_else(|| HostError::no_such("client", slot))
    }

    /// The publisher of a topic of a slot.
    ///
    /// # Errors
    /// The slot has none.
    pub fn publisher(
        &mut self,
        slot: usize,
        operation: usize,
    ) -> Result<&mut TypedPublisher, HostError> {
        let ends = self.ends.get_mut(slot);
        let topic = ends.and_then(|ends| ends.publishers.get_mut(operation));
        topic.ok_or_else(|| HostError::no_such("publisher", slot))
    }

    /// A topic of a slot that publishes: its description and its publisher.
    ///
    /// # Errors
    /// The slot has no such topic.
    pub(crate) fn topic(
        &mut self,
        slot: usize,
        operation: usize,
    ) -> Result<(&Operation, &mut TypedPublisher), HostError> {
        let ends = self.ends.get_mut(slot);
        let topic = ends.and_then(|ends| {
            let described = self.program.operation(ends.described, operation)?;
            Some((described, ends.publishers.get_mut(operation)?))
        });
        topic.ok_or_else(|| HostError::no_such("publisher", slot))
    }

    /// Samples that the worker may await within a turn.
    pub fn early_samples(&self) -> EarlySamples {
        self.ports.early_samples().clone()
    }

    /// The number of peers of a slot that sends.
    pub fn peers(&self, slot: usize) -> usize {
        self.ends.get(slot).map_or(0, Ends::peers)
    }

    /// Writes the numbers of peers of all slots that send.
    pub fn count_peers(&self, peers: &mut [usize]) {
        for (count, ends) in peers.iter_mut().zip(&self.ends) {
            if ends.client.is_some() || !ends.publishers.is_empty() {
                *count = ends.peers();
            }
        }
    }
}

/// Exchanges the session of this thread for another one, and says whether it did: not while a call
/// uses it. A test has several components on one thread, and a component may keep its session while none
/// of its functions runs.
pub fn swap(other: &mut Option<Box<Session>>) -> bool {
    SESSION.with(|session| match session.try_borrow_mut() {
        Ok(mut session) => {
            std::mem::swap(&mut *session, other);
            true
        }
        Err(_) => false,
    })
}

/// Passes the session of this thread to `use_it`.
///
/// # Errors
/// On another thread, and inside of `use_it`, there is none.
pub fn with<T>(use_it: impl FnOnce(&mut Session) -> Result<T, HostError>) -> Result<T, HostError> {
    SESSION.with(|session| match session.try_borrow_mut() {
        Ok(mut session) => match session.as_mut() {
            Some(session) => use_it(session),
            None => Err(HostError::WrongThread),
        },
        Err(_) => Err(HostError::WrongThread),
    })
}

/// Passes the core to `use_it`.
///
/// # Errors
/// The core is there only while a function of the worker runs, on its thread.
pub fn with_core<T>(use_it: impl FnOnce(&mut Core) -> T) -> Result<T, HostError> {
    with(|session| {
        let core = session.core.as_mut().ok_or(HostError::WrongThread)?;
        Ok(use_it(core))
    })
}

/// Passes the state machine to `use_it`.
///
/// # Errors
/// As of [`with_core`].
pub fn with_machine<T>(
    use_it: impl FnOnce(&mut Machine<Number, Number>) -> T,
) -> Result<T, HostError> {
    with(|session| {
        let machine = session.machine.as_mut().ok_or(HostError::WrongThread)?;
        Ok(use_it(machine))
    })
}

/// Passes the time of the network to `use_it`.
///
/// # Errors
/// As of [`with`].
pub fn with_time<T>(use_it: impl FnOnce(&mut TimeSource) -> T) -> Result<T, HostError> {
    with(|session| Ok(use_it(&mut session.time)))
}

/// Writes the numbers of peers of all slots that send, between two functions of the worker.
pub fn count_peers(peers: &mut [usize]) {
    SESSION.with_borrow(|session| {
        if let Some(session) = session {
            session.count_peers(peers);
        }
    });
}

/// Gives core and machine to the session while `run` runs.
pub fn lend<T>(
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
