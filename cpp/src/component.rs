//! A worker in C++ as the runtime sees it.

use crate::call::{Call, Function, Guest};
use crate::context::{age, of_ended};
use crate::handles;
use crate::parameters;
use crate::status::{Answer, DONE, EXCEPTION};
use rc_configuration::Parameters;
use rc_host::{
    Image, KeptCounts, Operation, Program, Session, bodies, drop_abandoned, session, undecodable,
};
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{HandlerError, Request, TypedClient};
use rc_middleware::{CallError, Writer};
use rc_runtime::adapter::{Adapter, Joined, Living};
use rc_runtime::lifecycle::Hook;
use rc_runtime::machine::{Hooks, Machine, MachineEvents, Parts};
use rc_runtime::{
    Body, CallEnd, Collect, Collected, Core, Member, ParamChange, Ports, StartError, Values,
    WorkerError,
};
use rc_values::Struct;
use std::os::fd::{AsRawFd, BorrowedFd};
use std::sync::Arc;
use std::time::Duration;

/// A running worker with its context.
pub(crate) struct Component {
    program: Arc<Program>,
    schema: Option<Parameters>,
    running: Running,
    kept: KeptCounts,
    /// The memory for the next request or sample that has to be copied.
    room: Vec<u8>,
}

/// The worker in C++ with its session.
struct Running {
    /// Not here while a function of the worker runs: it is the session of the thread.
    session: Option<Box<Session>>,
    guest: Guest,
}

/// Makes a session that of the thread while a function of the worker runs. A panic gives it back,
/// too: the runtime reads the machine for its message.
pub(crate) struct Entered<'s>(&'s mut Option<Box<Session>>);

impl<'s> Entered<'s> {
    pub(crate) fn new(session: &'s mut Option<Box<Session>>) -> Self {
        // Samples whose last view ended on another thread since the last function.
        drop_abandoned();
        session::swap(session);
        Self(session)
    }
}

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        session::swap(self.0);
    }
}

impl Component {
    /// Opens the connections, makes the worker, and initializes it.
    pub(crate) fn start(
        program: Arc<Program>,
        guest: Guest,
        core: Core,
        ports: &Ports,
        values: &Values,
    ) -> Result<Adapter<Self>, StartError> {
        let is_managed = program.description.managed;
        let session = open(&program, core, ports)?;
        let body = parameters::encode(schema(&program).as_ref(), values);
        let component = Self::initialize(program, guest, session, &body);
        let component = component.map_err(|failed| failed.0)?;
        Adapter::new(component, is_managed, ports)
    }

    /// Makes the worker with encoded values of its parameters, and initializes it.
    ///
    /// # Errors
    /// That of the worker, with the session that it used.
    pub(crate) fn initialize(
        program: Arc<Program>,
        guest: Guest,
        session: Box<Session>,
        parameters: &[u8],
    ) -> Result<Self, (WorkerError, Option<Box<Session>>)> {
        let mut component = Self {
            schema: schema(&program),
            running: Running {
                session: Some(session),
                guest,
            },
            kept: KeptCounts::default(),
            program,
            room: Vec::new(),
        };
        let made = component.run(&Call {
            body: parameters,
            ..Call::of(Function::Initialize)
        });
        match made.outcome() {
            Some(Err(error)) => Err((error, component.end())),
            _ => Ok(component),
        }
    }

    /// Ends the worker. Returns its session.
    pub(crate) fn end(mut self) -> Option<Box<Session>> {
        self.run(&Call::of(Function::End));
        drop_abandoned();
        self.running.session.take()
    }

    /// Its session, between two functions of the worker.
    pub(crate) fn session(&mut self) -> &mut Option<Box<Session>> {
        &mut self.running.session
    }

    /// Runs a function of the worker.
    fn run(&mut self, call: &Call<'_>) -> Answer {
        self.running.run(call)
    }

    /// Runs a function that takes nothing.
    fn call(&mut self, function: Function) -> Result<(), WorkerError> {
        self.run(&Call::of(function)).outcome().unwrap_or(Ok(()))
    }

    /// Runs a function in a state that an emergency does not change. Only a fatal error ends the
    /// component.
    fn quietly(&mut self, function: Function, name: &str) {
        match self.call(function) {
            Ok(()) => {}
            Err(WorkerError::Fatal(reason)) => {
                Hooks::core(self).fail(&format!("{name}(): {reason}"));
            }
            Err(error) => rc_runtime::tracing::error!("{name}(): {error}"),
        }
    }
}

