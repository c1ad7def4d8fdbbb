//! From JSON to values, and default values.

use crate::budget::Budget;
use crate::checks::{check_bound, check_range};
use crate::error::ValueError;
use crate::numbers::Numbers;
use crate::types::{Member, Named, Primitive, Struct, Type};
use crate::value::Value;
use rc_diagnostics::foreign::clean;
use rc_diagnostics::nearest;
use rc_vocabulary::Class;
use serde_json::Value as Json;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Reads a structure from a JSON object. Missing members have their default values.
pub fn from_json(ty: &Arc<Struct>, json: &Json) -> Result<Value, ValueError> {
    structure(ty, Some(json), &mut Budget::of(size(json)))
}

/// The structure with all members at their defaults.
pub fn default(ty: &Arc<Struct>) -> Result<Value, ValueError> {
    structure(ty, None, &mut Budget::of(0))
}

/// Reads a value of any type.
pub(crate) fn of_type(ty: &Type, json: &Json) -> Result<Value, ValueError> {
    value(ty, json, &mut Budget::of(size(json)))
}

/// About how many bytes the JSON text has.
fn size(json: &Json) -> usize {
    match json {
        Json::Null | Json::Bool(_) | Json::Number(_) => 8,
        Json::String(text) => text.len() + 2,
        Json::Array(items) => 2 + items.iter().map(size).sum::<usize>(),
        Json::Object(items) => {
            let items = items.iter().map(|(key, value)| key.len() + 4 + size(value));
            2 + items.sum::<usize>()
        }
    }
}

fn structure(
    ty: &Arc<Struct>,
    json: Option<&Json>,
    budget: &mut Budget,
) -> Result<Value, ValueError> {
    let object = match json {
        None => None,
        Some(Json::Object(object)) => Some(object),
        Some(other) => return Err(expected(&format!("an object of `{}`", ty.name), other)),
    };
    if let Some(object) = object {
        let members: BTreeSet<&str> = ty.members.iter().map(|m| m.name.as_str()).collect();
        let mut names = object.keys();
        if let Some(name) = names.find(|name| !members.contains(name.as_str())) {
            return Err(unknown(ty, name));
        }
    }
    budget.take_values(ty.members.len())?;
    let mut values = Vec::with_capacity(ty.members.len());
    for member in &ty.members {
        let found = object.and_then(|object| object.get(&member.name));
        let value = self::member(member, found, budget);
        values.push(value.map_err(|error| error.in_member(&member.name))?);
    }
    Ok(Value::Struct(Arc::clone(ty), values))
}

fn unknown(ty: &Struct, name: &str) -> ValueError {
    let names = ty.members.iter().map(|member| member.name.as_str());
    let near = nearest(name, names.clone());
    let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    let all: Vec<&str> = names.collect();
    let has = match all.as_slice() {
        [] => "it has none".to_owned(),
        all => format!("expected {}", all.join(", ")),
    };
    ValueError::new(format!(
        "`{}` has no member `{}`{near}: {has}",
        ty.name,
        clean(name)
    ))
}

fn member(member: &Member, json: Option<&Json>, budget: &mut Budget) -> Result<Value, ValueError> {
    let value = match (json, &member.default) {
        (Some(Json::Null) | None, _) if member.optional => return Ok(Value::Missing),
        (Some(json), _) | (None, Some(json)) => value(&member.ty, json, budget)?,
        (None, None) => default_of(&member.ty, budget)?,
    };
    check_range(member, &value)?;
    Ok(value)
}

fn default_of(ty: &Type, budget: &mut Budget) -> Result<Value, ValueError> {
    Ok(match ty {
        Type::Primitive(primitive) => {
            let zero = Numbers::zeros(*primitive, 1).get(0);
            zero.unwrap_or(Value::Missing)
        }
        Type::Text { .. } => Value::Text(String::new()),
        Type::Sequence { element, .. } => match element.as_ref() {
            Type::Primitive(primitive) => Value::Numbers(Numbers::empty(*primitive)),
            Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }
            | Type::Named(_) => Value::Sequence(Vec::new()),
        },
        Type::Array { element, length } => {
            let count = *length as usize;
            if let Type::Primitive(primitive) = element.as_ref() {
                budget.take(count, primitive.size())?;
                return Ok(Value::Numbers(Numbers::zeros(*primitive, count)));
            }
            budget.take_values(count)?;
            let items = (0..count).map(|_| default_of(element, budget));
            Value::Sequence(items.collect::<Result<_, _>>()?)
        }
        Type::Dictionary { .. } => Value::Map(Vec::new()),
        Type::Named(Named::Enum(of)) => {
            let first = of.values.first().map_or(0, |(_, number)| *number);
            Value::Enum(Arc::clone(of), first)
        }
        Type::Named(Named::Struct(of)) => structure(of, None, budget)?,
    })
}

fn expected(what: &str, found: &Json) -> ValueError {
    ValueError::new(format!(
        "expected {what}, found `{}`",
        clean(&found.to_string())
    ))
}

