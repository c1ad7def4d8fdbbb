//! From objects of Python to values. A misfit is an error that names the field.

use crate::types::Types;
use pyo3::buffer::{Element, PyUntypedBuffer};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString, PyTuple};
use rc_values::{Member, Named, Numbers, Primitive, Struct, Type, Value};
use std::fmt;
use std::sync::Arc;

/// The most elements that are taken one by one, if the type allows any number: an iterator may be
/// infinite, and a `range` larger than memory.
const MOST_OF_ITERATOR: usize = 1 << 24;

/// The longest text of an object in a message, in characters.
const SHOWN: usize = 40;

/// An object that does not fit its type.
#[derive(Debug)]
pub(crate) struct ConversionError {
    /// The member, as in `pose.points[3].x`; empty for the whole value.
    path: String,
    reason: String,
}

impl ConversionError {
    fn new(reason: impl Into<String>) -> Self {
        Self {
            path: String::new(),
            reason: reason.into(),
        }
    }

    fn expected(what: impl fmt::Display, object: &Bound<'_, PyAny>) -> Self {
        Self::new(format!("expected {what}, got {}", shown(object)))
    }

    pub(crate) fn in_member(self, name: &str) -> Self {
        let dot = match self.path.chars().next() {
            None | Some('[') => "",
            Some(_) => ".",
        };
        Self {
            path: format!("{name}{dot}{}", self.path),
            ..self
        }
    }

    fn in_element(self, at: impl fmt::Display) -> Self {
        self.in_member(&format!("[{at}]"))
    }
}

impl From<PyErr> for ConversionError {
    fn from(error: PyErr) -> Self {
        Self::new(error.to_string())
    }
}

impl fmt::Display for ConversionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.path.is_empty() {
            f.write_str(&self.reason)
        } else {
            write!(f, "`{}`: {}", self.path, self.reason)
        }
    }
}

/// An object with its type, for a message.
pub(crate) fn shown(object: &Bound<'_, PyAny>) -> String {
    let class = object.get_type().name().map(|name| name.to_string());
    let class = class.unwrap_or_default();
    if object.is_none() {
        return "None".to_owned();
    }
    let text = object
        .repr()
        .map(|text| text.to_string_lossy().into_owned());
    let text = text.unwrap_or_default();
    if text.chars().count() > SHOWN || text.contains('\n') {
        class
    } else {
        format!("{text} ({class})")
    }
}

impl Types {
    /// The arguments of an operation as the structure of its request.
    pub(crate) fn arguments(
        &self,
        ty: &Arc<Struct>,
        arguments: &Bound<'_, PyTuple>,
    ) -> Result<Value, ConversionError> {
        if arguments.len() != ty.members.len() {
            let (wanted, given) = (ty.members.len(), arguments.len());
            return Err(ConversionError::new(format!(
                "it takes {wanted} arguments, {given} were given"
            )));
        }
        self.members(ty, arguments.iter().map(Ok))
    }

    /// The result of a handler, as the structure of its reply. A tuple begins with the result, if
    /// the operation `has_result`; the structure ends with it.
    pub(crate) fn reply(
        &self,
        ty: &Arc<Struct>,
        has_result: bool,
        object: &Bound<'_, PyAny>,
    ) -> Result<Value, ConversionError> {
        match ty.members.as_slice() {
            [] if object.is_none() => self.members(ty, std::iter::empty()),
            [] => Err(ConversionError::expected("None", object)),
            [member] => {
                let value = self.member(member, object);
                // The name of a returned value is not a name that its worker knows.
                let value = value.map_err(|error| match member.name.as_str() {
                    "return" => error,
                    name => error.in_member(name),
                })?;
                Ok(Value::Struct(Arc::clone(ty), vec![value]))
            }
            members => {
                let parts = object.cast::<PyTuple>().ok();
                let parts = parts.filter(|parts| parts.len() == members.len());
                let parts = parts.ok_or_else(|| {
                    let mut names: Vec<&str> = members.iter().map(|m| m.name.as_str()).collect();
                    if has_result {
                        names.pop();
                        names.insert(0, "result");
                    }
                    ConversionError::expected(format!("a tuple of {}", names.join(", ")), object)
                })?;
                let mut parts: Vec<_> = parts.iter().map(Ok).collect();
                if has_result {
                    parts.rotate_left(1);
                }
                self.members(ty, parts.into_iter())
            }
        }
    }

