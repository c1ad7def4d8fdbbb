//! The classes `View` and `Loan`: a structure in its memory image.

use crate::errors;
use crate::memory::Memory;
use crate::parked::{Here, count_loan};
use crate::session::with;
use crate::to_python::dtype;
use crate::types::Types;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyAttributeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyList;
use rc_middleware::EncodeError;
use rc_values::{
    Layout, Member, Named, Struct, Type, Value, decode_image, default, encode_body, image_members,
    layout, read_member_image, write_member_image,
};
use std::sync::Arc;

/// A structure in its memory image. Its members are attributes: numbers, texts and enums are read
/// and assigned, sequences of numbers are arrays that share the memory, structures are views.
#[pyclass(subclass, frozen, module = "robocomp._native")]
pub(crate) struct View {
    memory: Py<Memory>,
    types: Arc<Types>,
    ty: Arc<Struct>,
    /// The offset in the memory.
    at: usize,
}

/// A sample that is written in place: `send` publishes it.
#[pyclass(extends = View, frozen, module = "robocomp._native")]
pub(crate) struct Loan {
    /// The topic: slot and operation, and the bench of a test.
    slot: usize,
    operation: usize,
    bench: Option<u64>,
    request: Arc<Struct>,
}

const ONE_LOAN: &str = "one loan of a topic exists at a time: send or discard the earlier one, and \
                        delete its arrays";

/// A member with its place.
struct MemberView<'t> {
    member: &'t Member,
    at: usize,
    size: usize,
}

impl View {
    pub(crate) fn new(memory: Py<Memory>, types: Arc<Types>, ty: Arc<Struct>, at: usize) -> Self {
        Self {
            memory,
            types,
            ty,
            at,
        }
    }

    /// Sets all members to their defaults. Unused elements keep their bytes.
    pub(crate) fn reset(&self) -> PyResult<()> {
        let Ok(Value::Struct(_, values)) = default(&self.ty) else {
            return Ok(());
        };
        for (place, value) in image_members(&self.ty).zip(&values) {
            let (member, at, size) = place.map_err(|error| unfit(&error))?;
            let written = self.memory.get().write(self.at + at, size, |bytes| {
                write_member_image(member, value, bytes)
            })?;
            written.map_err(|error| unfit(&error))?;
        }
        Ok(())
    }

    fn place(&self, py: Python<'_>, name: &str) -> PyResult<MemberView<'_>> {
        let class = self.types.class(&self.ty.name)?;
        let names = class.attributes.iter();
        let found = names.zip(image_members(&self.ty)).find(|(attribute, _)| {
            attribute
                .bind(py)
                .to_str()
                .is_ok_and(|attribute| attribute == name)
        });
        let Some((_, place)) = found else {
            let names: Vec<String> = class
                .attributes
                .iter()
                .map(|n| n.bind(py).to_string())
                .collect();
            let (ty, all) = (&self.ty.name, names.join(", "));
            return Err(PyAttributeError::new_err(format!(
                "`{ty}` has no member `{name}`; there are {all}"
            )));
        };
        let (member, at, size) = place.map_err(|error| unfit(&error))?;
        Ok(MemberView {
            member,
            at: self.at + at,
            size,
        })
    }

    fn get<'py>(&self, py: Python<'py>, place: &MemberView<'_>) -> PyResult<Bound<'py, PyAny>> {
        match &place.member.ty {
            Type::Named(Named::Struct(of)) if !place.member.optional => {
                let view = Self::new(
                    self.memory.clone_ref(py),
                    Arc::clone(&self.types),
                    Arc::clone(of),
                    place.at,
                );
                view.into_bound_py_any(py)
            }
            Type::Array { element, length } if !place.member.optional => {
                self.elements(py, element, place.at, *length as usize)
            }
            Type::Sequence { element, .. } if !place.member.optional => {
                let used = self.used(place, element)?;
                self.elements(py, element, place.at + first(element), used)
            }
            _ => {
                let value = self.memory.get().read(place.at, place.size, |bytes| {
                    read_member_image(place.member, bytes)
                })?;
                self.types.object(py, value.map_err(|error| unfit(&error))?)
            }
        }
    }

    /// The number of used elements of a sequence. A length above the bound counts as the bound.
    fn used(&self, place: &MemberView<'_>, element: &Type) -> PyResult<usize> {
        let length = self.memory.get().read(place.at, 4, |bytes| {
            bytes.try_into().map(u32::from_le_bytes).unwrap_or_default()
        })?;
        let size = layout(element).map_or(1, |layout| layout.size.max(1));
        let room = place.size.saturating_sub(first(element)) / size;
        Ok((length as usize).min(room).min(bound(&place.member.ty)))
    }

    fn elements<'py>(
        &self,
        py: Python<'py>,
        element: &Type,
        at: usize,
        count: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Some(Layout { size, .. }) = layout(element) else {
            return Err(PyTypeError::new_err(format!(
                "`{element}` has no memory image"
            )));
        };
        match element {
            Type::Primitive(primitive) if count == 0 => {
                self.types.empty.bind(py).call1((0, dtype(*primitive)))
            }
            Type::Primitive(primitive) => {
                let arguments = (self.memory.bind(py), dtype(*primitive), count, at);
                self.types.frombuffer.bind(py).call1(arguments)
            }
            _ => {
                // Every element is read as a member of its own.
                let member = Member {
                    name: String::new(),
                    ty: element.clone(),
                    optional: false,
                    unit: None,
                    range: None,
                    default: None,
                };
                let items = (0..count).map(|item| {
                    let at = at + item * size;
                    self.get(
                        py,
                        &MemberView {
                            member: &member,
                            at,
                            size,
                        },
                    )
                });
                let items = items.collect::<PyResult<Vec<_>>>()?;
                PyList::new(py, items)?.into_bound_py_any(py)
            }
        }
    }
}

