//! The members of a converted structure.

use rc_values::{Member, Named, Numbers, Primitive, Struct, Type, Value};
use rc_vocabulary::Class;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A member of a converted structure.
#[derive(Debug)]
pub(super) enum Slot {
    /// Unchanged: its number.
    Keep(usize),
    /// Numbers of the wanted prototype.
    New(Tree),
    /// A structure, some of whose members stay.
    Inner(usize, Arc<Struct>, Vec<Slot>),
}

/// Members of the wanted prototype.
#[derive(Debug)]
pub(super) enum Tree {
    Number(usize, Primitive, Option<String>),
    Fields(Vec<(String, Tree)>),
}

/// Paths of numbers as nested members, in their order; elements of arrays in that of their places.
pub(super) fn fields(leaves: Vec<(Vec<String>, Tree)>) -> Vec<(String, Tree)> {
    let mut out: Vec<(String, Vec<(Vec<String>, Tree)>)> = Vec::new();
    for (path, leaf) in leaves {
        let Some((first, rest)) = path.split_first() else {
            continue;
        };
        let inner = (rest.to_vec(), leaf);
        match out.iter_mut().find(|(name, _)| name == first) {
            Some((_, all)) => all.push(inner),
            None => out.push((first.clone(), vec![inner])),
        }
    }
    let tree = |mut inner: Vec<(Vec<String>, Tree)>| match inner.as_slice() {
        [(rest, _)] if rest.is_empty() => inner.remove(0).1,
        _ => Tree::Fields(fields(inner)),
    };
    let out = out.into_iter().map(|(name, inner)| (name, tree(inner)));
    let mut out: Vec<(String, Tree)> = out.collect();
    let place = |name: &str| name.parse::<usize>().ok();
    if out.iter().all(|(name, _)| place(name).is_some()) {
        out.sort_by_key(|(name, _)| place(name));
    }
    out
}

/// The members of a converted structure: those without numbers of the first prototype, and those of
/// the wanted one.
pub(super) fn merged(
    ty: &Struct,
    prefix: &[String],
    sources: &BTreeSet<Vec<String>>,
    mut fields: Vec<(String, Tree)>,
) -> (Struct, Vec<Slot>) {
    let (mut members, mut slots) = (Vec::new(), Vec::new());
    for (at, member) in ty.members.iter().enumerate() {
        let path = [prefix, std::slice::from_ref(&member.name)].concat();
        let holds = sources.iter().any(|source| source.starts_with(&path));
        let new = fields.iter().position(|(name, _)| *name == member.name);
        let new = new.map(|at| fields.remove(at).1);
        match (&member.ty, new) {
            (Type::Named(Named::Struct(inner)), new)
                if holds && !matches!(new, Some(Tree::Number(..))) =>
            {
                let inner_fields = match new {
                    Some(Tree::Fields(fields)) => fields,
                    _ => Vec::new(),
                };
                let (inner, inner_slots) = merged(inner, &path, sources, inner_fields);
                if !inner_slots.is_empty() {
                    let inner = Arc::new(inner);
                    slots.push(Slot::Inner(at, Arc::clone(&inner), inner_slots));
                    members.push(new_member(
                        &member.name,
                        Type::Named(Named::Struct(inner)),
                        None,
                    ));
                }
            }
            (_, Some(tree)) => {
                members.push(tree.member(&member.name));
                slots.push(Slot::New(tree));
            }
            (_, None) if !holds => {
                slots.push(Slot::Keep(at));
                members.push(member.clone());
            }
            _ => {}
        }
    }
    for (name, tree) in fields {
        members.push(tree.member(&name));
        slots.push(Slot::New(tree));
    }
    (Struct::new(ty.name.clone(), members), slots)
}

fn new_member(name: &str, ty: Type, unit: Option<String>) -> Member {
    Member {
        name: name.to_owned(),
        ty,
        optional: false,
        unit,
        range: None,
        default: None,
    }
}

impl Tree {
    /// Whether these are the elements of an array.
    fn is_array(fields: &[(String, Self)]) -> bool {
        let mut places = (0_usize..).zip(fields);
        places.all(|(at, (name, _))| name.parse() == Ok(at))
    }

    fn ty(&self) -> Type {
        match self {
            Self::Number(_, number, _) => Type::Primitive(*number),
            Self::Fields(fields) if Self::is_array(fields) => Type::Array {
                element: Arc::new(
                    fields
                        .first()
                        .map_or(Type::Primitive(Primitive::F64), |(_, first)| first.ty()),
                ),
                length: u32::try_from(fields.len()).unwrap_or(u32::MAX),
            },
            Self::Fields(fields) => {
                let members = fields.iter().map(|(name, tree)| tree.member(name));
                Type::Named(Named::Struct(Arc::new(Struct::new(
                    String::new(),
                    members.collect(),
                ))))
            }
        }
    }

    fn member(&self, name: &str) -> Member {
        let unit = match self {
            Self::Number(_, _, unit) => unit.clone(),
            Self::Fields(_) => None,
        };
        new_member(name, self.ty(), unit)
    }

    pub(super) fn value(&self, results: &[f64]) -> Value {
        match self {
            Self::Number(at, number, _) => {
                let value = results.get(*at).copied().unwrap_or(f64::NAN);
                of_number(value, *number)
            }
            Self::Fields(fields) => {
                let values: Vec<Value> =
                    fields.iter().map(|(_, tree)| tree.value(results)).collect();
                match self.ty() {
                    Type::Named(Named::Struct(ty)) => Value::Struct(ty, values),
                    Type::Array { element, .. } => elements(&element, values),
                    Type::Primitive(_)
                    | Type::Text { .. }
                    | Type::Sequence { .. }
                    | Type::Dictionary { .. }
                    | Type::Named(_) => Value::Sequence(values),
                }
            }
        }
    }
}

/// The elements of an array.
fn elements(element: &Type, values: Vec<Value>) -> Value {
    let Type::Primitive(number) = element else {
        return Value::Sequence(values);
    };
    let mut numbers = Numbers::empty(*number);
    if values.iter().all(|value| numbers.push(value)) {
        return Value::Numbers(numbers);
    }
    Value::Sequence(values)
}

/// A result, which the formula has rounded to the type.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the formula refuses numbers that do not fit"
)]
fn of_number(value: f64, number: Primitive) -> Value {
    match (number.class(), number.size()) {
        (Class::Float, ..=4) => Value::F32(value as f32),
        (Class::Float, _) => Value::F64(value),
        (Class::Unsigned, 8..) => Value::Uint(value as u64),
        (Class::Unsigned | Class::Signed | Class::Bool, _) => Value::Int(value as i64),
    }
}
