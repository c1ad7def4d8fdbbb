//! Bytes of calls and samples without a network, for tests of workers: a fake checks values as the
//! wire does.

use crate::errors;
use crate::from_python::Misfit;
use crate::member::Member;
use crate::memory::Memory;
use crate::types::Types;
use crate::view::{Loan, View};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use rc_host::{Aligned, Operation, Program};
use rc_middleware::Encoding;
use rc_runtime::testing::TestMembers;
use rc_values::{Struct, Type, Value, decode, encode_body, encode_image};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Encodes and decodes the calls and samples of a component.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Codec {
    program: Program,
    types: Arc<Types>,
    /// The members of slot arrays that the worker has opened.
    members: TestMembers,
    /// Counts the loans of each topic.
    loans: Mutex<HashMap<(usize, usize), Arc<()>>>,
}

#[pymethods]
impl Codec {
    #[new]
    fn new(description: &str, types: &Bound<'_, PyDict>) -> PyResult<Self> {
        let program = read(description)?;
        let types = Types::read(&program, types)?;
        let members = TestMembers::new(program.description);
        Ok(Self {
            members: members.map_err(|error| errors::of_start(&error))?,
            program,
            types,
            loans: Mutex::default(),
        })
    }

    /// The arguments of a call, or a sample.
    fn request<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
        arguments: &Bound<'py, PyTuple>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let operation = self.operation(slot, operation)?;
        encoded(
            py,
            operation,
            self.types.arguments(&operation.request, arguments),
        )
    }

    /// The arguments that these bytes hold.
    fn decode_request<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
        bytes: &[u8],
    ) -> PyResult<Bound<'py, PyTuple>> {
        let operation = self.operation(slot, operation)?;
        self.types
            .parts(py, decoded(py, &operation.request, bytes)?)
    }

    /// Encodes the result of a handler.
    fn reply<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
        value: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let operation = self.operation(slot, operation)?;
        let (ty, has_result) = (&operation.reply, operation.has_result);
        encoded(py, operation, self.types.reply(ty, has_result, value))
    }

    /// Decodes the result of a call from these bytes.
    fn decode_reply<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
        bytes: &[u8],
    ) -> PyResult<Bound<'py, PyAny>> {
        let operation = self.operation(slot, operation)?;
        let values = decoded(py, &operation.reply, bytes)?;
        let (answer, has_result) = (&operation.answer, operation.has_result);
        self.types.answer_object(py, answer, has_result, values)
    }

    /// Opens a member of a slot array, as a process does. Returns it and the number of its slot.
    fn open_member(&self, array: usize, name: &str) -> PyResult<(Member, usize)> {
        let opened = self.members.open(array, name);
        let opened = opened.ok_or_else(|| errors::no_such("array", array))?;
        let member = opened.map_err(|error| errors::of_member(&error))?;
        let slot = member.slot();
        Ok((Member(member), slot))
    }

    /// The members of a slot array that are listed.
    fn listed(&self, array: usize) -> Option<Vec<String>> {
        self.members.listed(array)
    }

    /// Lists the members of the slot array with this name. Says whether there is one.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "a function of Python owns its arguments"
    )]
    fn list_members(&self, array: &str, members: Vec<String>) -> bool {
        let members: Vec<&str> = members.iter().map(String::as_str).collect();
        self.members.list(array, &members)
    }

    /// Ends the opening of members. Raises `StartError` if they are not the listed ones.
    fn complete_members(&self) -> PyResult<()> {
        let completed = self.members.complete();
        completed.map_err(|error| errors::of_start(&error))
    }

    /// A view of a copy of this value, as a handler gets it that reads in place.
    fn view<'py>(&self, py: Python<'py>, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, View>> {
        let operations = self.program.slots.iter().flat_map(|slot| &slot.operations);
        let members = operations.flat_map(|o| o.request.members.iter().chain(&o.reply.members));
        let mut all = members.filter_map(|member| match &member.ty {
            Type::Struct(of) if of.layout.is_some() => Some(of),
            _ => None,
        });
        let class = value.get_type();
        let is_of = |of: &&Arc<Struct>| {
            let known = self.types.class(&of.name);
            known.is_ok_and(|known| known.python.bind(py).is(&class))
        };
        let Some(ty) = all.find(is_of) else {
            let message = format!("{class} is no type that this component has in place");
            return Err(PyTypeError::new_err(message));
        };
        let refused = |reason: String| errors::raise(py, "InvalidArgument", &reason);
        let value = self.types.structure(ty, value);
        let value = value.map_err(|misfit| refused(misfit.to_string()))?;
        let image = encode_image(&value).map_err(|error| refused(error.to_string()))?;
        let memory = Py::new(py, Memory::owned(Aligned::copied(&image)))?;
        let view = View::new(memory, Arc::clone(&self.types), Arc::clone(ty), 0);
        Bound::new(py, view)
    }

    /// A sample of a topic that is written in place. `send` gets the tuple of its arguments.
    fn loan<'py>(
        &self,
        py: Python<'py>,
        slot: usize,
        operation: usize,
        send: Py<PyAny>,
    ) -> PyResult<Bound<'py, Loan>> {
        let request = &self.operation(slot, operation)?.request;
        let count = {
            let mut loans = self.loans.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(loans.entry((slot, operation)).or_default())
        };
        Loan::of_test(py, &self.types, request, &count, send)
    }
}

impl Codec {
    fn operation(&self, slot: usize, operation: usize) -> PyResult<&Operation> {
        let described = self.members.described(slot);
        let found = described.and_then(|slot| self.program.operation(slot, operation));
        found.ok_or_else(|| errors::no_such("operation", slot))
    }
}

fn read(description: &str) -> PyResult<Program> {
    Program::read(description).map_err(pyo3::exceptions::PyValueError::new_err)
}

fn encoded<'py>(
    py: Python<'py>,
    operation: &Operation,
    value: Result<Value, Misfit>,
) -> PyResult<Bound<'py, PyBytes>> {
    let refused = |reason: String| {
        let message = format!("{}(): {reason}", operation.name);
        errors::raise(py, "InvalidArgument", &message)
    };
    let value = value.map_err(|misfit| refused(misfit.to_string()))?;
    let bytes = encode_body(&value).map_err(|error| refused(error.to_string()))?;
    Ok(PyBytes::new(py, &bytes))
}

fn decoded(py: Python<'_>, ty: &Arc<Struct>, bytes: &[u8]) -> PyResult<Vec<Value>> {
    match decode(ty, Encoding::Cdr, bytes) {
        Ok(Value::Struct(_, values)) => Ok(values),
        Ok(_) => Ok(Vec::new()),
        Err(error) => Err(errors::raise(py, "MalformedReply", &error.to_string())),
    }
}

/// The values of a configuration as the context gets them, and the period in nanoseconds that it
/// sets. Without a path it is the file in the folder of the component.
#[pyfunction]
pub(crate) fn configuration<'py>(
    py: Python<'py>,
    description: &str,
    folder: String,
    path: Option<PathBuf>,
) -> PyResult<(Bound<'py, PyDict>, Option<u64>)> {
    let program = read(description)?.in_folder(folder);
    let configured = rc_runtime::testing::configured_by(program.description, path);
    let configured = configured.map_err(|error| errors::raise(py, "Error", &error.to_string()))?;
    let values = crate::parameters::object(py, &configured.values)?;
    Ok((values, configured.period.map(crate::link::nanoseconds)))
}
