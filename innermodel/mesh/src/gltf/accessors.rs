//! The numbers of a glTF file: accessors over views of buffers, and the changes of sparse ones.

use super::{MAX_TRIANGLES, Reader, wrong};
use crate::MeshError;
use serde::Deserialize;
use std::borrow::Cow;

/// How many elements without data an accessor may have.
const MOST_WITHOUT_DATA: usize = 10_000_000;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    #[serde(flatten)]
    data: Data,
    component_type: u32,
    #[serde(default)]
    normalized: bool,
    count: usize,
    /// `SCALAR`, `VEC3`.
    #[serde(rename = "type")]
    form: Option<String>,
    sparse: Option<Sparse>,
}

/// Where numbers are.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Data {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
}

/// Elements that differ from the data of their accessor.
#[derive(Deserialize)]
struct Sparse {
    count: usize,
    indices: Places,
    values: Data,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Places {
    #[serde(flatten)]
    data: Data,
    component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

impl View {
    /// The bytes of the view. `None` if they do not exist.
    pub(super) fn bytes<'b>(&self, buffers: &'b [Cow<'_, [u8]>]) -> Option<&'b [u8]> {
        let end = self.byte_offset.checked_add(self.byte_length)?;
        buffers.get(self.buffer)?.get(self.byte_offset..end)
    }
}

fn missing() -> MeshError {
    wrong("data of a mesh are missing")
}

impl Reader<'_> {
    /// How many elements an accessor has.
    pub(super) fn count(&self, at: usize) -> Result<usize, MeshError> {
        let accessor = self.root.accessors.get(at);
        accessor.map(|of| of.count).ok_or_else(missing)
    }

    /// The numbers of an accessor, `width` in each element.
    pub(super) fn numbers(&self, at: usize, width: usize) -> Result<Vec<f64>, MeshError> {
        let accessor = self.root.accessors.get(at).ok_or_else(missing)?;
        let count = accessor.count;
        if count > 3 * MAX_TRIANGLES {
            return Err(wrong("an accessor has more than 150 million elements"));
        }
        let form = match width {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        if accessor.form.as_ref().is_some_and(|given| given != form) {
            return Err(wrong(&format!("an accessor is not of the type {form}")));
        }
        let component = accessor.component_type;
        let mut numbers = match (&accessor.data.buffer_view, &accessor.sparse) {
            (None, Some(_)) if count > MOST_WITHOUT_DATA => {
                return Err(wrong("an accessor has more than 10 million zeros"));
            }
            (None, Some(_)) => vec![0.0; count * width],
            _ => self.elements(&accessor.data, component, count, width)?,
        };
        if let Some(sparse) = &accessor.sparse {
            if sparse.count > count {
                return Err(wrong("a sparse accessor changes more elements than it has"));
            }
            let places = self.whole(&sparse.indices, sparse.count)?;
            let values = self.elements(&sparse.values, component, sparse.count, width)?;
            for (place, value) in places.into_iter().zip(values.chunks_exact(width)) {
                let start = place as usize * width;
                let changed = numbers.get_mut(start..start + width);
                let changed =
                    changed.ok_or_else(|| wrong("a sparse accessor changes what it lacks"))?;
                changed.copy_from_slice(value);
            }
        }
        if accessor.normalized {
            let greatest = greatest(component);
            numbers.iter_mut().for_each(|number| *number /= greatest);
        }
        Ok(numbers)
    }

    /// The places of an accessor that says which vertices are corners.
    pub(super) fn indices(&self, at: usize) -> Result<Vec<u32>, MeshError> {
        let accessor = self.root.accessors.get(at).ok_or_else(missing)?;
        is_whole(accessor.component_type)?;
        let numbers = self.numbers(at, 1)?;
        Ok(numbers.into_iter().map(|number| number as u32).collect())
    }

    fn whole(&self, places: &Places, count: usize) -> Result<Vec<u32>, MeshError> {
        is_whole(places.component_type)?;
        let numbers = self.elements(&places.data, places.component_type, count, 1)?;
        Ok(numbers.into_iter().map(|number| number as u32).collect())
    }

    /// `count` elements of `width` numbers.
    fn elements(
        &self,
        data: &Data,
        component: u32,
        count: usize,
        width: usize,
    ) -> Result<Vec<f64>, MeshError> {
        let view = data
            .buffer_view
            .and_then(|at| self.root.buffer_views.get(at));
        let view = view.ok_or_else(missing)?;
        let bytes = view.bytes(&self.buffers).ok_or_else(missing)?;
        let size = match component {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            5125 | 5126 => 4,
            other => return Err(wrong(&format!("{other} is not a type of numbers"))),
        };
        let length = size * width;
        let stride = view.byte_stride.unwrap_or(length);
        if stride < length {
            return Err(wrong("the elements of a view overlap"));
        }
        let mut numbers = Vec::new();
        for element in 0..count {
            let start = element.checked_mul(stride);
            let start = start.and_then(|at| at.checked_add(data.byte_offset));
            let end = start.and_then(|at| at.checked_add(length));
            let bytes = start
                .zip(end)
                .and_then(|(start, end)| bytes.get(start..end));
            let bytes = bytes.ok_or_else(missing)?;
            numbers.extend(bytes.chunks_exact(size).map(|part| value(part, component)));
        }
        Ok(numbers)
    }
}

/// Refuses places with fractions or signs.
fn is_whole(component: u32) -> Result<(), MeshError> {
    match component {
        5121 | 5123 | 5125 => Ok(()),
        _ => Err(wrong("the places of vertices are not unsigned numbers")),
    }
}

fn value(bytes: &[u8], component: u32) -> f64 {
    let mut four = [0; 4];
    four[..bytes.len()].copy_from_slice(bytes);
    let whole = u32::from_le_bytes(four);
    match component {
        5126 => f64::from(f32::from_bits(whole)),
        5120 => f64::from(bytes[0] as i8),
        5122 => f64::from(whole as u16 as i16),
        _ => f64::from(whole),
    }
}

/// The number that means 1 in a normalized accessor.
fn greatest(component: u32) -> f64 {
    match component {
        5120 => f64::from(i8::MAX),
        5121 => f64::from(u8::MAX),
        5122 => f64::from(i16::MAX),
        5123 => f64::from(u16::MAX),
        5125 => f64::from(u32::MAX),
        _ => 1.0,
    }
}