fn value(ty: &Type, json: &Json, budget: &mut Budget) -> Result<Value, ValueError> {
    let misfit = |what: &str| expected(what, json);
    Ok(match ty {
        Type::Primitive(primitive) => number(*primitive, json)?,
        Type::Text { bound } => {
            let text = json.as_str().ok_or_else(|| misfit("a text in quotes"))?;
            check_bound(text.len(), *bound)?;
            if text.contains('\0') {
                return Err(ValueError::new("a string holds a zero byte"));
            }
            budget.take(text.len(), 1)?;
            Value::Text(text.to_owned())
        }
        Type::Sequence { element, bound } => {
            let items = json.as_array().ok_or_else(|| misfit("a list"))?;
            check_bound(items.len(), *bound)?;
            elements(element, items, budget)?
        }
        Type::Array { element, length } => {
            let items = json
                .as_array()
                .filter(|items| items.len() == *length as usize);
            let items = items.ok_or_else(|| misfit(&format!("a list of {length} elements")))?;
            elements(element, items, budget)?
        }
        Type::Dictionary { key, value: of } => {
            let items = json.as_object().ok_or_else(|| misfit("an object"))?;
            budget.take_values(2 * items.len())?;
            let mut pairs = Vec::with_capacity(items.len());
            for (name, item) in items {
                let pair =
                    map_key(key, name, budget).and_then(|key| Ok((key, value(of, item, budget)?)));
                pairs.push(pair.map_err(|error| error.in_element(clean(name)))?);
            }
            Value::Map(pairs)
        }
        Type::Named(Named::Enum(of)) => {
            let names = of.values.iter().map(|(name, _)| name.as_str());
            let number = match json {
                Json::String(name) => of.number_of(name),
                Json::Number(number) => {
                    let number = number.as_i64().and_then(|n| i32::try_from(n).ok());
                    number.filter(|n| of.name_of(*n).is_some())
                }
                _ => None,
            };
            let number = number.ok_or_else(|| {
                let all: Vec<&str> = names.clone().collect();
                let near = json.as_str().and_then(|name| nearest(name, names.clone()));
                let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                ValueError {
                    reason: misfit(&format!("one of {}", all.join(", "))).reason + &near,
                    path: String::new(),
                }
            })?;
            Value::Enum(Arc::clone(of), number)
        }
        Type::Named(Named::Struct(of)) => structure(of, Some(json), budget)?,
    })
}

/// A key of an object, which is a text in JSON.
fn map_key(ty: &Type, name: &str, budget: &mut Budget) -> Result<Value, ValueError> {
    let text = Json::String(name.to_owned());
    match ty {
        Type::Text { .. } | Type::Named(Named::Enum(_)) => value(ty, &text, budget),
        Type::Primitive(_)
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. }
        | Type::Named(Named::Struct(_)) => {
            let json = serde_json::from_str(name).unwrap_or(text);
            value(ty, &json, budget)
        }
    }
}

fn elements(element: &Type, items: &[Json], budget: &mut Budget) -> Result<Value, ValueError> {
    if let Type::Primitive(primitive) = element {
        budget.take(items.len(), primitive.size())?;
        let mut numbers = Numbers::empty(*primitive);
        for (at, item) in items.iter().enumerate() {
            let value = number(*primitive, item).map_err(|error| error.in_element(at))?;
            numbers.push(&value);
        }
        return Ok(Value::Numbers(numbers));
    }
    budget.take_values(items.len())?;
    let mut values = Vec::with_capacity(items.len());
    for (at, item) in items.iter().enumerate() {
        let value = value(element, item, budget);
        values.push(value.map_err(|error| error.in_element(at))?);
    }
    Ok(Value::Sequence(values))
}

fn number(primitive: Primitive, json: &Json) -> Result<Value, ValueError> {
    if let Some((min, max)) = primitive.limits() {
        let number = json.as_i64().map(i128::from);
        let number = number.or_else(|| json.as_u64().map(i128::from));
        // A whole number may be written as 3.0.
        let whole = |n: &f64| n.fract() == 0.0 && n.abs() < 9e15;
        let number = number.or_else(|| json.as_f64().filter(whole).map(|n| n as i128));
        let number = number.filter(|number| (min..=max).contains(number));
        let wanted = || expected(&format!("a whole number from {min} to {max}"), json);
        let number = number.ok_or_else(wanted)?;
        return Ok(match (primitive.class(), primitive.size()) {
            (Class::Unsigned, 8..) => Value::Uint(number as u64),
            (Class::Unsigned | Class::Signed | Class::Bool | Class::Float, _) => {
                Value::Int(number as i64)
            }
        });
    }
    if primitive == Primitive::Bool {
        let value = json
            .as_bool()
            .ok_or_else(|| expected("true or false", json))?;
        return Ok(Value::Bool(value));
    }
    let value = match json {
        Json::String(word) => match word.as_str() {
            "NaN" => Some(f64::NAN),
            "Infinity" => Some(f64::INFINITY),
            "-Infinity" => Some(f64::NEG_INFINITY),
            _ => None,
        },
        other => other.as_f64(),
    };
    let value = value.ok_or_else(|| expected("a number", json))?;
    if primitive == Primitive::F64 {
        return Ok(Value::F64(value));
    }
    let single = value as f32;
    if value.is_finite() && !single.is_finite() {
        let most = f32::MAX;
        return Err(expected(
            &format!("a number from -{most:e} to {most:e}"),
            json,
        ));
    }
    Ok(Value::F32(single))
}
