//! A component under test: its fakes, its clock and its state are those of `rc_runtime::testing`,
//! as of a worker in Rust.

use crate::errors;
use crate::link::Link;
use crate::parked::{BENCHES, Here, NUMBERS, Parked, note};
use crate::types::Types;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rc_host::{Operation, Program, Session, read, undecodable, write};
use rc_middleware::typed::{HandlerError, Request};
use rc_runtime::lifecycle::{Hook, Transition};
use rc_runtime::testing::{self, FakeServer, FakeSubscriber, Fault, Parts, TestBed};
use rc_runtime::{ComponentState, Time, WorkerError};
use rc_values::{Struct, Value};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// The peers, the clock and the state of a component under test.
#[pyclass(unsendable, module = "robocomp._native")]
pub(crate) struct Bench {
    number: u64,
    bed: TestBed,
    program: Arc<Program>,
    types: Arc<Types>,
}

impl Drop for Bench {
    fn drop(&mut self) {
        // Dropped without the borrow, because dropping its content may run Python.
        let parked = BENCHES.with_borrow_mut(|benches| benches.remove(&self.number));
        drop(parked);
    }
}

#[pymethods]
impl Bench {
    #[new]
    fn new(description: &str, types: &Bound<'_, PyDict>) -> PyResult<Self> {
        let program = Program::read(description).map_err(PyValueError::new_err)?;
        let program = Arc::new(program);
        let types = Types::read(&program, types)?;
        let parts = TestBed::parts(program.description);
        let Parts { bed, core, ports } = parts.map_err(|error| errors::of_start(&error))?;
        let opened = Session::open(&program, &ports);
        let mut session = opened.map_err(|error| errors::of_start(&error.into()))?;
        session.core = Some(core);
        let number = NUMBERS.fetch_add(1, Ordering::Relaxed);
        let parked = Parked {
            session: Some(session),
            failure: None,
            loans: HashMap::new(),
        };
        BENCHES.with_borrow_mut(|benches| benches.insert(number, parked));
        Ok(Self {
            number,
            bed,
            program,
            types,
        })
    }

    /// The joint of the worker's context with this bench.
    fn link(&self) -> Link {
        let (program, types) = (Arc::clone(&self.program), Arc::clone(&self.types));
        Link::of_bench(program, types, self.number)
    }

