//! Joins a worker with the runtime: the component that the event loop runs.
//!
//! [`Adapter`] decides the order of calls: what a period of a component with a state machine is, when
//! the machine starts, which state serves which slot. It runs anything that is [`Joined`]: a worker
//! of Rust with its context ([`Pair`]), or a worker of another language.

use crate::collect::{Collect, Collected};
use crate::component::{CallEnd, Component, Sample};
use crate::context::Core;
use crate::dispatch::{Dispatch, Handler, Serving, WorkerContext};
use crate::error::StartError;
use crate::lifecycle::{Hook, Transition};
use crate::machine::{self, Hooks, MachineEvents, Parts};
use crate::ports::Ports;
use crate::process::Embedded;
use crate::testing::DefaultReply;
use crate::worker_error::WorkerError;
use rc_configuration::{ParamChange, Values};
use rc_middleware::Member;
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{HandlerError, Request};
use std::ops::DerefMut;
use std::os::fd::BorrowedFd;
use std::process::ExitCode;
use std::time::Duration;

/// The life of a worker, joined with its context. The functions of a state machine are those of
/// [`Hooks`].
pub trait Living: Hooks {
    /// The state machine, if there is one.
    fn machine(&mut self) -> Option<&mut Parts>;

    /// The events that the runtime fires itself.
    fn machine_events(&self) -> MachineEvents {
        MachineEvents::NONE
    }

    /// Runs `compute()`.
    fn compute(&mut self) -> Result<(), WorkerError>;

    /// Runs a function of the life cycle.
    fn hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError>;
}

/// A worker joined with its context, with all that a component needs.
pub trait Joined: Living {
    /// Gives the context new values of its parameters.
    fn set_parameters(&mut self, values: &Values);

    /// Runs `params_changed()`.
    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError>;

    /// Runs `emergency()`.
    fn emergency(&mut self);

    /// Runs `restore()`.
    fn restore(&mut self);

    /// Runs `finalize()`.
    fn finalize(&mut self);

    /// As [`Component::has_turns`].
    fn has_turns(&self) -> bool {
        false
    }

    /// As [`Component::turn`].
    fn turn(&mut self) -> bool {
        false
    }

    /// As [`Component::has_window`].
    fn has_window(&self) -> bool {
        false
    }

    /// As [`Component::wait_in_window`].
    fn wait_in_window(
        &mut self,
        events: BorrowedFd<'_>,
        limit: Duration,
    ) -> Result<(), WorkerError> {
        let _ = (events, limit);
        Ok(())
    }

    /// As [`Component::sending_peers`].
    fn sending_peers(&self, peers: &mut [usize]);

    /// The machine, and its states in which a slot serves requests. `None` if the slot serves them
    /// in every state.
    fn availability(&mut self, slot: usize) -> Option<(&Parts, &[u16])>;

    /// As [`Component::serve`].
    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError>;

    /// As [`Component::receive`].
    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError>;

    /// As [`Component::collects`].
    fn collects(&self) -> &'static [Collect] {
        &[]
    }

    /// As [`Component::collected`].
    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        let _ = (number, samples);
        Ok(())
    }

    /// As [`Component::keeps`].
    fn keeps(&self, slot: usize, operation: usize) -> bool {
        let _ = (slot, operation);
        false
    }

    /// As [`Component::starts_calls`].
    fn starts_calls(&self, slot: usize) -> bool {
        let _ = slot;
        false
    }

    /// As [`Component::end_call`].
    fn end_call(&mut self, slot: usize, member: Option<&Member>) -> Option<CallEnd> {
        let _ = (slot, member);
        None
    }

    /// As [`Component::end_in_order`].
    fn end_in_order(&mut self, slot: usize, member: Option<&Member>, keeps: bool) {
        let _ = (slot, member, keeps);
    }

    /// As [`Component::awaiting`].
    fn awaiting(&mut self, slot: usize, member: Option<&Member>) -> Option<Awaiting<'_>> {
        let _ = (slot, member);
        None
    }
}

/// Ends the opening of members, and starts the machine of a component that is not managed. Runs
/// after `initialize`.
pub fn begin(joined: &mut impl Living, is_managed: bool, ports: &Ports) -> Result<(), StartError> {
    ports.complete_members()?;
    if !is_managed && joined.machine().is_some() {
        start_machine(joined)?;
    }
    Ok(())
}

