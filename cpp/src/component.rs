//! A worker in C++ as the runtime sees it.

use crate::context::age;
use crate::parameters;
use crate::status::{Answer, DONE, EXCEPTION};
use rc_configuration::Parameters;
use rc_host::link;
use rc_host::{Number, Operation, Program, Session, read, session, undecodable, write};
use rc_middleware::typed::{HandlerError, Request};
use rc_middleware::{Encoding, Writer};
use rc_runtime::adapter::{Adapter, Joined, Living};
use rc_runtime::lifecycle::Hook;
use rc_runtime::machine::{Hooks, Machine, MachineEvents, Parts};
use rc_runtime::{
    Collect, Collected, Core, Member, ParamChange, Ports, StartError, Values, WorkerError,
};
use rc_values::{Struct, Value, decode, encode_body};
use std::sync::Arc;

/// The functions of a worker, `enum rc_function` of `abi.h`.
#[derive(Clone, Copy)]
#[repr(i32)]
pub(crate) enum Function {
    /// Makes the worker, sets its parameters and runs `initialize`.
    Initialize,
    Compute,
    SetParameters,
    ParametersChanged,
    Emergency,
    Restore,
    Finalize,
    Transition,
    Error,
    Entry,
    Exit,
    During,
    Guard,
    Action,
    Handle,
    /// Handles a collection.
    Collected,
    /// Ends the worker.
    End,
}

/// Runs a function of the worker in C++: with two numbers, a name and a body.
pub(crate) type Guest = Box<dyn Fn(Function, (usize, usize), &str, &[u8]) -> Answer>;

/// A running worker with its context.
pub(crate) struct Component {
    program: Arc<Program>,
    schema: Option<Parameters>,
    /// Not here while a function of the worker runs, as `machine`: the session of the thread has
    /// them.
    core: Option<Core>,
    machine: Option<Machine<Number, Number>>,
    guest: Guest,
}

/// Lends core and machine to the session while a function of the worker runs. A panic gives them
/// back, too: the runtime reads the machine for its message.
struct ContextLoan<'j> {
    component: &'j mut Component,
    core: Option<Core>,
    machine: Option<Machine<Number, Number>>,
}

impl Drop for ContextLoan<'_> {
    fn drop(&mut self) {
        (self.component.core, self.component.machine) = (self.core.take(), self.machine.take());
    }
}

/// A call of a function of the worker.
struct Call<'c> {
    function: Function,
    /// Numbers of a slot and an operation, of a state, of a guard or an action.
    numbers: (usize, usize),
    /// The member of a slot array, or the transition of an error.
    name: &'c str,
    body: &'c [u8],
}

impl Call<'static> {
    fn of(function: Function) -> Self {
        Self::numbered(function, 0)
    }

    fn numbered(function: Function, number: u16) -> Self {
        Self {
            function,
            numbers: (number.into(), 0),
            name: "",
            body: &[],
        }
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
        Session::open(&program, ports)?.begin();
        let machine = program.machine;
        let schema = program
            .description
            .parameters
            .and_then(|json| Parameters::from_json(json).ok());
        let mut component = Self {
            schema,
            core: Some(core),
            machine: machine.map(|of| Machine::new(&of.chart, of.external.as_slice())),
            program,
            guest,
        };
        let body = parameters::encode(component.schema.as_ref(), values);
        let made = component.run(&Call {
            body: &body,
            ..Call::of(Function::Initialize)
        });
        // Its drop ends worker and session.
        made.outcome().unwrap_or(Ok(()))?;
        Adapter::new(component, is_managed, ports)
    }

    /// Runs a function of the worker.
    fn run(&mut self, call: &Call<'_>) -> Answer {
        let (core, machine) = (self.core.take(), self.machine.take());
        let mut loan = ContextLoan {
            component: self,
            core,
            machine,
        };
        let ContextLoan {
            component,
            core,
            machine,
        } = &mut loan;
        session::lend(core, machine, || {
            let Call {
                function,
                numbers,
                name,
                body,
            } = *call;
            (component.guest)(function, numbers, name, body)
        })
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

    /// Runs the handler of a request or a sample.
    fn handle(
        &mut self,
        numbers: (usize, usize),
        member: Option<&Member>,
        operation: &Operation,
        request: &Value,
    ) -> Result<Answer, HandlerError> {
        let body = encode_body(request).map_err(undecodable)?;
        let answer = self.run(&Call {
            function: Function::Handle,
            numbers,
            name: member.map_or("", |member| member.name()),
            body: &body,
        });
        match answer.outcome() {
            Some(Ok(())) => Ok(answer),
            None => Err(failed(operation, "the worker has no such function")),
            Some(Err(error)) => {
                if let WorkerError::Fatal(reason) = &error {
                    Hooks::core(self).fail(reason);
                }
                Err(failed(operation, &error.to_string()))
            }
        }
    }
}

