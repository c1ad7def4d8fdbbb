//! The memory image of a plain type: from bytes to values and back. The layout is that of C on a
//! 64-bit machine, see `rc_middleware::in_place`.

use crate::budget::Budget;
use crate::checks::{check_bound, check_range, count, misfit};
use crate::error::ValueError;
use crate::numbers::Numbers;
use crate::types::{self, Layout, Member, Named, Primitive, Struct, Type};
use crate::value::Value;
use rc_middleware::{Reader, Writer};
use std::sync::Arc;

/// Decodes a memory image. A length above its bound counts as the bound.
pub fn decode_image(ty: &Arc<Struct>, bytes: &[u8]) -> Result<Value, ValueError> {
    check_size(ty, bytes)?;
    let mut budget = Budget::of(bytes.len());
    read_structure(ty, bytes, &mut budget)
}

/// Fails where [`decode_image`] fails, and makes no value. Numbers without a range are not read.
pub fn check_image(ty: &Struct, bytes: &[u8]) -> Result<(), ValueError> {
    check_size(ty, bytes)?;
    check_structure(ty, bytes)
}

fn check_size(ty: &Struct, bytes: &[u8]) -> Result<(), ValueError> {
    let layout = layout(ty.layout, &ty.name)?;
    if layout.size == bytes.len() {
        return Ok(());
    }
    let (length, size) = (bytes.len(), layout.size);
    let name = &ty.name;
    let reason = format!("{length} bytes are not `{name}` in place, which has {size}");
    Err(ValueError::new(reason))
}

/// The memory image of a structure whose type has one. Unused elements are zero.
pub fn encode_image(value: &Value) -> Result<Vec<u8>, ValueError> {
    let Value::Struct(ty, _) = value else {
        return Err(ValueError::new("a body is a structure"));
    };
    let layout = layout(ty.layout, &ty.name)?;
    let mut bytes = vec![0; layout.size];
    write(
        &Type::Named(Named::Struct(Arc::clone(ty))),
        value,
        &mut bytes,
    )?;
    Ok(bytes)
}

fn layout(of: Option<Layout>, name: &str) -> Result<Layout, ValueError> {
    of.ok_or_else(|| ValueError::new(format!("`{name}` has no memory image")))
}

/// The part of an image that starts at `at`.
fn part(bytes: &[u8], at: usize, size: usize) -> Result<&[u8], ValueError> {
    let part = at.checked_add(size).and_then(|end| bytes.get(at..end));
    part.ok_or_else(|| ValueError::new("the image ends too early"))
}

/// The members of a structure, each with the offset and the size of its image.
pub fn image_members(
    ty: &Struct,
) -> impl Iterator<Item = Result<(&Member, usize, usize), ValueError>> {
    members(ty)
}

/// Reads the image of a member.
pub fn read_member_image(member: &Member, bytes: &[u8]) -> Result<Value, ValueError> {
    read_member(member, bytes, &mut Budget::of(bytes.len()))
}

/// Writes the image of a member, after checking the value. Unused elements keep their bytes.
pub fn write_member_image(
    member: &Member,
    value: &Value,
    bytes: &mut [u8],
) -> Result<(), ValueError> {
    write_member(member, value, bytes)
}

/// The members of a structure, each with its offset.
fn members(ty: &Struct) -> impl Iterator<Item = Result<(&Member, usize, usize), ValueError>> {
    let mut end = 0_usize;
    ty.members.iter().map(move |member| {
        let layout = layout(member.layout(), &member.name)?;
        let at = end.next_multiple_of(layout.align);
        end = at + layout.size;
        Ok((member, at, layout.size))
    })
}

fn read_structure(
    ty: &Arc<Struct>,
    bytes: &[u8],
    budget: &mut Budget,
) -> Result<Value, ValueError> {
    budget.take_values(ty.members.len())?;
    let mut values = Vec::with_capacity(ty.members.len());
    for member in members(ty) {
        let (member, at, size) = member?;
        let value = part(bytes, at, size).and_then(|bytes| read_member(member, bytes, budget));
        values.push(value.map_err(|error| error.in_member(&member.name))?);
    }
    Ok(Value::Struct(Arc::clone(ty), values))
}

fn read_member(member: &Member, bytes: &[u8], budget: &mut Budget) -> Result<Value, ValueError> {
    let value = if member.optional {
        let (used, items, size) = counted(&member.ty, bytes, 1)?;
        if used == 0 {
            return Ok(Value::Missing);
        }
        read(&member.ty, part(items, 0, size)?, budget)?
    } else {
        read(&member.ty, bytes, budget)?
    };
    check_range(member, &value)?;
    Ok(value)
}

