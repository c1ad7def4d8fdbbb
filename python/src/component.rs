//! A worker in Python as the runtime sees it.

use crate::alive::Alive;
use crate::errors;
use crate::freshness;
use crate::from_python::ConversionError;
use crate::link::Link;
use crate::memory::Memory;
use crate::parameters;
use crate::session::note_failure;
use crate::types::Types;
use crate::view::View;
use crate::worker::Worker;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rc_host::link;
use rc_host::{
    KeptCounts, Number, Operation, Program, Sample, Session, read, session, undecodable, write,
};
use rc_middleware::Fresh;
use rc_middleware::typed::{HandlerError, Request};
use rc_runtime::adapter::{Adapter, Joined, Living};
use rc_runtime::lifecycle::Hook;
use rc_runtime::machine::{Hooks, Machine, MachineEvents, Parts};
use rc_runtime::{
    Body, Collect, Collected, Core, Member, ParamChange, Ports, StartError, Values, WorkerError,
};
use rc_values::{Named, Type, Value};
use std::os::fd::{AsRawFd, BorrowedFd};
use std::sync::Arc;
use std::time::Duration;

/// Component as the generated package hands it over, ready to start.
pub(crate) struct Start {
    pub(crate) program: Arc<Program>,
    pub(crate) types: Arc<Types>,
    /// The class of the context.
    pub(crate) context: Py<PyAny>,
    /// The class of the worker.
    pub(crate) worker: Py<PyAny>,
    pub(crate) alive: Alive,
}

/// A running worker with its context.
pub(crate) struct PythonComponent {
    pub(crate) program: Arc<Program>,
    types: Arc<Types>,
    /// Not here while a function of the worker runs, as `machine`: the session of the thread has
    /// them.
    pub(crate) core: Option<Core>,
    pub(crate) machine: Option<Machine<Number, Number>>,
    pub(crate) context: Py<PyAny>,
    pub(crate) worker: Worker,
    kept: KeptCounts,
    /// The subscribed slots of a world, and whether each is that of streams: the context takes their
    /// samples.
    worlds: Vec<(usize, bool)>,
    _alive: Alive,
}

/// Lends core and machine to the session while a function of the worker runs. A panic gives them
/// back, too: the runtime reads the machine for its message.
struct ContextLoan<'j> {
    component: &'j mut PythonComponent,
    core: Option<Core>,
    machine: Option<Machine<Number, Number>>,
}

impl Drop for ContextLoan<'_> {
    fn drop(&mut self) {
        (self.component.core, self.component.machine) = (self.core.take(), self.machine.take());
    }
}

impl Start {
    /// Opens the connections, makes the context and the worker, and initializes it.
    pub(crate) fn start(
        self,
        core: Core,
        ports: &Ports,
        values: &Values,
    ) -> Result<Adapter<PythonComponent>, StartError> {
        let is_managed = self.program.description.managed;
        Session::open(&self.program, ports)?.begin();
        let machine = self
            .program
            .machine
            .map(|machine| Machine::new(&machine.chart, machine.external.as_slice()));
        let (mut core, mut machine) = (Some(core), machine);
        let made = session::lend(&mut core, &mut machine, || {
            Python::attach(|py| {
                self.make(py, values)
                    .map_err(|error| errors::of_worker(py, &error))
            })
        });
        let (context, worker, worlds) = made.inspect_err(|_| Session::end())?;
        let component = PythonComponent {
            program: self.program,
            types: self.types,
            core,
            machine,
            context,
            worker,
            kept: KeptCounts::default(),
            worlds,
            _alive: self.alive,
        };
        Adapter::new(component, is_managed, ports)
    }

    #[allow(clippy::type_complexity, reason = "the parts of a component")]
    fn make(
        &self,
        py: Python<'_>,
        values: &Values,
    ) -> PyResult<(Py<PyAny>, Worker, Vec<(usize, bool)>)> {
        let link = Link::new(Arc::clone(&self.program), Arc::clone(&self.types));
        let context = self.context.bind(py).call1((link,))?;
        context.call_method1("_set_parameters", (parameters::object(py, values)?,))?;
        let worker = self.worker.bind(py).call0()?;
        let worker = Worker::new(&self.program, &worker)?;
        let context = context.unbind();
        let worlds = context.getattr(py, "_world_slots")?.extract(py)?;
        worker.call(py, "initialize", (context.bind(py),))?;
        if self.program.window {
            let window = worker.object(py);
            window.call_method1("_robocomp_show", (context.bind(py),))?;
        }
        Ok((context, worker, worlds))
    }
}