fn start_machine(joined: &mut impl Living) -> Result<(), WorkerError> {
    machine::start(joined)?;
    let first = joined.machine_events().first;
    if let (Some(machine), Some(event)) = (joined.machine(), first) {
        machine.fire(event);
    }
    Ok(())
}

/// One period: the `during` functions of the active states, or `compute`, then the waiting events.
pub fn step(joined: &mut impl Living) -> Result<(), WorkerError> {
    if joined.machine().is_none() {
        return joined.compute();
    }
    let result = match machine::during(joined) {
        Ok(true) => joined.compute(),
        Ok(false) => Ok(()),
        Err(error) => Err(error),
    };
    let period = joined.machine_events().period;
    if let (Some(machine), Some((state, event))) = (joined.machine(), period)
        && machine.is_in(state)
    {
        machine.fire(event);
    }
    let rested = machine::rest(joined);
    if matches!(result, Err(WorkerError::Fatal(_))) {
        result
    } else {
        rested.and(result)
    }
}

/// Handles the events of the machine that wait.
pub fn react(joined: &mut impl Living) -> Result<(), WorkerError> {
    match joined.machine() {
        Some(_) => machine::react(joined),
        None => Ok(()),
    }
}

/// Runs a function of the life cycle. The first `activate` starts the machine.
pub fn run_hook(joined: &mut impl Living, hook: Hook<'_>) -> Result<(), WorkerError> {
    joined.hook(hook)?;
    let starts = hook == Hook::Transition(Transition::Activate);
    match joined.machine().filter(|_| starts) {
        Some(machine) if !machine.has_started() => start_machine(joined),
        _ => Ok(()),
    }
}

/// A component: a worker that the event loop runs.
///
/// Generated crates export [`run`] and [`embed`] for their workers.
pub struct Adapter<J>(J);

impl<J: Joined> Adapter<J> {
    /// Joins a worker that was initialized with the runtime, see [`begin`].
    pub fn new(mut joined: J, is_managed: bool, ports: &Ports) -> Result<Self, StartError> {
        begin(&mut joined, is_managed, ports)?;
        Ok(Self(joined))
    }
}

impl<J: Joined> Component for Adapter<J> {
    fn core(&mut self) -> &mut Core {
        self.0.core()
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        step(&mut self.0)
    }

    fn set_parameters(&mut self, values: &Values) {
        self.0.set_parameters(values);
    }

    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        self.0.parameters_changed(changes)
    }

    fn react(&mut self) -> Result<(), WorkerError> {
        react(&mut self.0)
    }

    fn has_turns(&self) -> bool {
        self.0.has_turns()
    }

    fn turn(&mut self) -> bool {
        self.0.turn()
    }

    fn has_window(&self) -> bool {
        self.0.has_window()
    }

    fn wait_in_window(
        &mut self,
        events: BorrowedFd<'_>,
        limit: Duration,
    ) -> Result<(), WorkerError> {
        self.0.wait_in_window(events, limit)
    }

    fn machine(&mut self) -> Option<&mut Parts> {
        self.0.machine()
    }

    fn run_hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        run_hook(&mut self.0, hook)
    }

    fn emergency(&mut self) {
        self.0.emergency();
    }

    fn restore(&mut self) {
        self.0.restore();
    }

    fn finalize(&mut self) {
        if self.0.machine().is_some() {
            machine::stop(&mut self.0);
        }
        self.0.finalize();
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        self.0.sending_peers(peers);
    }

    fn unavailable(&mut self, slot: usize) -> Option<String> {
        let (machine, states) = self.0.availability(slot)?;
        machine.unavailable(states)
    }

    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        self.0.serve(slot, member, request)
    }

    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        self.0.receive(slot, member, operation, sample)
    }

    fn collects(&self) -> &'static [Collect] {
        self.0.collects()
    }

    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        self.0.collected(number, samples)
    }

    fn keeps(&self, slot: usize, operation: usize) -> bool {
        self.0.keeps(slot, operation)
    }

    fn starts_calls(&self, slot: usize) -> bool {
        self.0.starts_calls(slot)
    }

    fn end_call(&mut self, slot: usize, member: Option<&Member>) -> Option<CallEnd> {
        self.0.end_call(slot, member)
    }

    fn end_in_order(&mut self, slot: usize, member: Option<&Member>, keeps: bool) {
        self.0.end_in_order(slot, member, keeps);
    }

    fn awaiting(&mut self, slot: usize, member: Option<&Member>) -> Option<Awaiting<'_>> {
        self.0.awaiting(slot, member)
    }
}