    /// The server of a slot, or of a member of this array.
    fn server(&self, slot: usize, member: Option<&str>) -> PyResult<Server> {
        self.check(slot)?;
        let program = Arc::clone(&self.program);
        let read = move |request: &mut Request<'_>| {
            let mut operations = program.slots[slot].operations.iter().enumerate();
            let found = operations.find(|(_, operation)| operation.wire.id == request.operation);
            let Some((at, operation)) = found else {
                return Err(testing::unknown(request));
            };
            let value = request.arguments(&operation.wire, |reader| {
                read(&operation.request, reader).map_err(undecodable)
            })?;
            Ok((at, value))
        };
        let fake = FakeServer::reading(&self.bed, slot, member, read);
        // An operation without a result needs no answer.
        for operation in &self.program.slots[slot].operations {
            if operation.wire.two_way && operation.reply.members.is_empty() {
                let empty = Value::Struct(Arc::clone(&operation.reply), Vec::new());
                let wire = operation.wire;
                fake.or_default(&operation.wire, move |request| {
                    request.arguments(&wire, |_| Ok(()))?;
                    request.reply_with(0, |writer| write(&empty, writer))
                });
            }
        }
        Ok(Server {
            bench: self.number,
            program: Arc::clone(&self.program),
            types: Arc::clone(&self.types),
            slot,
            fake,
        })
    }

    /// The subscriber of a slot, or of a member of this array.
    fn topic(&self, slot: usize, member: Option<&str>) -> PyResult<Topic> {
        self.check(slot)?;
        let program = Arc::clone(&self.program);
        let read = move |at: usize, reader: &mut rc_middleware::Reader<'_>| {
            let operation = &program.slots[slot].operations[at];
            let value = read(&operation.request, reader).map_err(undecodable)?;
            Ok((at, value))
        };
        let fake = FakeSubscriber::reading(&self.bed, slot, member, read);
        Ok(Topic {
            types: Arc::clone(&self.types),
            fake,
        })
    }

    /// Calls `make` with the name of each member of the array that the worker opens.
    fn prepare_members(&self, slot: usize, make: Py<PyAny>) -> PyResult<()> {
        self.check(slot)?;
        let number = self.number;
        self.bed.prepare_members(slot, move |_, name| {
            Python::attach(|py| {
                if let Err(error) = make.call1(py, (name,)) {
                    note(number, error);
                }
            });
        });
        Ok(())
    }

    /// Lists the members of the slot array with this name. Returns whether there is one.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "a function of Python owns its arguments"
    )]
    fn list_members(&self, array: &str, members: Vec<String>) -> bool {
        let slots = self.program.description.slots;
        let is_there = slots.iter().any(|slot| slot.is_array && slot.name == array);
        if is_there {
            let members: Vec<&str> = members.iter().map(String::as_str).collect();
            self.bed.list_members(array, &members);
        }
        is_there
    }

    /// Ends the opening of members. Raises `StartError` if they are not the listed ones.
    fn complete_members(&self) -> PyResult<()> {
        let completed = self.bed.complete_members();
        completed.map_err(|error| errors::of_start(&error))
    }

    fn set_time(&self, time: u64) {
        self.bed.set_time(Time::from_nanos(time));
    }

    fn advance(&self, step: u64) {
        self.bed.advance(Duration::from_nanos(step));
    }

    /// Sets the state by its word.
    fn set_state(&self, state: &str) -> PyResult<()> {
        let all = [
            ComponentState::Starting,
            ComponentState::Running,
            ComponentState::Emergency,
            ComponentState::Stopping,
        ];
        let found = all.into_iter().find(|known| known.word() == state);
        let found = found.ok_or_else(|| {
            let words = all.map(ComponentState::word).join(", ");
            PyValueError::new_err(format!("there is no state `{state}`; there are {words}"))
        })?;
        self.bed.set_state(found);
        Ok(())
    }

    /// Advances time by a period, or by the rest. Returns the rest then, in nanoseconds.
    fn end_period(&self, left: u64) -> PyResult<u64> {
        let _here = Here::enter(Some(self.number));
        let mut left = Duration::from_nanos(left);
        crate::session::with_core(|core| self.bed.end_period(core, &mut left))?;
        Ok(crate::link::nanoseconds(left))
    }

    /// Takes a transition of the life cycle and returns the state afterwards. `activated` is called
    /// after the function `activate`. An exception that is no `Emergency` is raised.
    fn transition(
        &self,
        py: Python<'_>,
        transition: &str,
        worker: &Bound<'_, PyAny>,
        context: &Bound<'_, PyAny>,
        activated: &Bound<'_, PyAny>,
    ) -> PyResult<String> {
        let known = Transition::ALL.into_iter().find(|t| t.word() == transition);
        let Some(transition) = known else {
            let message = format!("there is no transition `{transition}`");
            return Err(errors::raise(py, "Error", &message));
        };
        let (mut raised, mut began) = (None, false);
        let taken = self.bed.take(transition, |hook| {
            began = true;
            let called = match hook {
                Hook::Transition(transition) => {
                    let called = worker.call_method1(transition.word(), (context,));
                    if transition == Transition::Activate {
                        called.and_then(|_| activated.call0())
                    } else {
                        called
                    }
                }
                Hook::Error(transition, reason) => {
                    worker.call_method1("error", (context, transition.word(), reason))
                }
            };
            called.map(drop).map_err(|error| {
                let of_worker = errors::of_worker(py, &error);
                if !matches!(of_worker, WorkerError::Emergency(_)) && raised.is_none() {
                    raised = Some(error);
                }
                of_worker
            })
        });
        match (taken, raised) {
            (Ok(state), _) => Ok(state.to_string()),
            (Err(_), Some(error)) => Err(error),
            // It is not possible in this state.
            (Err(missed), None) if !began => Err(errors::raise(py, "Error", &missed.to_string())),
            (Err(missed), None) => Ok(missed.state.to_string()),
        }
    }
}