/// The offset of the first element after its count.
fn first(element: &Type) -> usize {
    4_usize.next_multiple_of(layout(element).map_or(1, |layout| layout.align))
}

fn bound(ty: &Type) -> usize {
    match ty {
        Type::Sequence {
            bound: Some(bound), ..
        } => *bound as usize,
        _ => usize::MAX,
    }
}

fn unfit(error: &rc_values::ValueError) -> PyErr {
    Python::attach(|py| errors::raise(py, "InvalidSample", &error.to_string()))
}

#[pymethods]
impl View {
    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.get(py, &self.place(py, name)?)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.__getattr__(py, name)
    }

    fn __setattr__(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let py = value.py();
        let place = self.place(py, name)?;
        let refused =
            |reason: String| errors::raise(py, "InvalidSample", &format!("`{name}`: {reason}"));
        let value = self.types.member(place.member, value);
        let value = value.map_err(|misfit| refused(misfit.to_string()))?;
        let written = self.memory.get().write(place.at, place.size, |bytes| {
            write_member_image(place.member, &value, bytes)
        })?;
        written.map_err(|error| refused(error.to_string()))
    }

    fn __setitem__(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.__setattr__(name, value)
    }

    /// Sets the number of elements of a sequence and returns them. New numbers have any value, new
    /// structures their defaults.
    fn resize<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        length: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let place = self.place(py, name)?;
        let Type::Sequence { element, .. } = &place.member.ty else {
            return Err(PyTypeError::new_err(format!("`{name}` is not a sequence")));
        };
        let most = bound(&place.member.ty);
        if place.member.optional || length > most {
            let message = format!("`{name}`: {length} elements, its type allows {most}");
            return Err(errors::raise(py, "InvalidSample", &message));
        }
        let before = self.used(&place, element)?;
        let size = layout(element).map_or(1, |layout| layout.size);
        let (start, end) = (before.min(length) * size, length * size);
        // Numbers have no invalid values, so an array need not be cleared.
        let is_plain = matches!(&**element, Type::Primitive(p) if *p != rc_values::Primitive::Bool);
        self.memory.get().write(place.at, place.size, |bytes| {
            bytes[..4].copy_from_slice(&u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
            if !is_plain {
                let first = first(element);
                bytes[first + start..first + end].fill(0);
            }
        })?;
        let elements = self.get(py, &place)?;
        if matches!(**element, Type::Named(Named::Struct(_))) {
            for item in elements.try_iter()?.skip(before) {
                item?.cast_into::<Self>()?.get().reset()?;
            }
        }
        Ok(elements)
    }

    /// The value as an object that keeps no memory of the sample.
    fn copy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let size = self.ty.layout.map_or(0, |layout| layout.size);
        let memory = self.memory.get();
        let value = memory.read(self.at, size, |bytes| decode_image(&self.ty, bytes))?;
        self.types.object(py, value.map_err(|error| unfit(&error))?)
    }

    fn __dir__(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let class = self.types.class(&self.ty.name)?;
        let names = class
            .attributes
            .iter()
            .map(|name| name.bind(py).to_string());
        Ok(names.chain(["copy", "resize"].map(str::to_owned)).collect())
    }

    fn __repr__(&self) -> String {
        let kind = if self.memory.get().is_writable() {
            "writable"
        } else {
            "read-only"
        };
        format!("<{kind} view of {}>", self.ty.name)
    }
}