/// A worker of Rust and its context, owned or borrowed, with the functions of its [`Dispatch`].
pub struct Pair<W, C> {
    /// The worker.
    pub worker: W,
    /// The context.
    pub ctx: C,
}

/// No function of a machine runs in a component without one.
const NO_MACHINE: &str = "a function of a machine runs only in a component that has one";

impl<W, C> Hooks for Pair<W, C>
where
    W: DerefMut<Target: Sized + 'static>,
    C: DerefMut<Target: Dispatch<W::Target>>,
{
    fn parts(&mut self) -> &mut Parts {
        WorkerContext::machine(&mut *self.ctx).expect(NO_MACHINE)
    }

    fn core(&mut self) -> &mut Core {
        &mut self.ctx
    }

    fn guard(&mut self, guard: u16) -> bool {
        let guards = C::Target::MACHINE.guards;
        let guard = guards.get(usize::from(guard));
        guard.is_some_and(|guard| guard(&mut self.worker, &mut self.ctx))
    }

    fn action(&mut self, action: u16) -> Result<(), WorkerError> {
        let actions = C::Target::MACHINE.actions;
        let action = actions.get(usize::from(action));
        action.map_or(Ok(()), |action| action(&mut self.worker, &mut self.ctx))
    }

    fn entry(&mut self, state: u16) -> Result<(), WorkerError> {
        let mut states = C::Target::MACHINE.states.iter();
        let of = states.find(|of| of.state == state);
        of.map_or(Ok(()), |of| (of.entry)(&mut self.worker, &mut self.ctx))
    }

    fn exit(&mut self, state: u16) -> Result<(), WorkerError> {
        let mut states = C::Target::MACHINE.states.iter();
        let of = states.find(|of| of.state == state);
        of.map_or(Ok(()), |of| (of.exit)(&mut self.worker, &mut self.ctx))
    }

    fn during(&mut self, state: u16) -> Result<(), WorkerError> {
        let mut states = C::Target::MACHINE.states.iter();
        let of = states.find(|of| of.state == state);
        of.map_or(Ok(()), |of| (of.during)(&mut self.worker, &mut self.ctx))
    }
}

/// Lets the worker handle the next end of a call that was started through a slot. `None` if none
/// has ended.
pub(crate) fn end_call<W: 'static, C: Dispatch<W>>(
    worker: &mut W,
    ctx: &mut C,
    slot: usize,
    member: Option<&Member>,
) -> Option<CallEnd> {
    let (_, end) = C::ENDS.iter().find(|(of, _)| *of == slot)?;
    let client = WorkerContext::asynchronous(ctx, slot, member)?;
    let (how, handle) = client.poll_with(|ended| (CallEnd::of(&ended), end(ended, member)))?;
    if let Some(handle) = handle {
        handle(worker, ctx);
    }
    Some(how)
}

fn no_slot() -> HandlerError {
    HandlerError("the component has no such slot".to_owned())
}

impl<W, C> Living for Pair<W, C>
where
    W: DerefMut<Target: Sized + 'static>,
    C: DerefMut<Target: Dispatch<W::Target>>,
{
    fn machine(&mut self) -> Option<&mut Parts> {
        WorkerContext::machine(&mut *self.ctx)
    }

    fn machine_events(&self) -> MachineEvents {
        C::Target::MACHINE.events
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        (C::Target::WORKER.compute)(&mut self.worker, &mut self.ctx)
    }

    fn hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        (C::Target::WORKER.hook)(&mut self.worker, &mut self.ctx, hook)
    }
}

