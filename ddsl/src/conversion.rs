//! What a connection with `convert;` converts: its members, and the plan for the process of the
//! consumer.

use crate::image::image_items;
use crate::units::End;
use rc_conversion::{Item, Number, Part, Place, Plan};
use rc_idsl::Library;
use rc_idsl::model::{Member, Primitive, Type, TypeDeclKind, TypeId};
use rc_quantity::{Conversion as Factor, Unit};
use std::fmt;

/// What a connection converts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conversion {
    /// The members that are converted, in the order of the interface.
    pub members: Vec<Converted>,
    /// The plan that the consumer gets.
    pub plan: Plan,
}

/// A member that is converted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Converted {
    /// `push.x` for a parameter, `Module::Struct.x` for a member.
    pub path: String,
    /// The unit of the sender, as written.
    pub from: String,
    /// The unit of the receiver, as written.
    pub to: String,
    /// The conversion.
    pub factor: Factor,
    /// The type of its numbers.
    pub number: Primitive,
}

impl fmt::Display for Converted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            path,
            from,
            to,
            factor,
            number,
        } = self;
        write!(
            f,
            "{path} {from} {factor} = {to}, {}",
            effort(factor, *number)
        )
    }
}

/// What a number costs and loses: `1 operation a number`.
pub(crate) fn effort(factor: &Factor, number: Primitive) -> String {
    let count = factor.factor().operations();
    let rounded = match kind(number) {
        Some(Number::F32 | Number::F64) | None => "",
        Some(_) => ", rounded to whole numbers",
    };
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} operation{plural} a number{rounded}")
}

impl fmt::Display for Conversion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, member) in self.members.iter().enumerate() {
            if at > 0 {
                f.write_str("; ")?;
            }
            write!(f, "{member}")?;
        }
        Ok(())
    }
}

/// The most values in the plan of a connection.
const MOST: usize = 8192;

/// Why no plan can be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum NoPlan {
    /// The types have too many values, or are too deep.
    TooLarge,
}

/// The plan of a connection whose types are equal and whose units convert.
pub(crate) fn plan(consumer: End<'_>, provider: End<'_>) -> Result<Conversion, NoPlan> {
    let mut out = Conversion {
        members: Vec::new(),
        plan: Plan::default(),
    };
    let operations = |end: End<'_>| end.library.interface(end.interface).operations.len();
    for at in 0..operations(consumer).min(operations(provider)) {
        let mut parts = Vec::new();
        let mut left = MOST;
        let back = Pair {
            from: provider.library,
            to: consumer.library,
        };
        // Requests travel to the provider, samples and replies to the consumer.
        let there = if consumer.subscribes {
            back
        } else {
            Pair {
                from: consumer.library,
                to: provider.library,
            }
        };
        let ours = &consumer.library.interface(consumer.interface).operations[at];
        let theirs = &provider.library.interface(provider.interface).operations[at];
        let (sent, taken) = if consumer.subscribes {
            (theirs, ours)
        } else {
            (ours, theirs)
        };
        let path = ours.name.text.clone();
        let mut members = Members {
            out: &mut out.members,
            left: &mut left,
        };
        let inputs = there.members(&path, &sent.inputs, &taken.inputs, &mut members)?;
        parts.push((Place::Input, inputs));
        if let (Some(one), Some(other)) = (
            sent.topic_in_place(there.from),
            taken.topic_in_place(there.to),
        ) {
            parts.push((Place::InputImage, image_items(&there, one, other)));
        }
        if !consumer.subscribes {
            let mut outputs = back.members(&path, &theirs.outputs, &ours.outputs, &mut members)?;
            if let (Some(one), Some(other)) = (&theirs.result, &ours.result) {
                outputs.extend(back.values(one, other, None, "", &mut members)?);
            }
            parts.push((Place::Output, outputs));
            if let (Some(one), Some(other)) = (
                theirs.result_in_place(back.from),
                ours.result_in_place(back.to),
            ) {
                parts.push((Place::OutputImage, image_items(&back, one, other)));
            }
            for (number, (one, other)) in (0..).zip(theirs.throws.iter().zip(&ours.throws)) {
                let items = back.declared(*one, *other, &mut members)?;
                parts.push((Place::Exception(number), items));
            }
        }
        let operation = u32::try_from(at).unwrap_or(u32::MAX);
        out.plan
            .parts
            .extend(parts.into_iter().filter_map(|(place, items)| {
                let items = merged(items);
                (!items.is_empty()).then_some(Part {
                    operation,
                    place,
                    items,
                })
            }));
    }
    let text = out.plan.to_string();
    let fits = out.plan.is_empty() || text.parse::<Plan>().is_ok();
    if fits { Ok(out) } else { Err(NoPlan::TooLarge) }
}

/// The type of a number. `None` for a `bool`.
pub(crate) fn kind(primitive: Primitive) -> Option<Number> {
    Some(match primitive {
        Primitive::Bool => return None,
        Primitive::I8 => Number::I8,
        Primitive::U8 => Number::U8,
        Primitive::I16 => Number::I16,
        Primitive::U16 => Number::U16,
        Primitive::I32 => Number::I32,
        Primitive::U32 => Number::U32,
        Primitive::I64 => Number::I64,
        Primitive::U64 => Number::U64,
        Primitive::F32 => Number::F32,
        Primitive::F64 => Number::F64,
    })
}

