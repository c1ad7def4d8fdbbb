//! The class `Link`, which the generated clients, publishers and contexts call.

use crate::errors;
use crate::freshness;
use crate::from_python::ConversionError;
use crate::member::Member;
use crate::memory::Memory;
use crate::parameters;
use crate::parked::{Here, take_failure};
use crate::session;
use crate::types::Types;
use crate::view::{Loan, View};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use rc_host::link::{self, Answer, Reading};
use rc_host::{HostError, Number, Operation, Program, Session};
use rc_runtime::machine::Machine;
use rc_runtime::{Core, Order, Places, Time, TimeSource, WorldStatus};
use rc_values::{Named, Type, Value};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The joint of a component with its runtime. It works on the thread of the worker.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Link {
    program: Arc<Program>,
    types: Arc<Types>,
    /// The number of the bench of a test, in place of a process.
    bench: Option<u64>,
}

/// The longest time for which a worker waits for a change.
const LONGEST_WAIT: Duration = Duration::from_hours(1);

/// A function of Python that knows where frames are.
struct Known(Py<PyAny>);

impl Places for Known {
    fn transform(&self, to: &str, from: &str, nanoseconds: u64) -> Result<[f64; 12], String> {
        Python::attach(|py| {
            let numbers = self.0.call1(py, (to, from, nanoseconds))?;
            numbers.extract::<[f64; 12]>(py)
        })
        .map_err(|error: PyErr| Python::attach(|py| error.value(py).to_string()))
    }
}

/// The state of the replica of a world, in the order of [`WorldStatus`].
type WorldTold = (
    u64,
    u64,
    u64,
    Vec<String>,
    Option<String>,
    u64,
    String,
    Vec<String>,
    u64,
);

impl Link {
    pub(crate) fn new(program: Arc<Program>, types: Arc<Types>) -> Self {
        Self {
            program,
            types,
            bench: None,
        }
    }

    /// The link of a component under test.
    pub(crate) fn of_bench(program: Arc<Program>, types: Arc<Types>, bench: u64) -> Self {
        Self {
            program,
            types,
            bench: Some(bench),
        }
    }

    fn with<T>(&self, use_it: impl FnOnce(&mut Session) -> Result<T, HostError>) -> PyResult<T> {
        let _here = Here::enter(self.bench);
        session::with(use_it)
    }

    fn with_core<T>(&self, use_it: impl FnOnce(&mut Core) -> T) -> PyResult<T> {
        let _here = Here::enter(self.bench);
        session::with_core(use_it)
    }

    fn with_machine<T>(
        &self,
        use_it: impl FnOnce(&mut Machine<Number, Number>) -> T,
    ) -> PyResult<T> {
        let _here = Here::enter(self.bench);
        session::with_machine(use_it)
    }

    fn with_time<T>(&self, use_it: impl FnOnce(&mut TimeSource) -> T) -> PyResult<T> {
        let _here = Here::enter(self.bench);
        session::with_time(use_it)
    }

    /// Calls, or publishes. Raises what an answer of a test has raised.
    fn act<T: Send, E: Send>(
        &self,
        py: Python<'_>,
        act: impl FnOnce() -> Result<Result<T, E>, HostError> + Send,
    ) -> PyResult<Result<T, E>> {
        let acted = {
            let _here = Here::enter(self.bench);
            py.detach(act)
        };
        match take_failure(self.bench) {
            Some(error) => Err(error),
            None => acted.map_err(errors::of_host),
        }
    }

    fn operation(&self, slot: usize, operation: usize) -> PyResult<&Operation> {
        let _here = Here::enter(self.bench);
        link::operation(&self.program, slot, operation).map_err(errors::of_host)
    }
}