impl Bench {
    fn check(&self, slot: usize) -> PyResult<()> {
        let is_there = slot < self.program.slots.len();
        is_there
            .then_some(())
            .ok_or_else(|| errors::no_such("slot", slot))
    }
}

/// The input of a fake: its operation and its arguments.
type Record = (usize, Value);

fn records<'py>(
    py: Python<'py>,
    types: &Types,
    all: Vec<Record>,
) -> PyResult<Vec<(usize, Bound<'py, PyTuple>)>> {
    let objects = all.into_iter().map(|(at, value)| match value {
        Value::Struct(_, values) => Ok((at, types.parts(py, values)?)),
        _ => Ok((at, PyTuple::empty(py))),
    });
    objects.collect()
}

/// The fake server of a slot.
#[pyclass(unsendable, module = "robocomp._native")]
pub(crate) struct Server {
    bench: u64,
    program: Arc<Program>,
    types: Arc<Types>,
    slot: usize,
    fake: FakeServer<Record>,
}

#[pymethods]
impl Server {
    /// Answers an operation with a value, or with the result of a function.
    fn on(&self, operation: usize, answer: Py<PyAny>) -> PyResult<()> {
        let wire = self.wire(operation)?;
        let (program, types, bench) = (
            Arc::clone(&self.program),
            Arc::clone(&self.types),
            self.bench,
        );
        let (slot, of) = (self.slot, Arc::clone(&self.program));
        let read = move |reader: &mut rc_middleware::Reader<'_>| {
            read(&of.slots[slot].operations[operation].request, reader).map_err(undecodable)
        };
        self.fake.on(wire, move |request| {
            let arguments = request.arguments(wire, &read)?;
            let operation = &program.slots[slot].operations[operation];
            let replied = Python::attach(|py| {
                let values = match arguments {
                    Value::Struct(_, values) => values,
                    _ => Vec::new(),
                };
                let answer = answer.bind(py);
                let called = if answer.is_callable() {
                    let arguments = types.parts(py, values);
                    arguments.and_then(|arguments| answer.call1(arguments))
                } else {
                    Ok(answer.clone())
                };
                reply(py, &types, operation, called)
            });
            finish(bench, operation, request, replied)
        });
        Ok(())
    }

    /// Answers an operation that has no answer yet by the result of a function.
    fn or_default(&self, operation: usize, answer: Py<PyAny>) -> PyResult<()> {
        let wire = self.wire(operation)?;
        let (program, types, bench) = (
            Arc::clone(&self.program),
            Arc::clone(&self.types),
            self.bench,
        );
        let slot = self.slot;
        self.fake.or_default(wire, move |request| {
            let operation = &program.slots[slot].operations[operation];
            request.arguments(wire, |_| Ok(()))?;
            let replied =
                Python::attach(|py| reply(py, &types, operation, answer.bind(py).call0()));
            finish(bench, operation, request, replied)
        });
        Ok(())
    }

    /// The calls, each with the number of its operation.
    fn calls<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyTuple>)>> {
        records(py, &self.types, self.fake.calls())
    }

    /// The calls; forgets them.
    fn take_calls<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyTuple>)>> {
        records(py, &self.types, self.fake.take_calls())
    }

    /// Lets all calls fail, or only the next one.
    fn fail(&self, fault: &str, once: bool) -> PyResult<()> {
        let fault = match fault {
            "no server" => Fault::NoServer,
            "timeout" => Fault::Timeout,
            "server died" => Fault::ServerDied,
            "queue full" => Fault::QueueFull,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "there is no fault `{fault}`"
                )));
            }
        };
        if once {
            self.fake.fail_once(fault);
        } else {
            self.fake.fail(fault);
        }
        Ok(())
    }

    /// Ends the faults.
    fn recover(&self) {
        self.fake.recover();
    }
}