fn failed(operation: &Operation, reason: &str) -> HandlerError {
    HandlerError(format!("{}(): {reason}", operation.handler))
}

/// The reply in the answer of a handler: its case, and a structure that fits its type.
fn reply(operation: &Operation, answer: &Answer) -> Result<(i32, Value), String> {
    let read = |ty: &Arc<Struct>| {
        let value = decode(ty, Encoding::Cdr, &answer.bytes);
        value.map_err(|error| error.to_string())
    };
    if answer.status != EXCEPTION {
        return read(&operation.reply).map(|value| (0, value));
    }
    let mut throws = operation.throws.iter();
    let thrown = throws.find(|thrown| i64::from(thrown.id) == answer.number);
    let thrown = thrown.ok_or("it threw an exception that its operation does not declare")?;
    read(&thrown.ty).map(|value| (thrown.id, value))
}

impl Drop for Component {
    fn drop(&mut self) {
        // Before the ports of the runtime, which must outlive both.
        self.run(&Call::of(Function::End));
        Session::end();
    }
}

impl Living for Component {
    fn machine(&mut self) -> Option<&mut Parts> {
        self.machine.as_mut().map(Machine::parts)
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

    fn sending_peers(&self, peers: &mut [usize]) {
        session::count_peers(peers);
    }

    fn availability(&mut self, slot: usize) -> Option<(&Parts, &[u16])> {
        let states = self.program.slots.get(slot)?.available.as_deref()?;
        let machine = self.machine.as_mut()?.parts();
        (!states.is_empty()).then_some((&*machine, states))
    }

    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let program = Arc::clone(&self.program);
        let operations = program
            .slots
            .get(slot)
            .map_or(&[][..], |slot| &slot.operations);
        let mut operations = operations.iter().enumerate();
        let found = operations.find(|(_, operation)| operation.wire.id == request.operation);
        let Some((number, operation)) = found else {
            return request.unknown();
        };
        let arguments = request.arguments(&operation.wire, |reader| {
            read(&operation.request, reader).map_err(undecodable)
        })?;
        let answer = match self.handle((slot, number), member, operation, &arguments) {
            Ok(answer) => answer,
            Err(error) => return request.fail(&error.0),
        };
        if !operation.wire.two_way {
            return Ok(());
        }
        match reply(operation, &answer) {
            Ok((case, value)) => request.reply_with(case, |writer| write(&value, writer)),
            Err(reason) => request.fail(&failed(operation, &reason).0),
        }
    }

    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: rc_runtime::Sample<'_>,
    ) -> Result<(), HandlerError> {
        let program = Arc::clone(&self.program);
        let described = program.operation(slot, operation);
        let described =
            described.ok_or_else(|| HandlerError("the slot has no such topic".to_owned()))?;
        let value = read(&described.request, &mut sample.reader()).map_err(undecodable)?;
        self.handle((slot, operation), member, described, &value)
            .map(drop)
    }

    fn collects(&self) -> &'static [Collect] {
        self.program.collects
    }

    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        let program = Arc::clone(&self.program);
        let collect = program.collects.get(number);
        let collect =
            collect.ok_or_else(|| HandlerError("there is no such collection".to_owned()))?;
        let mut writer = Writer::default();
        for ((slot, operation), sample) in std::iter::zip(collect.topics, samples) {
            let Some(operation) = program.operation(*slot, *operation) else {
                continue;
            };
            let fresh = link::collected(operation, sample)?;
            let body = encode_body(&fresh.value).map_err(undecodable)?;
            writer.put(&age(fresh.freshness));
            writer.put(&body);
        }
        let body = writer
            .finish()
            .map_err(|error| HandlerError(error.to_string()))?;
        let answer = self.run(&Call {
            function: Function::Collected,
            numbers: (number, 0),
            name: "",
            body,
        });
        let failed = |reason: &str| HandlerError(format!("{}(): {reason}", collect.name));
        match answer.outcome() {
            Some(Ok(())) => Ok(()),
            None => Err(failed("the worker has no such function")),
            Some(Err(error)) => {
                if let WorkerError::Fatal(reason) = &error {
                    Hooks::core(self).fail(reason);
                }
                Err(failed(&error.to_string()))
            }
        }
    }
}

impl Hooks for Component {
    fn parts(&mut self) -> &mut Parts {
        self.machine
            .as_mut()
            .expect(
                "a step runs only where there is a machine, which is here between two functions",
            )
            .parts()
    }

    fn core(&mut self) -> &mut Core {
        self.core
            .as_mut()
            .expect("the core is away only while a function of the worker runs")
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
            if let Some(machine) = &mut self.machine {
                machine.no_during();
            }
            Ok(())
        })
    }
}

impl Component {
    /// `None` if the worker does not have the function.
    fn of_machine(&mut self, function: Function, number: u16) -> Option<Result<(), WorkerError>> {
        self.run(&Call::numbered(function, number)).outcome()
    }
}