#[allow(
    clippy::unused_self,
    reason = "the methods belong to the object, whatever they need of it"
)]
#[pymethods]
impl Link {
    /// Calls a query and returns its result.
    fn query<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
        arguments: &Bound<'py, PyTuple>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let operation = self.operation(slot, operation)?;
        self.ask(py, slot, operation, arguments, Reading::Value)
    }

    /// Calls a query and returns a view of the image of its result, which is copied as a whole.
    fn query_in_place<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
        arguments: &Bound<'py, PyTuple>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let operation = self.operation(slot, operation)?;
        self.ask(py, slot, operation, arguments, Reading::Image)
    }

    /// Sends a command.
    fn command(
        &self,
        py: Python<'_>,
        slot: usize,
        operation: usize,
        arguments: &Bound<'_, PyTuple>,
    ) -> PyResult<()> {
        let operation = self.operation(slot, operation)?;
        let request = self.request(py, operation, arguments)?;
        let sent = self.act(py, || link::command(slot, operation, &request))?;
        sent.map_err(|error| errors::of_call(py, &error))
    }

    /// Publishes a sample.
    fn publish(
        &self,
        py: Python<'_>,
        slot: usize,
        operation: usize,
        arguments: &Bound<'_, PyTuple>,
    ) -> PyResult<()> {
        let described = self.operation(slot, operation)?;
        let sample = self.types.arguments(&described.request, arguments);
        let sample = sample.map_err(|error| misplaced(py, "InvalidSample", described, &error))?;
        let sent = self.act(py, || link::publish(slot, operation, &sample))?;
        sent.map_err(|error| errors::of_sending(py, &error))
    }

    /// Publishes a sample of a world, which is encoded already.
    fn publish_encoded(
        &self,
        py: Python<'_>,
        slot: usize,
        operation: usize,
        sample: &[u8],
    ) -> PyResult<()> {
        let sent = self.act(py, || link::publish_encoded(slot, operation, sample))?;
        sent.map_err(|error| errors::of_sending(py, &error))
    }

    /// Waits for a sample of the shared world, at most for nanoseconds. Returns the time of the network's
    /// clock, and what came: whether of `WorldStream`, the number of the topic, and the sample. `None` once
    /// nothing more may be awaited.
    fn await_world<'py>(
        &self,
        py: Python<'py>,
        limit: u64,
    ) -> PyResult<Option<(u64, Option<(bool, usize, Bound<'py, PyBytes>)>)>> {
        let until = Instant::now() + Duration::from_nanos(limit).min(LONGEST_WAIT);
        let came = self.act(py, || link::await_world(until).map(Ok::<_, ()>))?;
        let Ok(Some(came)) = came else {
            return Ok(None);
        };
        let sample = came.sample.map(|(interface, topic, bytes)| {
            let bytes = PyBytes::new(py, &bytes);
            (interface > 0, topic, bytes)
        });
        Ok(Some((came.now.as_nanos(), sample)))
    }

    /// A number that no other run of a component has.
    fn unique(&self) -> PyResult<u64> {
        self.with_core(|core| core.unique())
    }

    /// The files of the schema of the network's world, if it has more than that of the component.
    fn world_schema(&self) -> PyResult<Vec<(String, String)>> {
        self.with_core(|core| core.world_schema())
    }

    /// Gives tools the files of the schema of the component's world.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "values from Python are owned"
    )]
    fn set_world_schema(&self, files: Vec<(String, String)>) -> PyResult<()> {
        let files: Vec<(&str, &str)> = files
            .iter()
            .map(|(name, text)| (&**name, &**text))
            .collect();
        self.with_core(|core| core.set_world_schema(&files))
    }

    /// From now on, this function knows where frames are in the world of the component: it gets the
    /// names of both frames, and nanoseconds.
    fn know_frames(&self, function: Py<PyAny>) -> PyResult<()> {
        self.with(|session| {
            session.know_frames(Rc::new(Known(function)));
            Ok(())
        })
    }

    /// Reports the state of the replica of the component's world to the supervisor.
    fn set_world_status(&self, told: WorldTold) -> PyResult<()> {
        let (
            behind,
            behind_ms,
            conflicts,
            first_conflicts,
            fault,
            refused,
            last_refusal,
            silent,
            more_silent,
        ) = told;
        self.with_core(|core| {
            core.world_report().set(WorldStatus {
                behind,
                behind_ms,
                conflicts,
                first_conflicts,
                fault,
                refused,
                last_refusal,
                silent,
                more_silent,
            });
        })
    }

    /// The newest sample of a topic, with its age.
    fn newest<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let described = self.operation(slot, operation)?;
        let newest = {
            let _here = Here::enter(self.bench);
            link::newest(slot, operation, described).map_err(errors::of_host)?
        };
        let newest = newest.map_err(|error| errors::of_call(py, &error))?;
        freshness::object(py, &self.types, newest)
    }

    /// Sets what a query is answered with from now on.
    fn set_latest(
        &self,
        py: Python<'_>,
        slot: usize,
        operation: usize,
        result: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let described = self.operation(slot, operation)?;
        let (ty, has_result) = (&described.reply, described.has_result);
        let reply = self.types.reply(ty, has_result, result);
        let reply = reply.map_err(|error| misplaced(py, "InvalidSample", described, &error))?;
        let set = {
            let _here = Here::enter(self.bench);
            link::set_latest(slot, operation, reply).map_err(errors::of_host)?
        };
        set.map_err(|error| errors::of_sending(py, &error))
    }

    /// The age of the last reply of a slot.
    fn freshness<'py>(&self, py: Python<'py>, slot: usize) -> PyResult<Option<Bound<'py, PyAny>>> {
        let last = {
            let _here = Here::enter(self.bench);
            link::freshness(slot).map_err(errors::of_host)?
        };
        last.map(|last| freshness::age(py, last)).transpose()
    }

    /// Begins a sample that is written in place.
    fn loan<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
    ) -> PyResult<Bound<'py, Loan>> {
        let described = self.operation(slot, operation)?;
        Loan::new(
            py,
            &self.types,
            &described.request,
            (self.bench, slot, operation),
        )
    }

    /// Opens a member of a slot array. Returns it and the number of its slot.
    fn open_member(&self, py: Python<'_>, array: usize, name: &str) -> PyResult<(Member, usize)> {
        let member = self.act(py, || {
            rc_host::session::with(|session| Ok(Ok::<_, ()>(session.open_member(array, name)?)))
        });
        let Ok(member) = member? else {
            return Err(errors::no_such("array", array));
        };
        let slot = member.slot();
        Ok((Member(member), slot))
    }

    /// The members of a slot array that the network lists.
    fn listed(&self, array: usize) -> PyResult<Option<Vec<String>>> {
        self.with(|session| session.listed(array))
    }

    /// The number of servers or of subscribers.
    fn peers(&self, slot: usize) -> PyResult<usize> {
        self.with(|session| Ok(session.peers(slot)))
    }

    /// The longest time of a call, in nanoseconds.
    fn timeout_ns(&self, slot: usize) -> PyResult<u64> {
        self.with(|session| Ok(nanoseconds(session.client(slot)?.timeout())))
    }

    fn set_timeout_ns(&self, slot: usize, timeout: u64) -> PyResult<()> {
        self.with(|session| {
            session
                .client(slot)?
                .set_timeout(Duration::from_nanos(timeout));
            Ok(())
        })
    }

    fn name(&self) -> PyResult<String> {
        self.with_core(|core| core.name().to_owned())
    }

    fn network(&self) -> PyResult<String> {
        self.with_core(|core| core.network().to_owned())
    }

    /// The time of the network's clock, in nanoseconds.
    fn now_ns(&self) -> PyResult<u64> {
        self.with_core(|core| core.now().as_nanos())
    }

    fn period_ns(&self) -> PyResult<u64> {
        self.with_core(|core| nanoseconds(core.period()))
    }

    fn set_period_ns(&self, period: u64) -> PyResult<()> {
        self.with_core(|core| core.set_period(Duration::from_nanos(period)))
    }

    fn set_parameter(&self, path: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let value = parameters::value(value)?;
        self.with_core(|core| core.set_parameter(path, value))
    }

    fn take_requested_parameters<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
        let requested = self.with_core(Core::take_requested_parameters)?.into_iter();
        requested
            .map(|(path, value)| Ok((path, parameters::value_object(py, &value)?)))
            .collect()
    }

    fn state(&self) -> PyResult<&'static str> {
        self.with_core(|core| core.state().word())
    }

    fn lifecycle(&self) -> PyResult<Option<String>> {
        self.with_core(|core| core.lifecycle().map(|state| state.to_string()))
    }

    fn is_stopping(&self) -> PyResult<bool> {
        self.with_core(|core| core.is_stopping())
    }

    fn stop(&self, reason: &str) -> PyResult<()> {
        self.with_core(|core| core.stop(reason))
    }

    /// A seed for the random numbers of the worker, which an exact recording keeps.
    fn seed(&self) -> PyResult<u64> {
        self.with_core(|core| core.random().u64(..))
    }

    /// Whether this run repeats an exact recording.
    fn is_replay(&self) -> PyResult<bool> {
        self.with_core(|core| core.is_replay())
    }

    fn is_time_source(&self) -> PyResult<bool> {
        self.with_time(|time| time.is_active())
    }

    /// Moves the time of the network by nanoseconds. Returns the number of the tick.
    fn advance_time(&self, step: u64) -> PyResult<u64> {
        self.with_time(|time| time.advance(Duration::from_nanos(step)))?
            .map_err(|error| errors::of_time(&error))
    }

    fn set_time(&self, time: u64) -> PyResult<u64> {
        self.with_time(|source| source.set(Time::from_nanos(time)))?
            .map_err(|error| errors::of_time(&error))
    }

    /// Sets how long a tick waits for all followers, in nanoseconds. `None`: for nobody.
    fn wait_for_followers(&self, limit: Option<u64>) -> PyResult<()> {
        self.with_time(|time| match limit {
            Some(limit) => time.wait_for_all(Duration::from_nanos(limit)),
            None => time.wait_for_nobody(),
        })
    }

    fn set_time_order(&self, in_turn: bool) -> PyResult<()> {
        let order = if in_turn {
            Order::InTurn
        } else {
            Order::AtOnce
        };
        self.with_time(|time| time.set_order(order))
    }

    fn set_time_paced(&self, paced: bool) -> PyResult<()> {
        self.with_time(|time| time.set_paced(paced))
    }

    fn tick(&self) -> PyResult<u64> {
        self.with_time(|time| time.tick())
    }

    fn missing_followers(&self) -> PyResult<Vec<String>> {
        self.with_time(|time| time.missing())
    }

    fn followers(&self) -> PyResult<Vec<String>> {
        self.with_time(|time| time.followers())
    }

    fn release_follower(&self, name: &str) -> PyResult<bool> {
        self.with_time(|time| time.release(name))
    }

    fn fire(&self, event: u16) -> PyResult<()> {
        let events = self
            .program
            .machine
            .map_or(0, |machine| machine.chart.fireable);
        if event >= events {
            let message = format!("there is no event {event} that the worker can fire");
            return Err(pyo3::exceptions::PyValueError::new_err(message));
        }
        self.with_machine(|machine| machine.fire(Number(event)))
    }

    fn is_in(&self, state: u16) -> PyResult<bool> {
        let states = self
            .program
            .machine
            .map_or(0, |machine| machine.chart.states.len());
        if usize::from(state) >= states {
            let message = format!("there is no state {state}");
            return Err(pyo3::exceptions::PyValueError::new_err(message));
        }
        self.with_machine(|machine| machine.is_in(Number(state)))
    }

    fn machine_has_started(&self) -> PyResult<bool> {
        self.with_machine(|machine| machine.has_started())
    }

    fn machine_has_ended(&self) -> PyResult<bool> {
        self.with_machine(|machine| machine.has_ended())
    }

    fn active_states(&self) -> PyResult<Vec<&'static str>> {
        self.with_machine(|machine| machine.active())
    }
}