impl Server {
    fn wire(&self, operation: usize) -> PyResult<&'static rc_middleware::typed::Operation> {
        let operations = self.program.description.slots[self.slot].operations;
        let found = operations.get(operation);
        found.ok_or_else(|| errors::no_such("operation", self.slot))
    }
}

/// The case and the structure of a reply.
fn reply(
    py: Python<'_>,
    types: &Types,
    operation: &Operation,
    called: PyResult<Bound<'_, PyAny>>,
) -> PyResult<(i32, Value)> {
    let refused = |reason: String| {
        let message = format!("{}(): {reason}", operation.name);
        errors::raise(py, "InvalidArgument", &message)
    };
    match called {
        Ok(_) if operation.reply.members.is_empty() => Ok((0, empty(&operation.reply))),
        Ok(value) => {
            let replied = types.reply(&operation.reply, operation.has_result, &value);
            Ok((0, replied.map_err(|misfit| refused(misfit.to_string()))?))
        }
        Err(error) => {
            let value = error.value(py).as_any();
            let thrown = operation.throws.iter().find(|thrown| {
                let class = types.class(&thrown.ty.name);
                class.is_ok_and(|class| value.get_type().is(&class.python))
            });
            let Some(thrown) = thrown else {
                return Err(not_declared(py, operation, error));
            };
            let case = types.structure(&thrown.ty, value);
            Ok((
                thrown.id,
                case.map_err(|misfit| refused(misfit.to_string()))?,
            ))
        }
    }
}

/// An exception of another operation is a fault of the test.
fn not_declared(py: Python<'_>, operation: &Operation, error: PyErr) -> PyErr {
    let remote = py.import("robocomp._errors");
    let remote = remote.and_then(|module| module.getattr("RemoteError"));
    let is_remote = remote.and_then(|class| error.value(py).is_instance(&class));
    if !is_remote.unwrap_or(false) {
        return error;
    }
    let class = error.get_type(py).name();
    let class = class.map(|name| name.to_string()).unwrap_or_default();
    let wrong = PyTypeError::new_err(format!("`{}` does not throw {class}", operation.name));
    wrong.set_cause(py, Some(error));
    wrong
}

fn empty(ty: &Arc<Struct>) -> Value {
    Value::Struct(Arc::clone(ty), Vec::new())
}

/// Replies, or keeps the exception for the caller of the worker's function.
fn finish(
    bench: u64,
    operation: &Operation,
    request: &mut Request<'_>,
    replied: PyResult<(i32, Value)>,
) -> Result<(), HandlerError> {
    match replied {
        Ok((case, value)) if operation.wire.two_way => {
            request.reply_with(case, |writer| write(&value, writer))
        }
        Ok(_) => Ok(()),
        Err(error) => {
            note(bench, error);
            request.fail(&"the answer of the test failed")
        }
    }
}

/// The fake subscriber of a slot.
#[pyclass(unsendable, module = "robocomp._native")]
pub(crate) struct Topic {
    types: Arc<Types>,
    fake: FakeSubscriber<Record>,
}

#[pymethods]
impl Topic {
    /// The samples, each with the number of its operation.
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyTuple>)>> {
        records(py, &self.types, self.fake.samples())
    }

    /// The samples; forgets them.
    fn take_samples<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyTuple>)>> {
        records(py, &self.types, self.fake.take_samples())
    }

    /// Lets publishing fail.
    fn fail(&self, reason: &str) {
        self.fake.fail(reason);
    }

    /// Ends the fault.
    fn recover(&self) {
        self.fake.recover();
    }

    /// Sets the number of subscribers that the worker sees.
    fn set_subscribers(&self, count: usize) {
        self.fake.set_subscribers(count);
    }
}