    /// An exception as the structure of its type.
    pub(crate) fn structure(
        &self,
        ty: &Arc<Struct>,
        object: &Bound<'_, PyAny>,
    ) -> Result<Value, ConversionError> {
        let class = self.class(&ty.name)?;
        if !object.is_instance(class.python.bind(object.py()))? {
            return Err(ConversionError::expected(format!("`{}`", ty.name), object));
        }
        let parts = class.attributes.iter();
        self.members(ty, parts.map(|name| object.getattr(name.bind(object.py()))))
    }

    fn members<'py>(
        &self,
        ty: &Arc<Struct>,
        objects: impl Iterator<Item = PyResult<Bound<'py, PyAny>>>,
    ) -> Result<Value, ConversionError> {
        let mut values = Vec::with_capacity(ty.members.len());
        for (member, object) in ty.members.iter().zip(objects) {
            let object = object.map_err(ConversionError::from);
            let value = object.and_then(|object| self.member(member, &object));
            values.push(value.map_err(|error| error.in_member(&member.name))?);
        }
        Ok(Value::Struct(Arc::clone(ty), values))
    }

    pub(crate) fn member(
        &self,
        member: &Member,
        object: &Bound<'_, PyAny>,
    ) -> Result<Value, ConversionError> {
        if object.is_none() {
            return if member.optional {
                Ok(Value::Missing)
            } else {
                Err(ConversionError::expected(&member.ty, object))
            };
        }
        let value = self.value(&member.ty, object)?;
        check_range(member, &value)?;
        Ok(value)
    }

    fn value(&self, ty: &Type, object: &Bound<'_, PyAny>) -> Result<Value, ConversionError> {
        match ty {
            Type::Primitive(primitive) => self.number(*primitive, object),
            Type::Text { bound } => text(*bound, object),
            Type::Sequence { element, bound } => {
                let most = bound.map(|bound| bound as usize);
                let value = self.elements(ty, element, object, most)?;
                let (length, most) = (count(&value), bound.map_or(usize::MAX, |b| b as usize));
                if length > most {
                    return Err(ConversionError::new(format!(
                        "it has {length} elements, its type allows {most}"
                    )));
                }
                Ok(value)
            }
            Type::Array { element, length } => {
                let value = self.elements(ty, element, object, Some(*length as usize))?;
                if count(&value) != *length as usize {
                    let has = count(&value);
                    return Err(ConversionError::new(format!(
                        "it has {has} elements, its type has {length}"
                    )));
                }
                Ok(value)
            }
            Type::Dictionary { key, value } => {
                let wrong = || ConversionError::expected("a dict", object);
                let dict = object.cast::<PyDict>().map_err(|_| wrong())?;
                let mut pairs = Vec::with_capacity(dict.len());
                // A snapshot: a conversion runs code of the user, which may change the dict.
                for pair in dict.items() {
                    let pair = pair.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>();
                    let (name, item) = pair.map_err(|_| wrong())?;
                    let place = |error: ConversionError| error.in_element(shown(&name));
                    let key = self.value(key, &name).map_err(place)?;
                    let place = |error: ConversionError| error.in_element(key.plain());
                    let item = self.value(value, &item).map_err(place)?;
                    pairs.push((key, item));
                }
                Ok(Value::Map(pairs))
            }
            Type::Named(Named::Enum(of)) => {
                let class = self.class(&of.name)?.python.bind(object.py());
                let number = object.extract::<i32>().ok();
                match number.filter(|number| of.name_of(*number).is_some()) {
                    Some(number) if object.is_instance(class)? => {
                        Ok(Value::Enum(Arc::clone(of), number))
                    }
                    _ => {
                        let names: Vec<&str> = of.values.iter().map(|(n, _)| n.as_str()).collect();
                        let what = format!("`{}` ({})", of.name, names.join(", "));
                        Err(ConversionError::expected(what, object))
                    }
                }
            }
            Type::Named(Named::Struct(of)) => self.structure(of, object),
        }
    }

    fn number(
        &self,
        primitive: Primitive,
        object: &Bound<'_, PyAny>,
    ) -> Result<Value, ConversionError> {
        let word = primitive.word();
        let is_bool = object.is_instance_of::<PyBool>()
            || object.is_instance(self.numpy_bool.bind(object.py()))?;
        match primitive {
            Primitive::Bool if is_bool => Ok(Value::Bool(object.is_truthy()?)),
            _ if is_bool || primitive == Primitive::Bool => {
                Err(ConversionError::expected(word, object))
            }
            Primitive::F32 | Primitive::F64 => {
                if object.is_instance_of::<PyString>()
                    || object.is_instance(self.numpy_complex.bind(object.py()))?
                    || is_masked(object)?
                {
                    return Err(ConversionError::expected(word, object));
                }
                let number: f64 = object.extract().map_err(|error: PyErr| {
                    if error.is_instance_of::<PyOverflowError>(object.py()) {
                        outside(shown(object), primitive)
                    } else {
                        ConversionError::expected(word, object)
                    }
                })?;
                float(primitive, number)
            }
            _ if object.is_instance_of::<PyFloat>() || is_masked(object)? => {
                Err(ConversionError::expected(word, object))
            }
            _ => {
                let number = object.extract::<i128>();
                let number = match number {
                    Ok(number) => number,
                    Err(error) if error.is_instance_of::<PyOverflowError>(object.py()) => {
                        let text = if object.is_instance_of::<PyInt>() {
                            "the number".to_owned()
                        } else {
                            shown(object)
                        };
                        return Err(outside(text, primitive));
                    }
                    Err(_) => return Err(ConversionError::expected(word, object)),
                };
                integer(primitive, number)
            }
        }
    }

    /// The elements of a sequence or an array. Arrays of `NumPy`, bytes and other buffers are
    /// copied as a whole; one of several dimensions is read row by row. `most` are allowed: an
    /// iterator may have no end, or more elements than it says.
    fn elements(
        &self,
        ty: &Type,
        element: &Type,
        object: &Bound<'_, PyAny>,
        most: Option<usize>,
    ) -> Result<Value, ConversionError> {
        let wrong = || ConversionError::expected(ty, object);
        if object.is_instance_of::<PyString>() || object.is_instance_of::<PyDict>() {
            return Err(wrong());
        }
        if let Type::Primitive(primitive) = element
            && let Some(numbers) = of_buffer(*primitive, object)?
        {
            return Ok(Value::Numbers(numbers));
        }
        let length = object.len().ok();
        let most = match length {
            Some(length) if length <= MOST_OF_ITERATOR => MOST_OF_ITERATOR,
            _ => most.unwrap_or(MOST_OF_ITERATOR),
        };
        let check = |at: usize| {
            let more = || ConversionError::new(format!("it has more than {most} elements"));
            (at < most).then_some(()).ok_or_else(more)
        };
        check(length.unwrap_or(0).saturating_sub(1))?;
        if let Type::Primitive(primitive) = element {
            let mut numbers = Numbers::empty(*primitive);
            for (at, item) in object.try_iter().map_err(|_| wrong())?.enumerate() {
                check(at)?;
                let number = item.map_err(ConversionError::from);
                let number = number.and_then(|item| self.number(*primitive, &item));
                let number = number.map_err(|error| error.in_element(at))?;
                numbers.push(&number);
            }
            return Ok(Value::Numbers(numbers));
        }
        let mut items = Vec::new();
        for (at, item) in object.try_iter().map_err(|_| wrong())?.enumerate() {
            check(at)?;
            let item = item.map_err(ConversionError::from);
            let item = item.and_then(|item| self.value(element, &item));
            items.push(item.map_err(|error| error.in_element(at))?);
        }
        Ok(Value::Sequence(items))
    }
}