/// The number of used elements, the bytes of all elements, and the size of one.
fn counted<'b>(
    element: &Type,
    bytes: &'b [u8],
    bound: u32,
) -> Result<(usize, &'b [u8], usize), ValueError> {
    let of = layout(types::layout(element), &element.to_string())?;
    let length: u32 = Reader::new(part(bytes, 0, 4)?).get()?;
    let start = 4_usize.next_multiple_of(of.align);
    let items = part(bytes, start, of.size.saturating_mul(bound as usize))?;
    Ok((length.min(bound) as usize, items, of.size))
}

fn read(ty: &Type, bytes: &[u8], budget: &mut Budget) -> Result<Value, ValueError> {
    match ty {
        Type::Primitive(primitive) => {
            let one = Numbers::decode(*primitive, 1, &mut Reader::new(bytes))?;
            one.get(0).ok_or_else(|| misfit(ty))
        }
        Type::Text { bound } => {
            let byte = Type::Primitive(Primitive::U8);
            let (used, items, _) = counted(&byte, bytes, bound.unwrap_or(0))?;
            let text = std::str::from_utf8(part(items, 0, used)?);
            let text = text.map_err(|_| ValueError::new("a string is not UTF-8"))?;
            if text.contains('\0') {
                return Err(ValueError::new("a string holds a zero byte"));
            }
            budget.take(text.len(), 1)?;
            Ok(Value::Text(text.to_owned()))
        }
        Type::Sequence { element, bound } => {
            let (used, items, size) = counted(element, bytes, bound.unwrap_or(0))?;
            read_elements(element, used, size, items, budget)
        }
        Type::Array { element, length } => {
            let of = layout(types::layout(element), &element.to_string())?;
            read_elements(element, *length as usize, of.size, bytes, budget)
        }
        Type::Named(Named::Enum(of)) => {
            let number: i32 = Reader::new(bytes).get()?;
            if of.name_of(number).is_none() {
                let reason = format!("{number} is not a value of `{}`", of.name);
                return Err(ValueError::new(reason));
            }
            Ok(Value::Enum(Arc::clone(of), number))
        }
        Type::Named(Named::Struct(of)) => read_structure(of, bytes, budget),
        Type::Dictionary { .. } => Err(misfit("type with a memory image")),
    }
}

fn read_elements(
    element: &Type,
    count: usize,
    size: usize,
    bytes: &[u8],
    budget: &mut Budget,
) -> Result<Value, ValueError> {
    if let Type::Primitive(primitive) = element {
        budget.take(count, size)?;
        let bytes = part(bytes, 0, count.saturating_mul(size))?;
        let numbers = Numbers::decode(*primitive, count, &mut Reader::new(bytes))?;
        return Ok(Value::Numbers(numbers));
    }
    budget.take_values(count)?;
    let mut items = Vec::with_capacity(count);
    for at in 0..count {
        let item = part(bytes, at.saturating_mul(size), size);
        let item = item.and_then(|bytes| read(element, bytes, budget));
        items.push(item.map_err(|error| error.in_element(at))?);
    }
    Ok(Value::Sequence(items))
}

/// Whether every pattern of bytes is a value of a type.
fn has_all_patterns(ty: &Type) -> bool {
    match ty {
        Type::Primitive(primitive) => *primitive != Primitive::Bool,
        Type::Sequence { element, .. } | Type::Array { element, .. } => has_all_patterns(element),
        Type::Named(Named::Struct(of)) => of.members.iter().all(is_unchecked),
        Type::Named(Named::Enum(_)) | Type::Text { .. } | Type::Dictionary { .. } => false,
    }
}

fn is_unchecked(member: &Member) -> bool {
    member.range.is_none() && has_all_patterns(&member.ty)
}

fn check_structure(ty: &Struct, bytes: &[u8]) -> Result<(), ValueError> {
    for member in members(ty) {
        let (member, at, size) = member?;
        if !is_unchecked(member) {
            let checked = part(bytes, at, size).and_then(|bytes| check_member(member, bytes));
            checked.map_err(|error| error.in_member(&member.name))?;
        }
    }
    Ok(())
}

fn check_member(member: &Member, bytes: &[u8]) -> Result<(), ValueError> {
    if member.range.is_some() {
        return read_member_image(member, bytes).map(drop);
    }
    if !member.optional {
        return check(&member.ty, bytes);
    }
    match counted(&member.ty, bytes, 1)? {
        (0, ..) => Ok(()),
        (_, items, size) => check(&member.ty, part(items, 0, size)?),
    }
}

fn check(ty: &Type, bytes: &[u8]) -> Result<(), ValueError> {
    match ty {
        Type::Sequence { element, bound } => {
            let (used, items, size) = counted(element, bytes, bound.unwrap_or(0))?;
            check_elements(element, used, size, items)
        }
        Type::Array { element, length } => {
            let of = layout(types::layout(element), &element.to_string())?;
            check_elements(element, *length as usize, of.size, bytes)
        }
        Type::Named(Named::Struct(of)) => check_structure(of, bytes),
        Type::Named(Named::Enum(_))
        | Type::Primitive(_)
        | Type::Text { .. }
        | Type::Dictionary { .. } => read(ty, bytes, &mut Budget::of(bytes.len())).map(drop),
    }
}