impl Loan {
    /// A loan of the topic's only parameter. Without memory of the middleware it is copied when it
    /// is sent.
    pub(crate) fn new<'py>(
        py: Python<'py>,
        types: &Arc<Types>,
        request: &Arc<Struct>,
        (bench, slot, operation): (Option<u64>, usize, usize),
    ) -> PyResult<Bound<'py, Self>> {
        let (size, ty) = in_place(request)?;
        rc_host::drop_abandoned();
        let refused = |reason: &str| errors::raise(py, "NotSent", reason);
        let memory = if let Some(bench) = bench {
            let loan = count_loan(bench, slot, operation).ok_or_else(|| refused(ONE_LOAN))?;
            Memory::counted(size, loan)
        } else {
            let lent = with(|session| {
                let publisher = session.publisher(slot, operation)?;
                Ok(publisher.loan_image(size))
            })?;
            let lent = lent.map_err(|error| refused(&format!("{error}; {ONE_LOAN}")))?;
            lent.map_or_else(|| Memory::zeros(size), Memory::lent)
        };
        let view = View::new(Py::new(py, memory)?, Arc::clone(types), Arc::clone(ty), 0);
        view.reset()?;
        let loan = Self {
            slot,
            operation,
            bench,
            request: Arc::clone(request),
        };
        Bound::new(py, PyClassInitializer::from(view).add_subclass(loan))
    }
}

/// The size of a topic's only parameter in place, and its type.
fn in_place(request: &Struct) -> PyResult<(usize, &Arc<Struct>)> {
    match (request.layout, request.members.as_slice()) {
        (
            Some(layout),
            [
                Member {
                    ty: Type::Named(Named::Struct(ty)),
                    ..
                },
            ],
        ) => Ok((layout.size, ty)),
        _ => Err(PyTypeError::new_err(format!(
            "`{}` has no structure that is written in place",
            request.name
        ))),
    }
}

#[pymethods]
impl Loan {
    /// Publishes the sample. It fails while an array that shares its memory exists.
    fn send(slf: &Bound<'_, Self>) -> PyResult<()> {
        let py = slf.py();
        let loan = slf.get();
        let view = slf.as_super().get();
        let memory = view.memory.get();
        let taken = memory.take()?;
        let (slot, operation) = (loan.slot, loan.operation);
        if let Some(sample) = taken {
            let sent = with(|session| {
                let publisher = session.publisher(slot, operation)?;
                let encode = |image: &[u8]| {
                    let value = decode_image(&loan.request, image);
                    let body = value.and_then(|value| encode_body(&value));
                    body.map_err(|error| EncodeError::NoValue(error.to_string()))
                };
                Ok(publisher.send_image(sample, &encode))
            })?;
            return sent.map_err(|error| errors::of_sending(py, &error));
        }
        let size = loan.request.layout.map_or(0, |layout| layout.size);
        let value = memory.read(0, size, |bytes| decode_image(&loan.request, bytes))?;
        let value = value.map_err(|error| unfit(&error))?;
        memory.end();
        let _here = Here::enter(loan.bench);
        let sent = py.detach(|| rc_host::link::publish(slot, operation, &value));
        let sent = sent.map_err(errors::of_host)?;
        sent.map_err(|error| errors::of_sending(py, &error))
    }

    /// Gives the memory back without sending the sample.
    fn discard(slf: &Bound<'_, Self>) -> PyResult<()> {
        let memory = slf.as_super().get().memory.get();
        drop(memory.take()?);
        memory.end();
        Ok(())
    }

    fn __enter__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    /// Sends the sample at the end of a `with` block, and discards it after an exception.
    fn __exit__(
        slf: &Bound<'_, Self>,
        class: &Bound<'_, PyAny>,
        _value: &Bound<'_, PyAny>,
        _traceback: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        if class.is_none() {
            Self::send(slf)
        } else {
            slf.as_super().get().memory.get().discard();
            Ok(())
        }
    }
}