fn check_range(member: &Member, value: &Value) -> Result<(), ConversionError> {
    match member.range {
        Some(range) if !range.contains(value) => {
            let number = rc_values::written(value);
            let unit = member.unit.as_deref().unwrap_or_default();
            let blank = if unit.is_empty() { "" } else { " " };
            Err(ConversionError::new(format!(
                "{number} is outside its range {range}{blank}{unit}"
            )))
        }
        _ => Ok(()),
    }
}

fn count(value: &Value) -> usize {
    match value {
        Value::Numbers(numbers) => numbers.len(),
        Value::Sequence(items) => items.len(),
        _ => 0,
    }
}

fn text(bound: Option<u32>, object: &Bound<'_, PyAny>) -> Result<Value, ConversionError> {
    let wrong = || ConversionError::expected("str", object);
    let text = object.cast::<PyString>().map_err(|_| wrong())?;
    let text = text.to_str().map_err(|_| {
        ConversionError::new("the text has a surrogate (U+D800 to U+DFFF), which UTF-8 cannot hold")
    })?;
    if text.contains('\0') {
        return Err(ConversionError::new("a string holds a zero byte"));
    }
    match bound {
        Some(bound) if text.len() > bound as usize => Err(ConversionError::new(format!(
            "it has {} bytes, its type allows {bound}",
            text.len()
        ))),
        _ => Ok(Value::Text(text.to_owned())),
    }
}

fn outside(number: impl fmt::Display, primitive: Primitive) -> ConversionError {
    let allowed = match primitive.limits() {
        Some((min, max)) => format!(", {min} to {max}"),
        None => String::new(),
    };
    ConversionError::new(format!(
        "{number} is outside of {}{allowed}",
        primitive.word()
    ))
}