impl Running {
    /// Runs a function of the worker.
    fn run(&mut self, call: &Call<'_>) -> Answer {
        let _entered = Entered::new(&mut self.session);
        (self.guest)(call)
    }

    fn core(&mut self) -> &mut Core {
        let core = self.session.as_mut().and_then(|of| of.core.as_mut());
        core.expect("the core is away only while a function of the worker runs")
    }

    /// Runs the handler of a request or a sample.
    fn handle(
        &mut self,
        numbers: (usize, usize),
        member: Option<&Member>,
        operation: &Operation,
        body: &[u8],
    ) -> Result<Answer, HandlerError> {
        let call = Call {
            body,
            has_reply: operation.wire.two_way,
            ..Call::of_slot(Function::Handle, numbers, member)
        };
        self.handled(&operation.handler, &call)
    }

    /// Runs the handler of a sample in place. The worker drops the image, unless it keeps it.
    fn view(
        &mut self,
        numbers: (usize, usize),
        member: Option<&Member>,
        operation: &Operation,
        image: Image,
    ) -> Result<(), HandlerError> {
        let (held, memory) = handles::hold_image(&operation.request, image).map_err(undecodable)?;
        let call = Call {
            image: Some(memory),
            held,
            ..Call::of_slot(Function::Handle, numbers, member)
        };
        self.handled(&operation.handler, &call).map(drop)
    }

    /// Runs a handler. `name` is its name in messages.
    fn handled(&mut self, name: &str, call: &Call<'_>) -> Result<Answer, HandlerError> {
        let answer = self.run(call);
        let failed = |reason: &str| HandlerError(format!("{name}(): {reason}"));
        match answer.outcome() {
            Some(Ok(())) => Ok(answer),
            None => Err(failed("the worker has no such function")),
            Some(Err(error)) => {
                if let WorkerError::Fatal(reason) = &error {
                    self.core().fail(reason);
                }
                Err(failed(&error.to_string()))
            }
        }
    }
}

/// Opens the session of a component, with its core and its machine.
///
/// # Errors
/// A connection cannot be opened.
pub(crate) fn open(
    program: &Arc<Program>,
    core: Core,
    ports: &Ports,
) -> Result<Box<Session>, StartError> {
    let mut session = Session::open(program, ports)?;
    session.core = Some(core);
    let machine = program.machine;
    session.machine = machine.map(|of| Machine::new(&of.chart, of.external.as_slice()));
    Ok(session)
}

fn schema(program: &Program) -> Option<Parameters> {
    let json = program.description.parameters?;
    Parameters::from_json(json).ok()
}

/// The memory for the next body, unless it is large.
fn reusable(room: Vec<u8>) -> Vec<u8> {
    const MOST: usize = 64 * 1024;
    if room.capacity() > MOST {
        Vec::new()
    } else {
        room
    }
}

fn failed(operation: &Operation, reason: &str) -> HandlerError {
    HandlerError(format!("{}(): {reason}", operation.handler))
}

/// The reply in the answer of a handler: its case, and its type.
pub(crate) fn reply<'o>(
    operation: &'o Operation,
    answer: &Answer,
) -> Result<(i32, &'o Struct), &'static str> {
    if answer.status != EXCEPTION {
        return Ok((0, &operation.reply));
    }
    let mut throws = operation.throws.iter();
    let thrown = throws.find(|thrown| i64::from(thrown.id) == answer.number);
    let thrown = thrown.ok_or("it threw an exception that its operation does not declare")?;
    Ok((thrown.id, &thrown.ty))
}

impl Drop for Component {
    fn drop(&mut self) {
        // Before the ports of the runtime, which must outlive both.
        self.run(&Call::of(Function::End));
        drop_abandoned();
        self.running.session = None;
    }
}

impl Living for Component {
    fn machine(&mut self) -> Option<&mut Parts> {
        let session = self.running.session.as_mut()?;
        session.machine.as_mut().map(Machine::parts)
    }

    fn machine_events(&self) -> MachineEvents {
        let Some(machine) = self.program.machine else {
            return MachineEvents::NONE;
        };
        MachineEvents {
            first: machine.first_event,
            period: machine.period_state.zip(machine.period_event),
        }
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.call(Function::Compute)
    }

    fn hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        let call = match &hook {
            Hook::Transition(transition) => Call {
                name: transition.word(),
                ..Call::of(Function::Transition)
            },
            Hook::Error(transition, reason) => Call {
                name: transition.word(),
                body: reason.as_bytes(),
                ..Call::of(Function::Error)
            },
        };
        self.run(&call).outcome().unwrap_or(Ok(()))
    }
}

