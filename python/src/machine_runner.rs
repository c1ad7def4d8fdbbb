//! The state machine of a worker under test: the interpreter of the runtime without a process.
//! Exceptions of the worker's functions end a step and reach the test.

use crate::worker::Worker;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rc_host::{Machine, Program};
use rc_machine::{Failed, Host, Interpreter, Session};
use std::cell::RefCell;
use std::time::Duration;

/// The most events that one call handles, as a turn of the event loop.
const EVENTS_A_TURN: usize = 64;

/// The machine of one worker.
#[pyclass(unsendable, module = "robocomp._native")]
pub(crate) struct MachineRunner {
    machine: &'static Machine,
    worker: Worker,
    context: Py<PyAny>,
    /// Absent while the interpreter uses it; functions of the worker find it here.
    session: RefCell<Option<Session>>,
    /// Absent while a step runs.
    interpreter: RefCell<Option<Interpreter>>,
}

#[pymethods]
impl MachineRunner {
    #[new]
    fn new(description: &str, worker: &Bound<'_, PyAny>, context: Py<PyAny>) -> PyResult<Self> {
        let program = Program::read(description).map_err(PyValueError::new_err)?;
        let machine = program
            .machine
            .ok_or_else(|| PyValueError::new_err("the component has no state machine"))?;
        Ok(Self {
            machine,
            worker: Worker::new(&program, worker)?,
            context,
            session: RefCell::new(Some(Session::new(&machine.chart))),
            interpreter: RefCell::new(Some(Interpreter::new(&machine.chart))),
        })
    }

    /// Enters the initial states.
    fn start(&self, py: Python<'_>) -> PyResult<()> {
        self.step(py, |interpreter, host| interpreter.start(host))?;
        match self.machine.first_event {
            Some(event) => self.fire(event),
            None => Ok(()),
        }
    }

    /// Handles the events that wait.
    fn react(&self, py: Python<'_>) -> PyResult<()> {
        self.step(py, handle_events)
    }

    /// Runs the `during` of the active states, parents first. Returns whether no state has one.
    fn during(&self, py: Python<'_>) -> PyResult<bool> {
        let mut none = true;
        let mut next = self.with(|session| session.next_active(1))?;
        while let Some(state) = next {
            let name = self.state_function("during", state);
            if let Some(name) = name.filter(|name| self.worker.has(name)) {
                none = false;
                self.worker.call(py, &name, (self.context.bind(py),))?;
            }
            next = self.with(|session| session.next_active(state + 1))?;
        }
        Ok(none)
    }

    /// Ends a period: fires the event of the period, handles the events that wait, and takes the
    /// transitions without events.
    fn rest(&self, py: Python<'_>) -> PyResult<()> {
        if let (Some(state), Some(event)) = (self.machine.period_state, self.machine.period_event)
            && self.is_in(state)?
        {
            self.fire(event)?;
        }
        self.step(py, |interpreter, host| {
            handle_events(interpreter, host)?;
            interpreter.rest(host)
        })
    }

    /// Puts an event into the queue.
    fn fire(&self, event: u16) -> PyResult<()> {
        if usize::from(event) >= self.machine.chart.events.len() {
            return Err(PyValueError::new_err(format!("there is no event {event}")));
        }
        // The runtime drops an event after the end of the machine, with a warning.
        self.with(|session| session.fire(event).unwrap_or(()))
    }

    fn is_in(&self, state: u16) -> PyResult<bool> {
        self.with(|session| session.is_in(state))
    }

    /// The active states without substates, with the names of their ancestors.
    fn active(&self) -> PyResult<Vec<String>> {
        let chart = &self.machine.chart;
        self.with(|session| {
            let states = session.active().map(|state| chart.state(state));
            let innermost = states.filter(|state| state.kind.is_atomic());
            innermost.map(|state| state.path.to_string()).collect()
        })
    }

    #[getter]
    fn has_started(&self) -> PyResult<bool> {
        self.with(|session| session.active().next().is_some() || session.has_ended())
    }

    #[getter]
    fn has_ended(&self) -> PyResult<bool> {
        self.with(|session| session.has_ended())
    }
}

impl MachineRunner {
    fn with<T>(&self, use_it: impl FnOnce(&mut Session) -> T) -> PyResult<T> {
        let mut session = self.session.borrow_mut();
        let session = session.as_mut();
        let session = session.ok_or_else(|| PyRuntimeError::new_err("the machine takes a step"))?;
        Ok(use_it(session))
    }

