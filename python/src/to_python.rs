//! From values to objects of Python.

use crate::memory::Memory;
use crate::types::Types;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use rc_values::{Numbers, Primitive, Value};
use rc_vocabulary::Class;

impl Types {
    /// A value as an object. Numbers of a sequence become a writable array of `NumPy`.
    pub(crate) fn object<'py>(&self, py: Python<'py>, value: Value) -> PyResult<Bound<'py, PyAny>> {
        match value {
            Value::Bool(value) => value.into_bound_py_any(py),
            Value::Int(value) => value.into_bound_py_any(py),
            Value::Uint(value) => value.into_bound_py_any(py),
            Value::F32(value) => f64::from(value).into_bound_py_any(py),
            Value::F64(value) => value.into_bound_py_any(py),
            Value::Text(value) => value.into_bound_py_any(py),
            Value::Missing => Ok(py.None().into_bound(py)),
            Value::Enum(of, number) => {
                let member = self.class(&of.name)?.members.get(&number);
                match member {
                    Some(member) => Ok(member.bind(py).clone()),
                    None => number.into_bound_py_any(py),
                }
            }
            Value::Numbers(numbers) => self.array(py, numbers),
            Value::Sequence(items) => {
                let items = items.into_iter().map(|item| self.object(py, item));
                let items = items.collect::<PyResult<Vec<_>>>()?;
                PyList::new(py, items)?.into_bound_py_any(py)
            }
            Value::Map(pairs) => {
                let dict = PyDict::new(py);
                for (key, value) in pairs {
                    dict.set_item(self.object(py, key)?, self.object(py, value)?)?;
                }
                dict.into_bound_py_any(py)
            }
            Value::Struct(ty, values) => {
                let class = self.class(&ty.name)?.python.bind(py);
                class.call1(self.parts(py, values)?)
            }
        }
    }

    /// The members of a structure, as the arguments of a function.
    pub(crate) fn parts<'py>(
        &self,
        py: Python<'py>,
        values: Vec<Value>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let objects = values.into_iter().map(|value| self.object(py, value));
        PyTuple::new(py, objects.collect::<PyResult<Vec<_>>>()?)
    }

    /// The result of a call: nothing, the only part of the reply, or all of them. A reply ends with
    /// the result, if the operation `has_result`; the tuple begins with it.
    pub(crate) fn answer_object<'py>(
        &self,
        py: Python<'py>,
        operation: &str,
        has_result: bool,
        mut values: Vec<Value>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if has_result && values.len() > 1 {
            values.rotate_right(1);
        }
        let mut parts = self.parts(py, values)?.into_any();
        match (parts.len()?, self.answer(operation)) {
            (0, _) => parts = py.None().into_bound(py),
            (1, _) => parts = parts.get_item(0)?,
            (_, Some(class)) => parts = class.bind(py).call1(parts.cast::<PyTuple>()?)?,
            (_, None) => {}
        }
        Ok(parts)
    }

    /// An array that owns the numbers.
    fn array<'py>(&self, py: Python<'py>, numbers: Numbers) -> PyResult<Bound<'py, PyAny>> {
        let of = dtype(numbers.primitive());
        if numbers.is_empty() {
            return self.empty.bind(py).call1((0, of));
        }
        let memory = match numbers {
            // An array may hold other bytes than a `bool` of Rust.
            Numbers::Bool(flags) => Memory::numbers(flags.into_iter().map(u8::from).collect()),
            Numbers::U8(bytes) => Memory::numbers(bytes),
            Numbers::I8(items) => Memory::numbers(items),
            Numbers::I16(items) => Memory::numbers(items),
            Numbers::U16(items) => Memory::numbers(items),
            Numbers::I32(items) => Memory::numbers(items),
            Numbers::U32(items) => Memory::numbers(items),
            Numbers::I64(items) => Memory::numbers(items),
            Numbers::U64(items) => Memory::numbers(items),
            Numbers::F32(items) => Memory::numbers(items),
            Numbers::F64(items) => Memory::numbers(items),
        };
        self.frombuffer.bind(py).call1((Py::new(py, memory)?, of))
    }
}

/// The name of a number's type in `NumPy`: little endian.
pub(crate) fn dtype(primitive: Primitive) -> String {
    let kind = match primitive.class() {
        Class::Bool => return "?".to_owned(),
        Class::Signed => 'i',
        Class::Unsigned => 'u',
        Class::Float => 'f',
    };
    format!("<{kind}{}", primitive.size())
}