impl Drop for PythonComponent {
    fn drop(&mut self) {
        // Before the ports of the runtime, which must outlive it.
        Session::end();
    }
}

impl PythonComponent {
    /// Runs Python on behalf of the worker.
    pub(crate) fn run<T>(&mut self, run: impl FnOnce(Python<'_>, &Self) -> T) -> T {
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
        session::lend(core, machine, || Python::attach(|py| run(py, component)))
    }

    /// Calls a function of the worker that takes the context only, if there is one.
    pub(crate) fn call(&mut self, name: &str) -> Result<(), WorkerError> {
        if !self.worker.has(name) {
            return Ok(());
        }
        self.run(|py, component| {
            let result = component
                .worker
                .call(py, name, (component.context.bind(py),));
            result
                .map(drop)
                .map_err(|error| errors::of_worker(py, &error))
        })
    }

    /// Runs a hook in a state that an emergency does not change. Only a fatal error ends the
    /// component.
    fn quiet_hook(&mut self, name: &str) {
        match self.call(name) {
            Ok(()) => {}
            Err(WorkerError::Fatal(reason)) => {
                Hooks::core(self).fail(&format!("{name}(): {reason}"));
            }
            Err(error) => rc_runtime::tracing::error!("{name}(): {error}"),
        }
    }

    /// The arguments with which a handler begins: the context, and the member of a slot array.
    fn first_arguments<'py>(
        &self,
        py: Python<'py>,
        member: Option<&Member>,
    ) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let mut arguments = vec![self.context.bind(py).clone()];
        if let Some(member) = member {
            let member = crate::member::Member(member.clone());
            arguments.push(Bound::new(py, member)?.into_any());
        }
        Ok(arguments)
    }

    /// The arguments of a handler.
    fn arguments<'py>(
        &self,
        py: Python<'py>,
        member: Option<&Member>,
        request: Value,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let mut arguments = self.first_arguments(py, member)?;
        if let Value::Struct(_, values) = request {
            for value in values {
                arguments.push(self.types.object(py, value)?);
            }
        }
        PyTuple::new(py, arguments)
    }

    /// The arguments of the handler of a collection.
    fn collection<'py>(
        &self,
        py: Python<'py>,
        values: Vec<Fresh<Value>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let mut arguments = self.first_arguments(py, None)?;
        for value in values {
            arguments.push(freshness::object(py, &self.types, value)?);
        }
        PyTuple::new(py, arguments)
    }

    /// The arguments of the handler of a sample.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        member: Option<&Member>,
        operation: &Operation,
        sample: Sample,
    ) -> PyResult<Bound<'py, PyTuple>> {
        match (
            sample,
            operation.request.members.first().map(|member| &member.ty),
        ) {
            (Sample::Value(value), _) => self.arguments(py, member, value),
            (Sample::Image(image), Some(Type::Named(Named::Struct(ty)))) => {
                let memory = Py::new(py, Memory::received(image))?;
                let view = View::new(memory, Arc::clone(&self.types), Arc::clone(ty), 0);
                let mut arguments = self.first_arguments(py, member)?;
                arguments.push(Bound::new(py, view)?.into_any());
                PyTuple::new(py, arguments)
            }
            (Sample::Image(_), _) => PyTuple::new(py, self.first_arguments(py, member)?),
        }
    }

    /// Calls a function of the context of a component with a world.
    fn of_world<A>(&mut self, name: &str, arguments: A) -> Result<(), HandlerError>
    where
        A: for<'py> pyo3::call::PyCallArgs<'py>,
    {
        self.run(|py, component| {
            let called = component.context.call_method1(py, name, arguments);
            called.map(drop).map_err(|error| {
                let text = errors::one_line(py, &error);
                note_failure(py, &error);
                HandlerError(text)
            })
        })
    }

    /// Runs the handler of a sample.
    fn handle(
        &mut self,
        member: Option<&Member>,
        operation: &Operation,
        sample: Sample,
    ) -> Result<(), HandlerError> {
        self.run(|py, component| {
            let handled = component
                .sample(py, member, operation, sample)
                .and_then(|arguments| component.worker.handle(py, &operation.handler, arguments));
            handled.map(drop).map_err(|error| {
                let text = errors::one_line(py, &error);
                note_failure(py, &error);
                HandlerError(format!("{}(): {text}", operation.handler))
            })
        })
    }

    /// Runs the handler of a request.
    fn answer(
        &self,
        py: Python<'_>,
        member: Option<&Member>,
        operation: &Operation,
        request: Value,
    ) -> Answer {
        let handled = self
            .arguments(py, member, request)
            .and_then(|arguments| self.worker.handle(py, &operation.handler, arguments));
        let failed = |text: String| Answer::Failed(format!("{}(): {text}", operation.handler));
        match handled {
            Ok(result) if operation.wire.two_way => {
                let (ty, has_result) = (&operation.reply, operation.has_result);
                match self.types.reply(ty, has_result, result.bind(py)) {
                    Ok(value) => Answer::Reply(0, value),
                    Err(error) => failed(wrong_result(operation, &error)),
                }
            }
            Ok(_) => Answer::None,
            Err(error) => match self.thrown(py, operation, &error) {
                Some(Ok((case, value))) => Answer::Reply(case, value),
                Some(Err(error)) => failed(error.to_string()),
                None => {
                    let text = errors::one_line(py, &error);
                    note_failure(py, &error);
                    failed(text)
                }
            },
        }
    }

    /// An exception that the operation declares, as the case of its reply.
    fn thrown(
        &self,
        py: Python<'_>,
        operation: &Operation,
        error: &PyErr,
    ) -> Option<Result<(i32, Value), ConversionError>> {
        let value = error.value(py);
        let thrown = operation.throws.iter().find(|thrown| {
            let class = self.types.class(&thrown.ty.name);
            class.is_ok_and(|class| value.is_instance(class.python.bind(py)).unwrap_or(false))
        })?;
        let value = self.types.structure(&thrown.ty, value.as_any());
        Some(value.map(|value| (thrown.id, value)))
    }
}