impl Joined for Component {
    fn set_parameters(&mut self, values: &Values) {
        let body = parameters::encode(self.schema.as_ref(), values);
        let set = self.run(&Call {
            body: &body,
            ..Call::of(Function::SetParameters)
        });
        if let Some(Err(error)) = set.outcome() {
            rc_runtime::tracing::error!("the parameters cannot be set: {error}");
        }
    }

    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        let body = parameters::changes(changes);
        let call = Call {
            body: &body,
            ..Call::of(Function::ParametersChanged)
        };
        self.run(&call).outcome().unwrap_or(Ok(()))
    }

    fn emergency(&mut self) {
        self.quietly(Function::Emergency, "emergency");
    }

    fn restore(&mut self) {
        self.quietly(Function::Restore, "restore");
    }

    fn finalize(&mut self) {
        self.quietly(Function::Finalize, "finalize");
    }

    fn has_window(&self) -> bool {
        self.program.window
    }

    fn wait_in_window(
        &mut self,
        events: BorrowedFd<'_>,
        limit: Duration,
    ) -> Result<(), WorkerError> {
        let descriptor = usize::try_from(events.as_raw_fd()).unwrap_or_default();
        let limit = usize::try_from(limit.as_nanos()).unwrap_or(usize::MAX);
        let waited = self.run(&Call {
            numbers: (descriptor, limit),
            ..Call::of(Function::Wait)
        });
        waited.outcome().unwrap_or(Ok(()))
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        if let Some(session) = &self.running.session {
            session.count_peers(peers);
        }
    }

    fn availability(&mut self, slot: usize) -> Option<(&Parts, &[u16])> {
        let states = self.program.slots.get(slot)?.available.as_deref()?;
        let machine = self.running.session.as_mut()?.machine.as_mut()?.parts();
        (!states.is_empty()).then_some((&*machine, states))
    }

    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let operations = self
            .program
            .slots
            .get(slot)
            .map_or(&[][..], |slot| &slot.operations);
        let mut operations = operations.iter().enumerate();
        let found = operations.find(|(_, operation)| operation.wire.id == request.operation);
        let Some((number, operation)) = found else {
            return request.unknown();
        };
        let mut room = std::mem::take(&mut self.room);
        let body = request.arguments(&operation.wire, |reader| {
            bodies::read(&operation.request, reader, &mut room)
        })?;
        let handled = self.running.handle((slot, number), member, operation, body);
        self.room = reusable(room);
        let answer = match handled {
            Ok(answer) => answer,
            Err(error) => return request.fail(&error.0),
        };
        if !operation.wire.two_way {
            return Ok(());
        }
        match reply(operation, &answer) {
            Ok((case, ty)) => request.reply_with(case, |writer| {
                bodies::write(ty, &answer.bytes, &operation.handler, writer);
            }),
            Err(reason) => request.fail(&failed(operation, reason).0),
        }
    }

    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: rc_runtime::Sample<'_>,
    ) -> Result<(), HandlerError> {
        let described = self.program.operation(slot, operation);
        let described =
            described.ok_or_else(|| HandlerError("the slot has no such topic".to_owned()))?;
        let numbers = (slot, operation);
        if !described.in_place {
            let mut room = std::mem::take(&mut self.room);
            let body = bodies::read(&described.request, &mut sample.reader(), &mut room)?;
            let handled = self.running.handle(numbers, member, described, body);
            self.room = reusable(room);
            return handled.map(drop);
        }
        let image = match sample.body {
            Body::Kept(kept) => {
                let count = self.kept.of(member.map_or(slot, Member::slot), operation);
                Image::keep(described, count, sample.encoding, kept)?
            }
            Body::Borrowed(_) | Body::Value(_) => Image::read(described, &mut sample.reader())?,
        };
        self.running.view(numbers, member, described, image)
    }

    fn keeps(&self, slot: usize, operation: usize) -> bool {
        let operation = self.program.operation(slot, operation);
        operation.is_some_and(|operation| operation.in_place)
    }

    fn starts_calls(&self, slot: usize) -> bool {
        let slot = self.program.slots.get(slot);
        slot.is_some_and(|slot| slot.asynchronous)
    }

    fn end_call(&mut self, slot: usize, member: Option<&Member>) -> Option<CallEnd> {
        let program = Arc::clone(&self.program);
        let operations = &program.slots.get(slot)?.operations;
        let client = self.client(slot, member)?;
        let (how, id, ended) = client.poll_with(|ended| {
            let (how, id) = (CallEnd::of(&ended), ended.id);
            let mut known = operations.iter().enumerate();
            let found = known.find(|(_, operation)| operation.wire.id == ended.operation);
            let ended = found
                .map(|(number, operation)| (number, of_ended(bodies::ended(operation, ended))));
            (how, id, ended)
        })?;
        // A call that was dropped does not end.
        let (Some(held), Some((number, answer))) = (handles::of_call(id), ended) else {
            return Some(how);
        };
        let handled = self.run(&Call {
            body: &answer.bytes,
            held,
            ended: (answer.status, answer.number),
            ..Call::of_slot(Function::Ended, (slot, number), member)
        });
        match handled.outcome() {
            None => {
                if let Some(client) = self.client(slot, member) {
                    client.leave(id, Ok::<_, CallError>(answer));
                }
            }
            Some(Ok(())) => {}
            Some(Err(WorkerError::Fatal(reason))) => Hooks::core(self).fail(&reason),
            Some(Err(error)) => {
                let name = &operations[number].name;
                rc_runtime::tracing::error!("the end of {name}(): {error}");
            }
        }
        Some(how)
    }

    fn end_in_order(&mut self, slot: usize, member: Option<&Member>, keeps: bool) {
        if let Some(client) = self.client(slot, member) {
            client.end_in_order(keeps);
        }
    }

    fn awaiting(&mut self, slot: usize, member: Option<&Member>) -> Option<Awaiting<'_>> {
        self.client(slot, member)?.awaiting()
    }

    fn collects(&self) -> &'static [Collect] {
        self.program.collects
    }

    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        let program = &*self.program;
        let collect = program.collects.get(number);
        let collect =
            collect.ok_or_else(|| HandlerError("there is no such collection".to_owned()))?;
        let mut writer = Writer::default();
        for ((slot, operation), sample) in std::iter::zip(collect.topics, samples) {
            let Some(operation) = program.operation(*slot, *operation) else {
                continue;
            };
            let fresh = bodies::collected(operation, sample)?;
            writer.put(&age(fresh.freshness));
            writer.put(&fresh.value);
        }
        let body = writer
            .finish()
            .map_err(|error| HandlerError(error.to_string()))?;
        let call = Call {
            body,
            ..Call::of_slot(Function::Collected, (number, 0), None)
        };
        self.running.handled(collect.name, &call).map(drop)
    }
}