fn integer(primitive: Primitive, number: i128) -> Result<Value, ConversionError> {
    match primitive.limits() {
        Some((min, max)) if (min..=max).contains(&number) => {
            Ok(match u64::try_from(number) {
                Ok(number) if primitive == Primitive::U64 => Value::Uint(number),
                // Within the range of every other type.
                _ => Value::Int(number as i64),
            })
        }
        _ => Err(outside(number, primitive)),
    }
}

fn float(primitive: Primitive, number: f64) -> Result<Value, ConversionError> {
    if primitive == Primitive::F64 {
        return Ok(Value::F64(number));
    }
    let short = number as f32;
    if short.is_infinite() && number.is_finite() {
        return Err(outside(number, primitive));
    }
    Ok(Value::F32(short))
}

/// Copies the numbers of a buffer. `None` if it is not a buffer of numbers.
fn of_buffer(
    primitive: Primitive,
    object: &Bound<'_, PyAny>,
) -> Result<Option<Numbers>, ConversionError> {
    let Ok(buffer) = PyUntypedBuffer::get(object) else {
        return Ok(None);
    };
    let py = object.py();
    // A conversion of NumPy drops the imaginary part, and masked elements have any value.
    if buffer.format().to_bytes().contains(&b'Z') {
        return Err(ConversionError::new(
            "its numbers are complex; take `.real`",
        ));
    }
    if is_masked(object)? {
        return Err(ConversionError::new(
            "a mask hides some of its numbers; `.filled(VALUE)` gives them a value",
        ));
    }
    macro_rules! same {
        ($($kind:ident $number:ty),*) => {
            match primitive {
                $(Primitive::$kind => {
                    if let Some(items) = read::<$number>(py, &buffer)? {
                        return Ok(Some(Numbers::$kind(items)));
                    }
                })*
                Primitive::Bool => return Ok(None),
            }
        };
    }
    same!(I8 i8, U8 u8, I16 i16, U16 u16, I32 i32, U32 u32, I64 i64, U64 u64, F32 f32, F64 f64);
    // Another type of numbers: each one is converted.
    let mut numbers = Numbers::empty(primitive);
    let mut convert = |found: &mut dyn Iterator<Item = Result<Value, ConversionError>>| {
        for (at, number) in found.enumerate() {
            numbers.push(&number.map_err(|error| error.in_element(at))?);
        }
        Ok::<_, ConversionError>(())
    };
    let is_float = matches!(primitive, Primitive::F32 | Primitive::F64);
    macro_rules! integers {
        ($($number:ty),*) => {
            $(if let Some(items) = read::<$number>(py, &buffer)? {
                convert(&mut items.into_iter().map(|item| {
                    if is_float {
                        float(primitive, as_float(item))
                    } else {
                        integer(primitive, i128::from(item))
                    }
                }))?;
                return Ok(Some(numbers));
            })*
        };
    }
    integers!(i64, u8, i32, u64, i8, i16, u16, u32);
    if is_float {
        if let Some(items) = read::<f64>(py, &buffer)? {
            convert(&mut items.into_iter().map(|item| float(primitive, item)))?;
            return Ok(Some(numbers));
        }
        if let Some(items) = read::<f32>(py, &buffer)? {
            convert(&mut items.into_iter().map(|item| float(primitive, item.into())))?;
            return Ok(Some(numbers));
        }
    }
    Ok(None)
}

/// Whether a mask of `NumPy` hides a part of an array, or all of it.
fn is_masked(object: &Bound<'_, PyAny>) -> PyResult<bool> {
    if object.is_exact_instance_of::<PyFloat>() || object.is_exact_instance_of::<PyInt>() {
        return Ok(false);
    }
    match object.getattr_opt("mask")? {
        Some(mask) if object.hasattr("filled")? => mask.call_method0("any")?.is_truthy(),
        _ => Ok(false),
    }
}

/// The nearest float of an integer.
fn as_float(number: impl Into<i128>) -> f64 {
    number.into() as f64
}

/// The elements of a buffer of this type.
fn read<T: Element>(py: Python<'_>, buffer: &PyUntypedBuffer) -> PyResult<Option<Vec<T>>> {
    // The other byte order: `as_typed` looks at the size only.
    let order = buffer.format().to_bytes().first();
    if matches!(order, Some(b'>' | b'!')) && buffer.item_size() > 1 {
        return Ok(None);
    }
    match buffer.as_typed::<T>() {
        Ok(buffer) => Ok(Some(buffer.to_vec(py)?)),
        Err(_) => Ok(None),
    }
}
