//! The classes of Python that represent the types of a component.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple, PyType};
use std::collections::HashMap;
use std::sync::Arc;

use rc_host::Program;

/// The class of a structure, an exception or an enum.
pub(crate) struct Class {
    pub(crate) python: Py<PyType>,
    /// The attributes of a structure, in the order of the IDSL's members.
    pub(crate) attributes: Vec<Py<PyString>>,
    /// The members of an enum, by their numbers.
    pub(crate) members: HashMap<i32, Py<PyAny>>,
}

/// The classes of a component, and the functions of `NumPy` that make arrays.
pub(crate) struct Types {
    classes: HashMap<String, Class>,
    /// The classes of replies of several parts, by the name of the operation.
    answers: HashMap<String, Py<PyAny>>,
    pub(crate) frombuffer: Py<PyAny>,
    pub(crate) empty: Py<PyAny>,
    pub(crate) numpy_bool: Py<PyAny>,
    pub(crate) numpy_complex: Py<PyAny>,
}

/// The types of an operation, and the name of the class for replies of several parts.
pub(crate) struct Used<'o> {
    pub(crate) answer: String,
    pub(crate) request: &'o Arc<rc_values::Struct>,
    pub(crate) reply: &'o Arc<rc_values::Struct>,
    pub(crate) throws: &'o [rc_values::Exception],
}

impl Types {
    /// Reads the classes of a component. `classes` has one for each type that the component uses.
    pub(crate) fn read(program: &Program, classes: &Bound<'_, PyDict>) -> PyResult<Arc<Self>> {
        let operations = program.slots.iter().flat_map(|slot| &slot.operations);
        let used = operations.map(|operation| Used {
            answer: operation.answer.clone(),
            request: &operation.request,
            reply: &operation.reply,
            throws: &operation.throws,
        });
        Self::of(classes, used)
    }

    /// Reads the classes of the types that these operations use.
    pub(crate) fn of<'o>(
        classes: &Bound<'_, PyDict>,
        operations: impl Iterator<Item = Used<'o>>,
    ) -> PyResult<Arc<Self>> {
        let py = classes.py();
        let numpy = py.import("numpy")?;
        let mut types = Self {
            classes: HashMap::new(),
            answers: HashMap::new(),
            frombuffer: numpy.getattr("frombuffer")?.unbind(),
            empty: numpy.getattr("empty")?.unbind(),
            numpy_bool: numpy.getattr("bool_")?.unbind(),
            numpy_complex: numpy.getattr("complexfloating")?.unbind(),
        };
        let mut uses = Uses::default();
        for operation in operations {
            uses.members(operation.request);
            uses.members(operation.reply);
            for thrown in operation.throws {
                uses.structure(&thrown.ty);
            }
            if operation.reply.members.len() > 1 {
                let class = find(classes, &operation.answer)?;
                types
                    .answers
                    .insert(operation.answer, class.into_any().unbind());
            }
        }
        for (name, ty) in uses.structures {
            let class = find(classes, &name)?;
            let attributes = class.getattr("__match_args__")?.cast_into::<PyTuple>()?;
            if attributes.len() != ty.members.len() {
                let (has, needs) = (attributes.len(), ty.members.len());
                return Err(wrong(format!(
                    "the class of `{name}` has {has} attributes in `__match_args__`, its type has {needs} members"
                )));
            }
            let attributes = attributes.iter().map(|name| Ok(name.cast_into()?.unbind()));
            types.classes.insert(
                name,
                Class {
                    python: class.unbind(),
                    attributes: attributes.collect::<PyResult<_>>()?,
                    members: HashMap::new(),
                },
            );
        }
        for (name, ty) in uses.enums {
            let class = find(classes, &name)?;
            let mut members = HashMap::new();
            for (_, number) in &ty.values {
                members.insert(*number, class.call1((*number,))?.unbind());
            }
            types.classes.insert(
                name,
                Class {
                    python: class.unbind(),
                    attributes: Vec::new(),
                    members,
                },
            );
        }
        Ok(Arc::new(types))
    }

    /// The class of a type.
    pub(crate) fn class(&self, name: &str) -> PyResult<&Class> {
        self.classes
            .get(name)
            .ok_or_else(|| wrong(format!("there is no class for `{name}`")))
    }

    /// The class of the replies of an operation, if they have several parts.
    pub(crate) fn answer(&self, operation: &str) -> Option<&Py<PyAny>> {
        self.answers.get(operation)
    }
}

fn find<'py>(classes: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyType>> {
    let found = classes.get_item(name)?;
    let found = found.ok_or_else(|| {
        wrong(format!(
            "the generated package has no class for `{name}`; generate it again"
        ))
    })?;
    Ok(found.cast_into::<PyType>()?)
}

fn wrong(message: String) -> PyErr {
    pyo3::exceptions::PyTypeError::new_err(message)
}

/// The named types inside of others.
#[derive(Default)]
struct Uses {
    structures: HashMap<String, Arc<rc_values::Struct>>,
    enums: HashMap<String, Arc<rc_values::Enum>>,
}

impl Uses {
    fn structure(&mut self, ty: &Arc<rc_values::Struct>) {
        if self.structures.contains_key(&ty.name) {
            return;
        }
        self.structures.insert(ty.name.clone(), Arc::clone(ty));
        self.members(ty);
    }

    fn members(&mut self, ty: &rc_values::Struct) {
        for member in &ty.members {
            self.ty(&member.ty);
        }
    }

    fn ty(&mut self, ty: &rc_values::Type) {
        use rc_values::{Named, Type};
        match ty {
            Type::Primitive(_) | Type::Text { .. } => {}
            Type::Sequence { element, .. } | Type::Array { element, .. } => self.ty(element),
            Type::Dictionary { key, value } => {
                self.ty(key);
                self.ty(value);
            }
            Type::Named(Named::Enum(of)) => {
                self.enums.insert(of.name.clone(), Arc::clone(of));
            }
            Type::Named(Named::Struct(of)) => self.structure(of),
        }
    }
}