/// Error of a result that is not a reply.
fn wrong_result(operation: &Operation, error: &ConversionError) -> String {
    let parts = operation.reply.members.len();
    let what = if parts == 1 {
        "its result"
    } else {
        "the tuple that it returned"
    };
    format!("{what}: {error}")
}

/// Outcome of a request at a handler.
enum Answer {
    /// The case of a reply and its structure.
    Reply(i32, Value),
    Failed(String),
    None,
}

impl Living for PythonComponent {
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
        self.call("compute")
    }

    fn hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        let (transition, reason) = match hook {
            Hook::Transition(transition) => return self.call(transition.word()),
            Hook::Error(transition, reason) => (transition, reason),
        };
        if !self.worker.has("error") {
            return Err(WorkerError::Failed(reason.to_owned()));
        }
        self.run(|py, component| {
            let context = component.context.bind(py);
            let arguments = (context, transition.word(), reason);
            let called = component.worker.call(py, "error", arguments);
            called
                .map(drop)
                .map_err(|error| errors::of_worker(py, &error))
        })
    }
}

impl Joined for PythonComponent {
    fn set_parameters(&mut self, values: &Values) {
        let set = self.run(|py, component| {
            let values = parameters::object(py, values)?;
            component
                .context
                .call_method1(py, "_set_parameters", (values,))
                .map(drop)
        });
        if let Err(error) = set {
            rc_runtime::tracing::error!("the parameters cannot be set: {error}");
        }
    }

    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        self.run(|py, component| {
            let context = component.context.bind(py);
            let refusal = context
                .call_method0("_refusal")
                .and_then(|reason| reason.extract::<Option<String>>());
            match refusal.map_err(|error| errors::of_worker(py, &error))? {
                Some(reason) => return Err(WorkerError::Failed(reason)),
                None if !component.worker.has("params_changed") => return Ok(()),
                None => {}
            }
            let called = parameters::changes(py, changes).and_then(|changes| {
                component
                    .worker
                    .call(py, "params_changed", (context, changes))
            });
            called
                .map(drop)
                .map_err(|error| errors::of_worker(py, &error))
        })
    }

    fn emergency(&mut self) {
        self.quiet_hook("emergency");
    }

    fn restore(&mut self) {
        self.quiet_hook("restore");
    }

    fn finalize(&mut self) {
        self.quiet_hook("finalize");
        if !self.worlds.is_empty()
            && let Err(error) = self.of_world("_leave_world", ())
        {
            rc_runtime::tracing::error!("the world: {error}");
        }
    }

    fn has_turns(&self) -> bool {
        !self.worlds.is_empty()
    }

    fn turn(&mut self) -> bool {
        let did = self.run(|py, component| {
            let worker = component.worker.object(py);
            let called = component.context.call_method1(py, "_turn_world", (worker,));
            called
                .and_then(|did| did.extract::<bool>(py))
                .map_err(|error| {
                    let text = errors::one_line(py, &error);
                    note_failure(py, &error);
                    text
                })
        });
        did.unwrap_or_else(|error| {
            rc_runtime::tracing::error!("the world: {error}");
            true
        })
    }

    fn has_window(&self) -> bool {
        self.program.window
    }

    fn wait_in_window(
        &mut self,
        events: BorrowedFd<'_>,
        limit: Duration,
    ) -> Result<(), WorkerError> {
        let milliseconds = limit.as_nanos().div_ceil(1_000_000);
        self.run(|py, component| {
            let window = component.worker.object(py);
            let arguments = (events.as_raw_fd(), milliseconds);
            let waited = window.call_method1("_robocomp_run", arguments);
            waited
                .map(drop)
                .map_err(|error| errors::of_worker(py, &error))
        })
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
        let operation = operations.iter().find(|o| o.wire.id == request.operation);
        let Some(operation) = operation else {
            return request.unknown();
        };
        let arguments = request.arguments(&operation.wire, |reader| {
            read(&operation.request, reader).map_err(undecodable)
        })?;
        match self.run(|py, component| component.answer(py, member, operation, arguments)) {
            Answer::Reply(case, value) => request.reply_with(case, |writer| write(&value, writer)),
            Answer::Failed(reason) => request.fail(&reason),
            Answer::None => Ok(()),
        }
    }

    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: rc_runtime::Sample<'_>,
    ) -> Result<(), HandlerError> {
        if let Some((_, is_stream)) = self.worlds.iter().find(|(own, _)| *own == slot) {
            let (is_stream, body) = (*is_stream, sample.reader().rest());
            return self.of_world("_receive_world", (is_stream, operation, body));
        }
        let program = Arc::clone(&self.program);
        let described = program.operation(slot, operation);
        let described =
            described.ok_or_else(|| HandlerError("the slot has no such topic".to_owned()))?;
        let sample = match sample.body {
            Body::Kept(kept) => {
                let count = self.kept.of(member.map_or(slot, Member::slot), operation);
                Sample::keep(described, count, sample.encoding, kept)?
            }
            Body::Borrowed(_) | Body::Value(_) => Sample::read(described, &mut sample.reader())?,
        };
        self.handle(member, described, sample)
    }

    fn collects(&self) -> &'static [Collect] {
        self.program.collects
    }

    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        let program = Arc::clone(&self.program);
        let (Some(collect), Some(handler)) =
            (program.collects.get(number), program.collected.get(number))
        else {
            return Err(HandlerError("there is no such collection".to_owned()));
        };
        let topics = std::iter::zip(collect.topics, samples);
        let values = topics.filter_map(|((slot, operation), sample)| {
            let operation = program.operation(*slot, *operation)?;
            Some(link::collected(operation, sample))
        });
        let values: Vec<Fresh<Value>> = values.collect::<Result<_, _>>()?;
        self.run(|py, component| {
            let handled = component
                .collection(py, values)
                .and_then(|arguments| component.worker.handle(py, handler, arguments));
            handled.map(drop).map_err(|error| {
                let text = errors::one_line(py, &error);
                note_failure(py, &error);
                HandlerError(format!("{handler}(): {text}"))
            })
        })
    }

    fn keeps(&self, slot: usize, operation: usize) -> bool {
        let operation = self.program.operation(slot, operation);
        operation.is_some_and(|operation| operation.in_place)
    }
}