fn check_elements(
    element: &Type,
    count: usize,
    size: usize,
    bytes: &[u8],
) -> Result<(), ValueError> {
    if has_all_patterns(element) {
        return Ok(());
    }
    for at in 0..count {
        let item = part(bytes, at.saturating_mul(size), size);
        let checked = item.and_then(|bytes| check(element, bytes));
        checked.map_err(|error| error.in_element(at))?;
    }
    Ok(())
}

/// The part of an image that starts at `at`, for writing.
fn part_mut(bytes: &mut [u8], at: usize, size: usize) -> Result<&mut [u8], ValueError> {
    let part = at.checked_add(size).and_then(|end| bytes.get_mut(at..end));
    part.ok_or_else(|| ValueError::new("the image ends too early"))
}

fn write(ty: &Type, value: &Value, bytes: &mut [u8]) -> Result<(), ValueError> {
    match (ty, value) {
        (Type::Primitive(primitive), value) => {
            let mut one = Numbers::empty(*primitive);
            if !one.push(value) {
                return Err(misfit(ty));
            }
            put(&one, bytes)
        }
        (Type::Text { bound }, Value::Text(text)) => {
            check_bound(text.len(), *bound)?;
            if text.contains('\0') {
                return Err(ValueError::new("a string holds a zero byte"));
            }
            put(&Numbers::U32(vec![text.len() as u32]), bytes)?;
            part_mut(bytes, 4, text.len())?.copy_from_slice(text.as_bytes());
            Ok(())
        }
        (Type::Sequence { element, bound }, items) => {
            let length = count(items).ok_or_else(|| misfit(ty))?;
            check_bound(length, *bound)?;
            put(&Numbers::U32(vec![length as u32]), bytes)?;
            let of = layout(types::layout(element), &element.to_string())?;
            let start = 4_usize.next_multiple_of(of.align);
            let rest = bytes.get_mut(start..).unwrap_or_default();
            write_elements(element, items, of.size, rest)
        }
        (Type::Array { element, length }, items) => {
            if count(items) != Some(*length as usize) {
                return Err(misfit(ty));
            }
            let of = layout(types::layout(element), &element.to_string())?;
            write_elements(element, items, of.size, bytes)
        }
        (Type::Named(Named::Enum(of)), Value::Enum(_, number)) => {
            of.name_of(*number).ok_or_else(|| misfit(ty))?;
            put(&Numbers::I32(vec![*number]), bytes)
        }
        (Type::Named(Named::Struct(of)), Value::Struct(_, values))
            if values.len() == of.members.len() =>
        {
            for (member, value) in members(of).zip(values) {
                let (member, at, size) = member?;
                let place = part_mut(bytes, at, size)?;
                let written = write_member(member, value, place);
                written.map_err(|error| error.in_member(&member.name))?;
            }
            Ok(())
        }
        _ => Err(misfit(ty)),
    }
}

fn write_member(member: &Member, value: &Value, bytes: &mut [u8]) -> Result<(), ValueError> {
    if !member.optional {
        check_range(member, value)?;
        return write(&member.ty, value, bytes);
    }
    let is_there = *value != Value::Missing;
    put(&Numbers::U32(vec![u32::from(is_there)]), bytes)?;
    if !is_there {
        return Ok(());
    }
    check_range(member, value)?;
    let of = layout(types::layout(&member.ty), &member.name)?;
    let start = 4_usize.next_multiple_of(of.align);
    write(&member.ty, value, part_mut(bytes, start, of.size)?)
}

fn write_elements(
    element: &Type,
    items: &Value,
    size: usize,
    bytes: &mut [u8],
) -> Result<(), ValueError> {
    match (element, items) {
        (Type::Primitive(of), Value::Numbers(numbers)) if numbers.primitive() == *of => {
            put(numbers, bytes)
        }
        (_, Value::Sequence(items)) => {
            for (at, item) in items.iter().enumerate() {
                let place = part_mut(bytes, at.saturating_mul(size), size)?;
                write(element, item, place).map_err(|error| error.in_element(at))?;
            }
            Ok(())
        }
        _ => Err(misfit(format!("sequence of {element}"))),
    }
}

/// Writes numbers at the start of `bytes`.
fn put(numbers: &Numbers, bytes: &mut [u8]) -> Result<(), ValueError> {
    let mut writer = Writer::default();
    numbers.encode(&mut writer);
    let written = writer.finish()?;
    part_mut(bytes, 0, written.len())?.copy_from_slice(written);
    Ok(())
}