    fn step(
        &self,
        py: Python<'_>,
        run: impl FnOnce(&mut Interpreter, &mut Steps<'_>) -> Result<(), rc_machine::Error>,
    ) -> PyResult<()> {
        let again = || PyRuntimeError::new_err("a function of the worker cannot step its machine");
        let mut interpreter = self.interpreter.take().ok_or_else(again)?;
        let mut host = Steps {
            session: self.session.take(),
            unused: Session::new(&self.machine.chart),
            runner: self,
            py,
            failure: None,
        };
        let result = run(&mut interpreter, &mut host);
        let failure = host.failure.take();
        let session = host.session.take();
        self.session.replace(session);
        self.interpreter.replace(Some(interpreter));
        if let Some(failure) = failure {
            return Err(failure);
        }
        result.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        self.end(py)
    }

    /// Ends the component where the machine has reached its end state, as its process does.
    fn end(&self, py: Python<'_>) -> PyResult<()> {
        let end = self.with(|session| session.end_state().filter(|_| session.has_ended()))?;
        if let Some(end) = end {
            let name = &self.machine.chart.state(end).path;
            let reason = format!("the state machine has reached its end state `{name}`");
            self.context.call_method1(py, "stop", (reason,))?;
        }
        Ok(())
    }

    fn state_function(&self, prefix: &str, state: u16) -> Option<String> {
        let suffix = self.machine.states.get(usize::from(state))?;
        (!suffix.is_empty()).then(|| format!("{prefix}_{suffix}"))
    }
}

fn handle_events(
    interpreter: &mut Interpreter,
    host: &mut Steps<'_>,
) -> Result<(), rc_machine::Error> {
    for _ in 0..EVENTS_A_TURN {
        if interpreter.step(host)?.is_none() {
            break;
        }
    }
    Ok(())
}

/// The host of the interpreter during one step.
struct Steps<'a> {
    /// Here, but for the time of a function of the worker.
    session: Option<Session>,
    /// In place of the other one, which is never away while the interpreter runs.
    unused: Session,
    runner: &'a MachineRunner,
    py: Python<'a>,
    /// The first exception of the worker.
    failure: Option<PyErr>,
}

impl Steps<'_> {
    /// Calls a function of the worker, which may fire events.
    fn call_worker(&mut self, name: &str) -> Result<Option<Py<PyAny>>, Failed> {
        if !self.runner.worker.has(name) {
            return Ok(None);
        }
        self.runner.session.replace(self.session.take());
        let context = (self.runner.context.bind(self.py),);
        let called = self.runner.worker.call(self.py, name, context);
        self.session = self.runner.session.take();
        called.map(Some).map_err(|error| {
            self.failure.get_or_insert(error);
            Failed
        })
    }

    fn state(&mut self, prefix: &str, state: u16) -> Result<(), Failed> {
        match self.runner.state_function(prefix, state) {
            Some(name) => self.call_worker(&name).map(drop),
            None => Ok(()),
        }
    }
}

impl Host for Steps<'_> {
    fn session(&mut self) -> &mut Session {
        self.session.as_mut().unwrap_or(&mut self.unused)
    }

    fn now(&mut self) -> Duration {
        let now = self.runner.context.call_method0(self.py, "now_ns");
        let now = now.and_then(|now| now.extract(self.py));
        match now {
            Ok(now) => Duration::from_nanos(now),
            Err(error) => {
                self.failure.get_or_insert(error);
                Duration::ZERO
            }
        }
    }

    fn guard(&mut self, guard: u16) -> bool {
        let name = self.runner.machine.guards.get(usize::from(guard));
        let result = name.map(|name| self.call_worker(name));
        match result {
            Some(Ok(Some(value))) => value.bind(self.py).is_truthy().unwrap_or_else(|error| {
                self.failure.get_or_insert(error);
                false
            }),
            _ => false,
        }
    }

    fn call(&mut self, function: u16) -> Result<(), Failed> {
        match self.runner.machine.actions.get(usize::from(function)) {
            Some(name) => self.call_worker(name).map(drop),
            None => Ok(()),
        }
    }

    fn enter(&mut self, state: u16) -> Result<(), Failed> {
        self.state("entry", state)
    }

    fn exit(&mut self, state: u16) -> Result<(), Failed> {
        self.state("exit", state)
    }

    /// A test has no log.
    fn log(&mut self, _label: &str, _text: &str) {}
}