impl Link {
    fn ask<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: &Operation,
        arguments: &Bound<'py, PyTuple>,
        reading: Reading,
    ) -> PyResult<Bound<'py, PyAny>> {
        let request = self.request(py, operation, arguments)?;
        match self.act(py, || link::query(slot, operation, &request, reading))? {
            Ok(Answer::Result(Value::Struct(_, values))) => {
                let (answer, has_result) = (&operation.answer, operation.has_result);
                self.types.answer_object(py, answer, has_result, values)
            }
            Ok(Answer::Result(_)) => Ok(py.None().into_bound(py)),
            Ok(Answer::Image(image)) => self.result_view(py, operation, Memory::owned(image)),
            Ok(Answer::Exception(value)) => Err(PyErr::from_value(self.types.object(py, value)?)),
            Err(error) => Err(errors::of_call(py, &error)),
        }
    }

    fn result_view<'py>(
        &self,
        py: Python<'py>,
        operation: &Operation,
        memory: Memory,
    ) -> PyResult<Bound<'py, PyAny>> {
        let [
            rc_values::Member {
                ty: Type::Named(Named::Struct(ty)),
                ..
            },
        ] = operation.reply.members.as_slice()
        else {
            let message = format!("`{}` has no result that is read in place", operation.name);
            return Err(PyTypeError::new_err(message));
        };
        let memory = Py::new(py, memory)?;
        let view = View::new(memory, Arc::clone(&self.types), Arc::clone(ty), 0);
        Ok(Bound::new(py, view)?.into_any())
    }

    fn request(
        &self,
        py: Python<'_>,
        operation: &Operation,
        arguments: &Bound<'_, PyTuple>,
    ) -> PyResult<Value> {
        let request = self.types.arguments(&operation.request, arguments);
        request.map_err(|error| misplaced(py, "InvalidArgument", operation, &error))
    }
}

/// The exception for an argument that does not fit.
fn misplaced(py: Python<'_>, class: &str, operation: &Operation, error: &ConversionError) -> PyErr {
    errors::raise(py, class, &format!("{}(): {error}", operation.name))
}

pub(crate) fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}
