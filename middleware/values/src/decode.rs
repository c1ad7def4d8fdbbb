//! From bytes of CDR to values.

use crate::budget::Budget;
use crate::checks::{check_bound, check_range};
use crate::error::ValueError;
use crate::image::decode_image;
use crate::numbers::{Element, Numbers};
use crate::types::{Enum, Member, Named, Struct, Type};
use crate::value::Value;
use rc_middleware::{Encoding, Reader};
use std::sync::Arc;

/// Decodes a body: the parameters of an operation, or a structure.
pub fn decode(ty: &Arc<Struct>, encoding: Encoding, body: &[u8]) -> Result<Value, ValueError> {
    match encoding {
        Encoding::Cdr => decode_from(ty, &mut Reader::new(body)),
        Encoding::Image => decode_image(ty, body),
    }
}

/// Decodes the rest of `reader`, for a body after an envelope.
pub fn decode_from(ty: &Arc<Struct>, reader: &mut Reader<'_>) -> Result<Value, ValueError> {
    let mut budget = Budget::of(reader.rest().len());
    structure(ty, reader, &mut budget)
}

fn structure(
    ty: &Arc<Struct>,
    reader: &mut Reader<'_>,
    budget: &mut Budget,
) -> Result<Value, ValueError> {
    if ty.members.is_empty() {
        // An empty structure holds one octet.
        reader.get::<u8>()?;
    }
    budget.take_values(ty.members.len())?;
    let mut values = Vec::with_capacity(ty.members.len());
    for member in &ty.members {
        let value = self::member(member, reader, budget);
        values.push(value.map_err(|error| error.in_member(&member.name))?);
    }
    Ok(Value::Struct(Arc::clone(ty), values))
}

fn member(
    member: &Member,
    reader: &mut Reader<'_>,
    budget: &mut Budget,
) -> Result<Value, ValueError> {
    if member.optional && count_of_optional(reader)? == 0 {
        return Ok(Value::Missing);
    }
    let found = value(&member.ty, reader, budget)?;
    check_range(member, &found)?;
    Ok(found)
}

/// Reads whether there is an optional value: 0 or 1.
pub(crate) fn count_of_optional(reader: &mut Reader<'_>) -> Result<usize, ValueError> {
    match reader.length()? {
        count @ (0 | 1) => Ok(count),
        many => {
            let reason = format!("an optional value has {many} elements, it allows 1");
            Err(ValueError::new(reason))
        }
    }
}

/// Fails if the number has no name.
pub(crate) fn check_enum(of: &Enum, number: i32) -> Result<(), ValueError> {
    if of.name_of(number).is_some() {
        return Ok(());
    }
    let reason = format!("{number} is not a value of `{}`", of.name);
    Err(ValueError::new(reason))
}

pub(crate) fn value(
    ty: &Type,
    reader: &mut Reader<'_>,
    budget: &mut Budget,
) -> Result<Value, ValueError> {
    Ok(match ty {
        Type::Primitive(primitive) => Element::read(*primitive, reader)?.into(),
        Type::Text { bound } => {
            let text: String = reader.get()?;
            check_bound(text.len(), *bound)?;
            budget.take(text.len(), 1)?;
            Value::Text(text)
        }
        Type::Sequence { element, bound } => {
            let length = reader.length()?;
            check_bound(length, *bound)?;
            elements(element, length, reader, budget)?
        }
        Type::Array { element, length } => elements(element, *length as usize, reader, budget)?,
        Type::Dictionary { key, value: of } => {
            let length = reader.length()?;
            let mut pairs = Vec::new();
            for at in 0..length {
                budget.take_values(4)?;
                let key = value(key, reader, budget).map_err(|error| error.in_element(at))?;
                let value = value(of, reader, budget);
                let value = value.map_err(|error| error.in_element(key.plain()))?;
                pairs.push((key, value));
            }
            Value::Map(pairs)
        }
        Type::Named(Named::Enum(of)) => {
            let number: i32 = reader.get()?;
            check_enum(of, number)?;
            Value::Enum(Arc::clone(of), number)
        }
        Type::Named(Named::Struct(of)) => structure(of, reader, budget)?,
    })
}

fn elements(
    element: &Type,
    count: usize,
    reader: &mut Reader<'_>,
    budget: &mut Budget,
) -> Result<Value, ValueError> {
    if let Type::Primitive(primitive) = element {
        budget.take(count, primitive.size())?;
        return Ok(Value::Numbers(Numbers::decode(*primitive, count, reader)?));
    }
    budget.take_values(count)?;
    let mut items = Vec::with_capacity(count);
    for at in 0..count {
        let item = value(element, reader, budget);
        items.push(item.map_err(|error| error.in_element(at))?);
    }
    Ok(Value::Sequence(items))
}
