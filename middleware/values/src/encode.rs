//! From values to bytes of CDR.

use crate::checks::{check_bound, check_range, count, misfit};
use crate::error::ValueError;
use crate::types::{Member, Named, Primitive, Struct, Type};
use crate::value::Value;
use rc_middleware::Writer;

/// The body of a structure: a sample, the parameters of a request, or a reply.
pub fn encode_body(value: &Value) -> Result<Vec<u8>, ValueError> {
    let mut writer = Writer::default();
    encode(value, &mut writer)?;
    writer.finish()?;
    Ok(writer.into_bytes())
}

/// Writes a structure after an envelope. Checks types, bounds and ranges.
pub fn encode(value: &Value, writer: &mut Writer<'_>) -> Result<(), ValueError> {
    match value {
        Value::Struct(ty, values) => structure(ty, values, writer),
        _ => Err(ValueError::new("a body is a structure")),
    }
}

fn structure(ty: &Struct, values: &[Value], writer: &mut Writer<'_>) -> Result<(), ValueError> {
    if values.len() != ty.members.len() {
        return Err(misfit(&ty.name));
    }
    if values.is_empty() {
        // An empty structure holds one octet.
        writer.put(&0_u8);
    }
    for (of, value) in ty.members.iter().zip(values) {
        member(of, value, writer).map_err(|error| error.in_member(&of.name))?;
    }
    Ok(())
}

fn member(member: &Member, value: &Value, writer: &mut Writer<'_>) -> Result<(), ValueError> {
    if member.optional {
        writer.length(usize::from(*value != Value::Missing));
        if *value == Value::Missing {
            return Ok(());
        }
    }
    check_range(member, value)?;
    self::value(&member.ty, value, writer)
}

fn value(ty: &Type, value: &Value, writer: &mut Writer<'_>) -> Result<(), ValueError> {
    match (ty, value) {
        (Type::Primitive(primitive), value) => return number(*primitive, value, writer),
        (Type::Text { bound }, Value::Text(text)) => {
            check_bound(text.len(), *bound)?;
            writer.put(text);
            writer.finish()?;
        }
        (Type::Sequence { element, bound }, items) => {
            let length = count(items).ok_or_else(|| misfit(ty))?;
            check_bound(length, *bound)?;
            writer.length(length);
            return elements(element, items, writer);
        }
        (Type::Array { element, length }, items) => {
            if count(items) != Some(*length as usize) {
                return Err(misfit(ty));
            }
            return elements(element, items, writer);
        }
        (Type::Dictionary { key, value: of }, Value::Map(pairs)) => {
            writer.length(pairs.len());
            for (name, item) in pairs {
                let place = |error: ValueError| error.in_element(name.plain());
                self::value(key, name, writer).map_err(place)?;
                self::value(of, item, writer).map_err(place)?;
            }
        }
        (Type::Named(Named::Enum(of)), Value::Enum(_, number)) => {
            of.name_of(*number).ok_or_else(|| misfit(ty))?;
            writer.put(number);
        }
        (Type::Named(Named::Struct(of)), Value::Struct(_, values)) => {
            return structure(of, values, writer);
        }
        _ => return Err(misfit(ty)),
    }
    Ok(())
}

fn elements(element: &Type, items: &Value, writer: &mut Writer<'_>) -> Result<(), ValueError> {
    match (element, items) {
        (Type::Primitive(primitive), Value::Numbers(numbers))
            if numbers.primitive() == *primitive =>
        {
            numbers.encode(writer);
            Ok(())
        }
        (_, Value::Sequence(items)) => {
            for (at, item) in items.iter().enumerate() {
                value(element, item, writer).map_err(|error| error.in_element(at))?;
            }
            Ok(())
        }
        _ => Err(misfit(format!("sequence of {element}"))),
    }
}

fn number(primitive: Primitive, value: &Value, writer: &mut Writer<'_>) -> Result<(), ValueError> {
    let mut numbers = crate::Numbers::empty(primitive);
    if !numbers.push(value) {
        return Err(misfit(primitive.word()));
    }
    numbers.encode(writer);
    Ok(())
}