/// The conversion between the units of two members. `None` if their numbers are equal.
pub(crate) fn between(from: Option<&str>, to: Option<&str>) -> Option<Factor> {
    let (from, to) = (Unit::parse(from?).ok()?, Unit::parse(to?).ok()?);
    let factor = from.conversion_to(&to)?;
    (!factor.is_identity()).then_some(factor)
}

/// Joins numbers that follow each other, and leaves out what is behind the last number that is
/// converted.
fn merged(items: Vec<Item>) -> Vec<Item> {
    let mut out = joined(items);
    while out.last().is_some_and(|last| !last.converts()) {
        out.pop();
    }
    out
}

fn joined(items: Vec<Item>) -> Vec<Item> {
    let mut out: Vec<Item> = Vec::new();
    for item in items {
        let item = match item {
            Item::Sequence(items) => Item::Sequence(joined(items)),
            Item::Array(count, items) => match joined(items).as_slice() {
                // An array of numbers is so many numbers.
                [Item::Numbers(1, number, conversion)] => {
                    Item::Numbers(count, *number, *conversion)
                }
                items => Item::Array(count, items.to_vec()),
            },
            Item::Bounded {
                bound,
                padding,
                stride,
                items,
            } => Item::Bounded {
                bound,
                padding,
                stride,
                items: joined(items),
            },
            item => item,
        };
        if let (
            Some(Item::Numbers(count, number, conversion)),
            Item::Numbers(more, next, following),
        ) = (out.last_mut(), &item)
            && (*number, *conversion) == (*next, *following)
            && let Some(sum) = count.checked_add(*more)
        {
            *count = sum;
            continue;
        }
        out.push(item);
    }
    out
}

/// The libraries of sender and receiver.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) from: &'a Library,
    pub(crate) to: &'a Library,
}

/// The members that are found, and how many values the plan may still have.
struct Members<'o> {
    out: &'o mut Vec<Converted>,
    left: &'o mut usize,
}

impl Pair<'_> {
    fn members(
        &self,
        path: &str,
        from: &[Member],
        to: &[Member],
        found: &mut Members<'_>,
    ) -> Result<Vec<Item>, NoPlan> {
        let mut items = Vec::new();
        for (one, other) in from.iter().zip(to) {
            let units = (one.unit.as_deref(), other.unit.as_deref());
            let factor = between(units.0, units.1).zip(units.0.zip(units.1));
            let path = format!("{path}.{}", one.name.text);
            let values = self.values(&one.ty, &other.ty, factor, &path, found)?;
            if one.optional {
                items.push(Item::Sequence(values));
            } else {
                items.extend(values);
            }
        }
        Ok(items)
    }

    fn declared(
        &self,
        from: TypeId,
        to: TypeId,
        found: &mut Members<'_>,
    ) -> Result<Vec<Item>, NoPlan> {
        match (&self.from.ty(from).kind, &self.to.ty(to).kind) {
            (
                TypeDeclKind::Struct(one) | TypeDeclKind::Exception(one),
                TypeDeclKind::Struct(other) | TypeDeclKind::Exception(other),
            ) => self.members(&self.from.type_path(from), one, other, found),
            _ => Ok(vec![Item::Numbers(1, Number::I32, None)]),
        }
    }

    /// The values of a type. `factor` converts its own numbers, which `path` names: elements of
    /// sequences and arrays, and the values of a dictionary.
    fn values(
        &self,
        from: &Type,
        to: &Type,
        factor: Option<(Factor, (&str, &str))>,
        path: &str,
        found: &mut Members<'_>,
    ) -> Result<Vec<Item>, NoPlan> {
        *found.left = found.left.checked_sub(1).ok_or(NoPlan::TooLarge)?;
        let (from, to) = (self.from.resolved(from), self.to.resolved(to));
        Ok(match (from, to) {
            (Type::Primitive(number), _) => {
                let own = kind(*number).unwrap_or(Number::U8);
                let Some((factor, (unit, wanted))) = factor.filter(|_| kind(*number).is_some())
                else {
                    return Ok(vec![Item::Numbers(1, own, None)]);
                };
                let converted = Converted {
                    path: path.to_owned(),
                    from: unit.to_owned(),
                    to: wanted.to_owned(),
                    factor,
                    number: *number,
                };
                // A structure that occurs twice is listed once.
                if !found.out.contains(&converted) {
                    found.out.push(converted);
                }
                vec![Item::Numbers(1, own, Some(factor))]
            }
            (Type::Sequence(one, _), Type::Sequence(other, _)) => {
                vec![Item::Sequence(
                    self.values(one, other, factor, path, found)?,
                )]
            }
            (Type::Array(one, count), Type::Array(other, _)) => {
                let items = self.values(one, other, factor, path, found)?;
                vec![Item::Array(*count, items)]
            }
            (Type::Dictionary(key, value), Type::Dictionary(other_key, other_value)) => {
                let mut items = self.values(key, other_key, None, path, found)?;
                items.extend(self.values(value, other_value, factor, path, found)?);
                vec![Item::Sequence(items)]
            }
            (Type::Named(one), Type::Named(other)) => self.declared(*one, *other, found)?,
            _ => vec![Item::Text],
        })
    }
}