impl Hooks for Component {
    fn parts(&mut self) -> &mut Parts {
        let session = self.running.session.as_mut();
        let machine = session.and_then(|of| of.machine.as_mut());
        machine
            .expect(
                "a step runs only where there is a machine, which is here between two functions",
            )
            .parts()
    }

    fn core(&mut self) -> &mut Core {
        self.running.core()
    }

    fn guard(&mut self, guard: u16) -> bool {
        let answer = self.run(&Call::numbered(Function::Guard, guard));
        let Some(Err(error)) = answer.outcome() else {
            return answer.status == DONE && answer.number != 0;
        };
        let names = self.program.machine.map(|machine| &machine.guards);
        let name = names.and_then(|names| names.get(usize::from(guard)));
        let name = name.map_or("", String::as_str);
        rc_runtime::tracing::error!("the guard {name}() counts as false: {error}");
        if let WorkerError::Fatal(reason) = error {
            Hooks::core(self).fail(&reason);
        }
        false
    }

    fn action(&mut self, action: u16) -> Result<(), WorkerError> {
        self.of_machine(Function::Action, action).unwrap_or(Ok(()))
    }

    fn entry(&mut self, state: u16) -> Result<(), WorkerError> {
        self.of_machine(Function::Entry, state).unwrap_or(Ok(()))
    }

    fn exit(&mut self, state: u16) -> Result<(), WorkerError> {
        self.of_machine(Function::Exit, state).unwrap_or(Ok(()))
    }

    fn during(&mut self, state: u16) -> Result<(), WorkerError> {
        self.of_machine(Function::During, state).unwrap_or_else(|| {
            let session = self.running.session.as_mut();
            if let Some(machine) = session.and_then(|of| of.machine.as_mut()) {
                machine.no_during();
            }
            Ok(())
        })
    }
}

impl Component {
    /// The client of an asynchronous slot, or of the member of an array of them.
    fn client(&mut self, slot: usize, member: Option<&Member>) -> Option<&mut TypedClient> {
        let number = member.map_or(slot, Member::slot);
        self.running.session.as_mut()?.client(number).ok()
    }

    /// `None` if the worker does not have the function.
    fn of_machine(&mut self, function: Function, number: u16) -> Option<Result<(), WorkerError>> {
        self.run(&Call::numbered(function, number)).outcome()
    }
}