impl<W, C> Joined for Pair<W, C>
where
    W: DerefMut<Target: Sized + 'static>,
    C: DerefMut<Target: Serving<W::Target>>,
{
    fn set_parameters(&mut self, values: &Values) {
        WorkerContext::set_parameters(&mut *self.ctx, values);
    }

    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        if let Some(reason) = self.ctx.refusal() {
            return Err(WorkerError::Failed(reason));
        }
        (C::Target::WORKER.params_changed)(&mut self.worker, &mut self.ctx, changes)
    }

    fn emergency(&mut self) {
        (C::Target::WORKER.emergency)(&mut self.worker, &mut self.ctx);
    }

    fn restore(&mut self) {
        (C::Target::WORKER.restore)(&mut self.worker, &mut self.ctx);
    }

    fn finalize(&mut self) {
        (C::Target::WORKER.finalize)(&mut self.worker, &mut self.ctx);
        self.ctx.leave();
    }

    fn has_turns(&self) -> bool {
        C::Target::TURN.is_some()
    }

    fn turn(&mut self) -> bool {
        C::Target::TURN.is_some_and(|turn| turn(&mut self.worker, &mut self.ctx))
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        WorkerContext::sending_peers(&*self.ctx, peers);
    }

    fn availability(&mut self, slot: usize) -> Option<(&Parts, &[u16])> {
        let states = C::Target::SLOTS.get(slot)?.states;
        let machine = WorkerContext::machine(&mut *self.ctx)?;
        (!states.is_empty()).then_some((&*machine, states))
    }

    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let (worker, ctx) = (&mut *self.worker, &mut *self.ctx);
        match (
            C::Target::SLOTS.get(slot).map(|entry| &entry.handler),
            member,
        ) {
            (Some(Handler::Serve(serve)), _) => serve(worker, ctx, request),
            (Some(Handler::ServeMember(serve)), Some(member)) => {
                serve(worker, ctx, member, request)
            }
            _ => request.unknown(),
        }
    }

    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        let (worker, ctx) = (&mut *self.worker, &mut *self.ctx);
        let reader = &mut sample.reader();
        match (
            C::Target::SLOTS.get(slot).map(|entry| &entry.handler),
            member,
        ) {
            (Some(Handler::Receive(receive)), _) => receive(worker, ctx, operation, reader),
            (Some(Handler::ReceiveMember(receive)), Some(member)) => {
                receive(worker, ctx, member, operation, reader)
            }
            _ => Err(no_slot()),
        }
    }

    fn collects(&self) -> &'static [Collect] {
        C::Target::COLLECTS
    }

    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        let handle = C::Target::COLLECTED.get(number).ok_or_else(no_slot)?;
        handle(&mut self.worker, &mut self.ctx, samples)
    }

    fn starts_calls(&self, slot: usize) -> bool {
        C::Target::ENDS.iter().any(|(of, _)| *of == slot)
    }

    fn end_call(&mut self, slot: usize, member: Option<&Member>) -> Option<CallEnd> {
        end_call(&mut *self.worker, &mut *self.ctx, slot, member)
    }

    fn end_in_order(&mut self, slot: usize, member: Option<&Member>, keeps: bool) {
        if let Some(client) = WorkerContext::asynchronous(&mut *self.ctx, slot, member) {
            client.end_in_order(keeps);
        }
    }

    fn awaiting(&mut self, slot: usize, member: Option<&Member>) -> Option<Awaiting<'_>> {
        WorkerContext::asynchronous(&mut *self.ctx, slot, member)?.awaiting()
    }
}

type Owned<W, C> = Adapter<Pair<Box<W>, Box<C>>>;

/// Opens the connections, makes the context and the worker, and joins them.
pub(crate) fn start<W: 'static, C: Serving<W>>(
    core: Core,
    ports: &Ports,
    values: &Values,
) -> Result<Owned<W, C>, StartError> {
    let mut ctx = Box::new(C::open(core, ports, values)?);
    let worker = Box::new((C::WORKER.initialize)(&mut ctx)?);
    let mut component = Adapter::new(Pair { worker, ctx }, C::DESCRIPTION.managed, ports)?;
    component.0.ctx.initialized();
    Ok(component)
}

/// Runs the component with the command line of this process until it ends.
pub fn run<W: 'static, C: Serving<W>>() -> ExitCode {
    crate::process::run(C::DESCRIPTION, start::<W, C>)
}

/// Runs the component on a thread of this process, with a command line as for its binary: for
/// tests.
pub fn embed<W: 'static, C: Serving<W>>(args: &[&str]) -> Result<Embedded, StartError> {
    crate::process::embed(C::DESCRIPTION, start::<W, C>, args)
}

/// [`embed`], with default values for the calls of these slots that no server takes.
pub fn embed_with_defaults<W: 'static, C: Serving<W>>(
    defaults: &'static [(usize, DefaultReply)],
    args: &[&str],
) -> Result<Embedded, StartError> {
    crate::process::embed_with_defaults(C::DESCRIPTION, start::<W, C>, defaults, args)
}
